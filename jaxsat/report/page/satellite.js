// The satellite: a cube, or the box of its body, whose faces have the colours of their panels, with letters on them where it is seen close by.
import {
  BoxGeometry,
  CanvasTexture,
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
  // size: edges along x, y, z, the longest of them 1.
  constructor(panels, { lettered = false, size = [1, 1, 1] } = {}) {
    super();
    // The box has its faces in the order +x -x +y -y +z -z, as the panels are.
    const [x, y, z] = size;
    const spans = [[y, z], [x, z], [x, y]];
    this.faces = panels.map(({ name, colour }, k) => ({ name, colour, lettered, spans: spans[k >> 1] }));
    this.materials = panels.map(() => new MeshLambertMaterial());
    const box = new BoxGeometry(1, 1, 1);
    if (lettered) upright(box);
    this.add(new Mesh(box, this.materials));
    this.add(new LineSegments(new EdgesGeometry(box), new LineBasicMaterial({ color: 0x14161a })));
    this.children.forEach((part) => part.scale.set(x, y, z));
  }

  // own(colour) is a colour of the data as the scheme has it.
  paint(own) {
    this.faces.forEach(({ name, colour, lettered, spans }, k) => {
      const material = this.materials[k];
      if (!lettered) return void material.color.set(own(colour));
      material.map?.dispose();
      material.map = face(name, own(colour), spans);
      material.needsUpdate = true;
    });
  }
}

// A panel of cells in its colour, with its name; so wide and so high, the shorter edge having so many pixels.
function face(name, colour, [across, up]) {
  const canvas = document.createElement("canvas");
  const shorter = Math.min(across, up);
  const [width, height] = [across, up].map((edge) => Math.round(PIXELS * Math.min(edge / shorter, 8)));
  Object.assign(canvas, { width, height });
  const context = canvas.getContext("2d");
  context.fillStyle = colour;
  context.fillRect(0, 0, width, height);
  context.strokeStyle = "rgba(255, 255, 255, 0.28)";
  context.lineWidth = 2;
  const cell = PIXELS / CELLS;
  for (let at = cell; at < height; at += cell) context.strokeRect(-9, at, width + 18, height);
  for (let at = cell; at < width; at += cell) context.strokeRect(at, -9, width, height + 18);
  context.strokeStyle = "rgba(20, 22, 26, 0.55)";
  context.lineWidth = 10;
  context.strokeRect(0, 0, width, height);
  context.fillStyle = "#ffffff";
  context.strokeStyle = "rgba(20, 22, 26, 0.6)";
  context.lineWidth = 8;
  context.font = "700 104px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  const text = name.replace("-", "−");
  context.strokeText(text, width / 2, height / 2 + 6);
  context.fillText(text, width / 2, height / 2 + 6);
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
