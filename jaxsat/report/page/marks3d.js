// Lines that are more than a pixel wide, arrows, and letters, in any scene.
import {
  CanvasTexture,
  ConeGeometry,
  CylinderGeometry,
  Group,
  Mesh,
  MeshBasicMaterial,
  SRGBColorSpace,
  Sprite,
  SpriteMaterial,
  Vector3,
} from "three";
import { Line2 } from "three/addons/lines/Line2.js";
import { LineGeometry } from "three/addons/lines/LineGeometry.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";

const UP = new Vector3(0, 1, 0);

export class Line extends Line2 {
  constructor(points, { width = 1.5, opacity = 1 } = {}) {
    super(new LineGeometry(), new LineMaterial({ linewidth: width, opacity, transparent: opacity < 1 }));
    this.frustumCulled = false;
    if (points) this.through(points);
  }

  // Flat x, y, z; in place where there are as many points as before.
  through(points) {
    const data = this.geometry.attributes.instanceStart?.data;
    if (data?.array.length !== 2 * points.length - 6) {
      this.geometry.setPositions(points);
      return this;
    }
    for (let i = 0; i + 3 < points.length; i += 3) data.array.set(points.slice(i, i + 6), 2 * i);
    data.needsUpdate = true;
    return this;
  }

  paint(colour) {
    this.material.color.set(colour);
  }
}

// From the origin along a direction that is set; its letters keep their size on the screen.
export class Arrow extends Group {
  constructor(label, { length, shaft, letters }) {
    super();
    this.material = new MeshBasicMaterial({ transparent: true });
    const rod = new Mesh(new CylinderGeometry(shaft, shaft, 0.82, 12), this.material);
    rod.position.y = 0.41;
    const head = new Mesh(new ConeGeometry(3 * shaft, 0.18, 20), this.material);
    head.position.y = 0.91;
    this.letters = new Letters(label, letters / length);
    this.letters.position.y = 1.14;
    this.add(rod, head, this.letters);
    this.scale.setScalar(length);
  }

  along(direction) {
    this.quaternion.setFromUnitVectors(UP, direction.clone().normalize());
    return this;
  }

  paint(colour, behind) {
    this.material.color.set(colour);
    this.letters.paint(colour, behind);
  }
}

export class Letters extends Sprite {
  constructor(text, height) {
    super(new SpriteMaterial({ transparent: true, depthTest: false, sizeAttenuation: false }));
    this.text = text;
    this.height = height;
    this.renderOrder = 10;
  }

  // With a rim in the colour behind, so that they are read on anything.
  paint(colour, behind) {
    const canvas = document.createElement("canvas");
    const context = canvas.getContext("2d");
    const font = "600 48px system-ui, sans-serif";
    context.font = font;
    canvas.width = Math.ceil(context.measureText(this.text).width) + 16;
    canvas.height = 64;
    context.font = font;
    context.fillStyle = colour;
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.lineWidth = 9;
    context.lineJoin = "round";
    context.strokeStyle = behind;
    context.strokeText(this.text, canvas.width / 2, 34);
    context.fillText(this.text, canvas.width / 2, 34);
    this.material.map?.dispose();
    this.material.map = new CanvasTexture(canvas);
    this.material.map.colorSpace = SRGBColorSpace;
    this.scale.set((this.height * canvas.width) / canvas.height, this.height, 1);
  }
}
