// The attitude over time as one likes it: quaternion, Euler angles to chosen axes, or how far a body axis is from the
// Sun, the field, nadir. All of it from the scene's nodes; the choice is told in the page's address.
import { Matrix4, Quaternion, Vector3 } from "three";
import { el } from "./dom.js";
import { interval, shades } from "./data.js";
import { fixed } from "./text.js";

const DEGREE = Math.PI / 180;
const VIEWS = { angles: "angles of a body axis", euler: "Euler angles 3-2-1", quaternion: "quaternion" };
const FRAMES = { inertial: "inertial axes", orbital: "orbital axes", earth: "Earth-fixed axes" };
const BODY = ["+x", "-x", "+y", "-y", "+z", "-z"];
const TOWARDS = { sun: "Sun", field: "field", nadir: "nadir" };
const NOTES = {
  angles: "Between the body axis and the directions to the Sun, of the magnetic field and to the Earth’s centre; gaps: the Sun in the Earth’s shadow.",
  euler: "Turn about z (yaw), then the new y (pitch), then the new x (roll), from the chosen axes to the body’s.",
  quaternion: "Scalar first; turns body axes into the chosen axes.",
};
const OF_FRAMES = {
  inertial: "",
  orbital: " Orbital: x along the velocity, y against the orbit’s normal, z to the Earth’s centre.",
  earth: " Earth-fixed: z to the north, x through Greenwich.",
};

// Elements of the chart; make(label, strips) makes it over the page's time.
export function attitude(page, motion, clock, make) {
  const t = motion.scene.attitude.t_s;
  const view = select("What of the attitude is shown", VIEWS);
  const axis = select("Body axis", Object.fromEntries(BODY.map((name) => [name, `body ${name.replace("-", "−")}`])));
  const frame = select("Axes that the attitude is told in", FRAMES);
  const now = el("output");
  const note = el("p", { class: "note" });
  const legend = el("ul", { class: "legend" });
  const place = el("div");
  let [shown, chart] = [[], null];
  const redraw = () => {
    const angles = view.value === "angles";
    axis.hidden = !angles;
    frame.hidden = angles;
    shown = curves(motion, t, view.value, axis.value, frame.value);
    note.textContent = NOTES[view.value] + (angles ? "" : OF_FRAMES[frame.value]);
    const items = [...shown.map(({ kind, name }) => [kind, name]), ...shades(page)];
    legend.replaceChildren(...items.map(([kind, name]) => el("li", {}, el("span", { class: `sign ${kind}` }), name)));
    const [low, high, step] = { angles: [0, 180, 45], euler: [-180, 180, 90], quaternion: [-1, 1, 0.5] }[view.value];
    const margin = 0.03 * (high - low);
    const strip = {
      height: 200,
      low: low - margin,
      high: high + margin,
      ticks: Array.from({ length: (high - low) / step + 1 }, (_, k) => low + k * step),
      label: view.value === "quaternion" ? "" : "deg",
      draw: (paint) => shown.forEach(({ kind, values }) => paint.line(`line ${kind}`, t, values)),
    };
    const told = angles ? `Angles of body ${axis.value} to the Sun, the field and nadir` : `${VIEWS[view.value]} to ${FRAMES[frame.value]}`;
    if (chart) chart.show(told, [strip]);
    else place.append((chart = make(told, [strip])).element);
    say();
  };
  const say = () => {
    const i = interval(t, clock.t);
    const unit = view.value === "quaternion" ? ["", 4] : ["°", 1];
    now.textContent = shown.map(({ name, values }) => `${name} ${fixed(values[i], unit[1])}${values[i] == null ? "" : unit[0]}`).join(", ");
  };
  for (const chooser of [view, axis, frame]) chooser.addEventListener("change", redraw);
  redraw();
  clock.onChange(say);
  const choosers = el("div", { class: "choosers" }, view, axis, frame);
  return [choosers, legend, el("figure", { class: "chart" }, now, place), note];
}

function select(label, options) {
  return el("select", { "aria-label": label }, ...Object.entries(options).map(([value, text]) => el("option", { value }, text)));
}

// Curves of a view: name, how it looks, values at the nodes.
export function curves(motion, t, view, axis, frame) {
  if (view === "angles") {
    const directions = {
      sun: (time) => (motion.inShadow(time) ? null : motion.sun(time)),
      field: (time) => motion.field(time),
      nadir: (time) => motion.position(time).negate(),
    };
    const own = unit(axis);
    const along = t.map((time) => own.clone().applyQuaternion(motion.attitude(time)));
    return Object.entries(TOWARDS).map(([kind, name]) => ({
      kind: `to-${kind}`,
      name,
      values: t.map((time, i) => {
        const direction = directions[kind](time);
        return direction && along[i].angleTo(direction) / DEGREE;
      }),
    }));
  }
  const turns = t.map((time) => axesOf(motion, time, frame).invert().multiply(motion.attitude(time)));
  if (view === "quaternion") {
    // Without a change of sign from node to node.
    turns.forEach((q, i) => i && q.dot(turns[i - 1]) < 0 && q.set(-q.x, -q.y, -q.z, -q.w));
    return ["w", "x", "y", "z"].map((name) => ({ kind: `about-${name}`, name, values: turns.map((q) => q[name]) }));
  }
  const angles = turns.map(euler);
  return ["roll", "pitch", "yaw"].map((name, k) => ({ kind: `about-${"xyz"[k]}`, name, values: broken(angles.map((row) => row[k])) }));
}

function unit(axis) {
  const part = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] }[axis[1]];
  return new Vector3(...part).multiplyScalar(axis[0] === "-" ? -1 : 1);
}

// Turns the chosen axes into inertial ones.
function axesOf(motion, t, frame) {
  if (frame === "earth") return new Quaternion().setFromAxisAngle(new Vector3(0, 0, 1), motion.greenwich(t));
  if (frame !== "orbital") return new Quaternion();
  const [position, velocity] = [motion.position(t), motion.velocity(t)];
  const z = position.clone().negate().normalize();
  const y = velocity.clone().cross(position).normalize();
  return new Quaternion().setFromRotationMatrix(new Matrix4().makeBasis(y.clone().cross(z), y, z));
}

// Roll, pitch, yaw [deg] of the sequence 3-2-1.
function euler({ w, x, y, z }) {
  const roll = Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y));
  const pitch = Math.asin(Math.min(Math.max(2 * (w * y - z * x), -1), 1));
  const yaw = Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
  return [roll, pitch, yaw].map((angle) => angle / DEGREE);
}

// A gap where an angle passes half a turn, in place of a stroke across the chart.
function broken(values) {
  return values.map((value, i) => (i && Math.abs(value - values[i - 1]) > 180 ? null : value));
}
