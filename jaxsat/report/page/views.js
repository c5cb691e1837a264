// Two views on one canvas: the Earth with the orbit, and the satellite close by. Drawn when something has changed.
import {
  AmbientLight,
  DirectionalLight,
  Group,
  Matrix4,
  Quaternion,
  Scene,
  Vector3,
  WebGLRenderer,
} from "three";
import { el } from "./dom.js";
import { Earth } from "./earth.js";
import { spread } from "./labels.js";
import { legend } from "./legend.js";
import { Arrow, Line } from "./marks3d.js";
import { Satellite } from "./satellite.js";
import { view } from "./view.js";

const SATELLITE_SIZE = 0.1;
// Bright enough in the shade that the colours of the faces are told apart.
const [AMBIENT, SUNLIGHT] = [2.2, 1.9];
const HALF_VIEW = Math.tan((17.5 * Math.PI) / 180);

export function webglWorks() {
  try {
    return Boolean(document.createElement("canvas").getContext("webgl2"));
  } catch {
    return false;
  }
}

export class Views {
  constructor(page, motion, clock, theme) {
    Object.assign(this, { motion, clock, frames: 0, due: false });
    this.renderer = new WebGLRenderer({ antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setScissorTest(true);
    this.far = this.earthView(page, theme);
    this.near = this.closeUp(page, theme);
    const { domElement: canvas } = this.renderer;
    canvas.setAttribute("aria-hidden", "true");
    this.stage = el("div", { class: "views" }, canvas, this.far.element, this.near.element);
    this.element = el("div", {}, this.stage, legend());
    theme.onChange(() => this.paint(theme));
    clock.onChange(() => this.ask());
    new ResizeObserver(() => this.resize()).observe(this.stage);
  }

  earthView(page, theme) {
    const { motion } = this;
    const scene = new Scene();
    const unit = (km) => km.map((x) => x / motion.radius_km);
    this.earth = new Earth(theme);
    const orbit = motion.scene.orbit;
    const points = orbit.position_km.map(unit);
    // What was observed is drawn wider than the rest of the revolution.
    const { begin_s, end_s } = motion.scene;
    const last = ((end_s - begin_s) / orbit.period_s) * (points.length - 1);
    this.arcs = stretches(orbit.lit.map((lit, i) => `${lit}${Number(i < last)}`)).map(({ begin, end, kind }) => {
      const [lit, seen] = [...kind].map(Number);
      const line = new Line(points.slice(begin, end + 1).flat(), { width: (lit ? 1.3 : 3) + (seen ? 1.5 : 0) });
      line.lit = lit;
      return line;
    });
    this.fieldLine = motion.scene.field_lines_km && new Line(null, { width: 2 });
    this.small = new Satellite(page.panels, { size: page.size });
    this.small.scale.setScalar(SATELLITE_SIZE);
    const shape = { length: 0.44, shaft: 0.024, letters: 0.034 };
    this.farArrows = arrows({ sun: "Sun", field: "B", x: "x" }, shape);
    this.farArrows.x.scale.multiplyScalar(0.75);
    this.farLight = new DirectionalLight(0xffffff, SUNLIGHT);
    scene.add(this.earth, ...this.arcs, this.small, ...Object.values(this.farArrows));
    if (this.fieldLine) scene.add(this.fieldLine);
    scene.add(new AmbientLight(0xffffff, AMBIENT), this.farLight, this.farLight.target);

    const reach = Math.max(...points.map((p) => Math.hypot(...p)));
    const middle = motion.position((this.clock.begin + this.clock.end) / 2).normalize();
    const normal = motion.position(this.clock.begin).cross(motion.velocity(this.clock.begin)).normalize();
    const from = normal.addScaledVector(middle, 0.55).add(new Vector3(0, 0, 0.35)).normalize();
    return view(scene, "Earth and orbit", from, 3.8 * Math.max(reach, 1.15), [1.3, 60], () => this.ask());
  }

  closeUp(page) {
    const scene = new Scene();
    this.large = new Satellite(page.panels, { lettered: true, size: page.size });
    const shape = { length: 1.35, shaft: 0.018, letters: 0.034 };
    this.nearArrows = arrows({ sun: "Sun", field: "B", nadir: "nadir" }, shape);
    this.axes = ["x", "y", "z"].map((name, k) => {
      const line = new Line([0, 0, 0, ...[0, 1, 2].map((j) => (j === k ? 0.95 : 0))], { width: 2.5 });
      line.own = page.panels[2 * k].colour;
      return line;
    });
    this.body = new Group().add(this.large, ...this.axes);
    this.nearLight = new DirectionalLight(0xffffff, SUNLIGHT);
    this.root = new Group().add(this.body, ...Object.values(this.nearArrows), this.nearLight, this.nearLight.target);
    scene.add(this.root, new AmbientLight(0xffffff, AMBIENT));
    const made = view(scene, "Satellite", new Vector3(1.1, 0.7, 0.6).normalize(), 5.4, [1.8, 20], () => this.ask());
    const frames = { inertial: "inertial axes", orbit: "orbit's axes", body: "body axes" };
    this.frame = el(
      "select",
      { "aria-label": "Axes that stand still in the close-up", onchange: () => this.ask() },
      ...Object.entries(frames).map(([value, text]) => el("option", { value }, text)),
    );
    made.element.querySelector(".tools").prepend(this.frame);
    return made;
  }

  paint(theme) {
    const dark = theme.colour("shadow-arc");
    for (const arc of this.arcs) arc.paint(arc.lit ? theme.colour("orbit") : dark);
    this.fieldLine?.paint(theme.colour("field"));
    for (const group of [this.farArrows, this.nearArrows])
      for (const [name, arrow] of Object.entries(group)) arrow.paint(theme.colour(name === "x" ? "x-axis" : name), theme.colour("space"));
    for (const line of this.axes) line.paint(theme.own(line.own));
    for (const satellite of [this.large, this.small]) satellite.paint((colour) => theme.own(colour));
    this.ask();
  }

  resize() {
    const { width, height } = this.stage.getBoundingClientRect();
    if (!width || !height) return;
    this.renderer.setSize(width, height);
    this.ask();
  }

  ask() {
    if (this.due) return;
    this.due = true;
    requestAnimationFrame(() => {
      this.due = false;
      this.draw();
    });
  }

  place() {
    const { motion } = this;
    const { t } = this.clock;
    const sun = motion.sun(t);
    const field = motion.field(t);
    const attitude = motion.attitude(t);
    const kilometres = motion.position(t);
    const position = kilometres.clone().divideScalar(motion.radius_km);
    const dark = motion.inShadow(t);

    this.earth.set(motion.greenwich(t), sun);
    this.small.position.copy(position);
    this.small.quaternion.copy(attitude);
    for (const arrow of Object.values(this.farArrows)) arrow.position.copy(position);
    this.farArrows.sun.along(sun);
    this.farArrows.field.along(field);
    this.farArrows.x.along(new Vector3(1, 0, 0).applyQuaternion(attitude));
    if (this.fieldLine) this.fieldLine.through(motion.fieldLine(t).map((x) => x / motion.radius_km));
    this.farLight.position.copy(position).addScaledVector(sun, 10);
    this.farLight.target.position.copy(position);

    this.body.quaternion.copy(attitude);
    this.nearArrows.sun.along(sun);
    this.nearArrows.field.along(field);
    this.nearArrows.nadir.along(kilometres.clone().negate());
    this.nearLight.position.copy(sun).multiplyScalar(10);
    this.root.quaternion.copy(this.still(attitude, kilometres, motion.velocity(t)));
    for (const light of [this.farLight, this.nearLight]) light.visible = !dark;
    for (const { sun: arrow } of [this.farArrows, this.nearArrows]) {
      arrow.material.opacity = dark ? 0.35 : 1;
      arrow.letters.material.opacity = dark ? 0.45 : 1;
    }
  }

  // The turn that makes the chosen axes stand still before the camera.
  still(attitude, position, velocity) {
    if (this.frame.value === "body") return attitude.clone().invert();
    if (this.frame.value === "inertial") return new Quaternion();
    const up = position.clone().normalize();
    const normal = position.clone().cross(velocity).normalize();
    const along = normal.clone().cross(up);
    return new Quaternion().setFromRotationMatrix(new Matrix4().makeBasis(along, normal, up)).invert();
  }

  draw() {
    if (!this.renderer.domElement.width) return;
    this.place();
    const frame = this.stage.getBoundingClientRect();
    const shown = [this.farArrows, this.nearArrows].map((group) => Object.values(group).map((arrow) => arrow.letters));
    for (const [{ scene, camera, element }, letters] of [[this.far, shown[0]], [this.near, shown[1]]]) {
      const box = element.getBoundingClientRect();
      const [x, y] = [box.left - frame.left, frame.bottom - box.bottom];
      camera.aspect = box.width / box.height;
      // A narrow view still shows as much from side to side.
      camera.fov = (360 / Math.PI) * Math.atan(HALF_VIEW / Math.min(camera.aspect, 1));
      camera.updateProjectionMatrix();
      scene.updateMatrixWorld();
      camera.updateMatrixWorld();
      spread(letters, camera, box.width, box.height);
      this.renderer.setViewport(x, y, box.width, box.height);
      this.renderer.setScissor(x, y, box.width, box.height);
      this.renderer.render(scene, camera);
    }
    this.frames += 1;
  }
}

function arrows(names, shape) {
  return Object.fromEntries(Object.entries(names).map(([name, label]) => [name, new Arrow(label, shape)]));
}

// Runs of one kind; each ends on the first point of the next, so that none is cut off.
function stretches(kinds) {
  const found = [];
  let begin = 0;
  for (let i = 1; i <= kinds.length; i++) {
    if (i < kinds.length && kinds[i] === kinds[begin]) continue;
    found.push({ begin, end: Math.min(i, kinds.length - 1), kind: kinds[begin] });
    begin = i;
  }
  return found.filter(({ begin, end }) => end > begin);
}
