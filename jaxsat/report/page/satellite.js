// The satellite: a cube whose faces have the colours of their panels, with letters on them where it is seen close by.
import {
  BoxGeometry,
  CanvasTexture,
  Color,
  EdgesGeometry,
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshLambertMaterial,
  SRGBColorSpace,
} from "three";

const PIXELS = 256;
const CELLS = 4;

export class Satellite extends Group {
  constructor(panels, { lettered = false } = {}) {
    super();
    // The box has its faces in the order +x -x +y -y +z -z, as the panels are.
    this.materials = panels.map(({ name, colour }) =>
      lettered
        ? new MeshLambertMaterial({ map: face(name, colour) })
        : new MeshLambertMaterial({ color: new Color(colour) }),
    );
    const box = new BoxGeometry(1, 1, 1);
    if (lettered) upright(box);
    this.add(new Mesh(box, this.materials));
    this.add(new LineSegments(new EdgesGeometry(box), new LineBasicMaterial({ color: 0x14161a })));
  }
}

// A panel of cells in its colour, with its name.
function face(name, colour) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = PIXELS;
  const context = canvas.getContext("2d");
  context.fillStyle = colour;
  context.fillRect(0, 0, PIXELS, PIXELS);
  context.strokeStyle = "rgba(255, 255, 255, 0.28)";
  context.lineWidth = 2;
  for (let k = 1; k < CELLS; k++) {
    const at = (k * PIXELS) / CELLS;
    context.strokeRect(-9, at, PIXELS + 18, PIXELS);
    context.strokeRect(at, -9, PIXELS, PIXELS + 18);
  }
  context.strokeStyle = "rgba(20, 22, 26, 0.55)";
  context.lineWidth = 10;
  context.strokeRect(0, 0, PIXELS, PIXELS);
  context.fillStyle = "#ffffff";
  context.strokeStyle = "rgba(20, 22, 26, 0.6)";
  context.lineWidth = 8;
  context.font = "700 104px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  const text = name.replace("-", "−");
  context.strokeText(text, PIXELS / 2, PIXELS / 2 + 6);
  context.fillText(text, PIXELS / 2, PIXELS / 2 + 6);
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = SRGBColorSpace;
  texture.anisotropy = 8;
  return texture;
}

// The box's textures stand upright for y up; here z is up, on the four faces beside it.
function upright(box) {
  const { uv, position } = box.attributes;
  for (let i = 0; i < 16; i++) {
    const [x, y, z] = [position.getX(i), position.getY(i), position.getZ(i)];
    const side = Math.floor(i / 4);
    const across = side === 0 ? y : side === 1 ? -y : side === 2 ? -x : x;
    uv.setXY(i, across + 0.5, z + 0.5);
  }
}
