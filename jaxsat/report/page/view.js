// A view of a scene: its camera, turned and zoomed by pointer, keys and buttons.
import { PerspectiveCamera, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { el } from "./dom.js";

const TURN_STEP = 0.12;
const ZOOM_STEP = 1.2;

export function view(scene, name, from, distance, [least, most], ask) {
  const camera = new PerspectiveCamera(35, 1, 0.01, 200);
  camera.up.set(0, 0, 1);
  const reset = () => {
    camera.position.copy(from).multiplyScalar(distance);
    camera.lookAt(0, 0, 0);
  };
  reset();
  const label = `${name}: drag or use the arrow keys to turn, plus and minus to zoom, 0 to reset`;
  const surface = el("div", { class: "surface", tabindex: "0", role: "application", "aria-label": label });
  const controls = new OrbitControls(camera, surface);
  controls.enablePan = false;
  controls.minDistance = least;
  controls.maxDistance = most;
  // The wheel scrolls the page until the view has been chosen.
  controls.enableZoom = false;
  surface.addEventListener("focus", () => (controls.enableZoom = true));
  surface.addEventListener("blur", () => (controls.enableZoom = false));
  // One finger still scrolls the page up and down.
  surface.style.touchAction = "pan-y";
  surface.addEventListener("pointerdown", () => surface.focus({ preventScroll: true }));
  controls.addEventListener("change", () => ask());
  const zoom = (factor) => {
    const length = Math.min(Math.max(camera.position.length() * factor, least), most);
    camera.position.setLength(length);
    controls.update();
    ask();
  };
  const turn = (about, up) => {
    const side = new Vector3().crossVectors(camera.up, camera.position).normalize();
    const turned = camera.position.clone().applyAxisAngle(side, up);
    if (Math.abs(turned.angleTo(camera.up) - Math.PI / 2) < 1.5) camera.position.copy(turned);
    camera.position.applyAxisAngle(camera.up, about);
    controls.update();
    ask();
  };
  const again = () => {
    reset();
    controls.update();
    ask();
  };
  const keys = {
    ArrowLeft: () => turn(-TURN_STEP, 0),
    ArrowRight: () => turn(TURN_STEP, 0),
    ArrowUp: () => turn(0, -TURN_STEP),
    ArrowDown: () => turn(0, TURN_STEP),
    "+": () => zoom(1 / ZOOM_STEP),
    "=": () => zoom(1 / ZOOM_STEP),
    "-": () => zoom(ZOOM_STEP),
    0: again,
  };
  surface.addEventListener("keydown", (event) => {
    if (!(event.key in keys) || event.ctrlKey || event.metaKey) return;
    keys[event.key]();
    event.preventDefault();
    event.stopPropagation();
  });
  const button = (text, title, onclick) => el("button", { type: "button", title, "aria-label": title, onclick }, text);
  const tools = el(
    "div",
    { class: "tools" },
    button("+", `Zoom in: ${name}`, () => zoom(1 / ZOOM_STEP)),
    button("−", `Zoom out: ${name}`, () => zoom(ZOOM_STEP)),
    button("⟲", `Reset the view: ${name}`, again),
  );
  const element = el("div", { class: "view" }, surface, el("div", { class: "tag" }, name), tools);
  return { scene, camera, controls, element };
}
