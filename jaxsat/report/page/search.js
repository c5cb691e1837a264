// The page of one Earth search: the sky about body z, the step of the automaton, and the four signals over time.
import { Chart, ceiling, ticks } from "./chart.js";
import { Clock } from "./clock.js";
import { coloured, el } from "./dom.js";
import { bindKeys } from "./keys.js";
import { Sky } from "./sky.js";
import { fixed, signed } from "./text.js";
import { Theme } from "./theme.js";
import { transport } from "./transport.js";

const [SEARCH, APPROACH] = [0, 1];
const STEPS = ["1", "2–4", "5"];
// Signals beyond it are the Sun's.
const HIGHEST = 60;

function start() {
  const page = JSON.parse(document.getElementById("data").textContent);
  const theme = new Theme();
  document.querySelector("header").append(theme.button);
  const clock = new Clock(page);
  clock.axis = "time since the start, s";

  const section = document.querySelector('[data-live="search"]');
  section.hidden = false;
  const summary = section.querySelector("summary");
  if (summary) {
    section.querySelector("details").removeAttribute("open");
    summary.textContent = "Picture for papers (PNG)";
  }
  const sky = new Sky(page, clock);
  const [words, readouts] = state(page, clock);
  const side = el("div", { class: "search-state" }, words, readouts, legend(page));
  section.querySelector("h2").after(
    el("div", { class: "search" }, sky.element, side),
    transport(page, clock),
    el("figure", { class: "chart" }, charts(page, clock).element),
  );
  bindKeys(clock);
  const asked = Number(new URLSearchParams(location.hash.slice(1)).get("t") ?? NaN);
  clock.seek(Number.isFinite(asked) ? asked : clock.begin);
  window.jaxsat = {
    seek: (t) => clock.seek(t),
    play: () => clock.play(),
    pause: () => clock.pause(),
    state: () => ({ t_s: clock.t, playing: clock.playing, theme: theme.dark ? "dark" : "light", step: words.textContent }),
  };
}

function state(page, clock) {
  const { samples, sensors } = page;
  const words = el("p", { class: "step", "aria-live": "off" });
  const rows = ["Earth's centre from z", "angular rate", ...sensors.map(({ name }) => `sensor ${name}`)].map((what) => {
    const value = el("dd");
    return { value, row: el("div", {}, el("dt", {}, what), value) };
  });
  clock.onChange(() => {
    const i = clock.sample();
    words.textContent = step(page, i);
    const [angle, rate, ...signals] = rows.map(({ value }) => value);
    angle.textContent = fixed(samples.error_deg[i], 2, "deg");
    rate.textContent = fixed(Math.hypot(...samples.rate_deg_s[i]), 3, "deg/s");
    signals.forEach((value, k) => {
      const here = samples.present[i][k] ? "Earth" : "nothing";
      value.textContent = `${signed(samples.first[i][k], 1)} W/(m² sr): ${here}`;
      value.classList.toggle("present", Boolean(samples.present[i][k]));
    });
  });
  return [words, el("dl", { class: "readouts" }, ...rows.map(({ row }) => row))];
}

// What the automaton does, by the numbers of the published steps.
function step({ samples, sensors }, i) {
  const mode = samples.mode[i];
  if (mode === SEARCH) return "Step 1, search: turns until any sensor signals.";
  if (mode !== APPROACH) return "Step 5, track: all four signal; second harmonics give the angles.";
  const found = samples.direction[i].flatMap((way, axis) => (way ? [sensors[axis + (way > 0 ? 0 : 2)].name] : []));
  if (!found.length) return "Steps 2 to 4, approach: both axes done, waits for all four signals.";
  const until = samples.direction[i].flatMap((way, axis) => (way ? [sensors[axis + (way > 0 ? 2 : 0)].name] : []));
  return `Steps ${found.length > 1 ? "2 to 4" : "2 and 3"}, approach: z moves toward ${found.join(" and ")} until ${until.join(" and ")} ${until.length > 1 ? "signal" : "signals"}.`;
}

function legend({ sensors, moon, sun }) {
  const entries = sensors.map(({ name, colour }) => [coloured(el("span", { class: "line own" }), colour), `sensor ${name}`]);
  entries.push([el("span", { class: "sign signal" }), "signals"]);
  entries.push([el("span", { class: "sign earth-disk" }), "Earth and its centre's path"]);
  if (sun) entries.push([el("span", { class: "sign sun-disk" }), "Sun"]);
  if (moon) entries.push([el("span", { class: "sign moon-disk" }), "Moon"]);
  return el("ul", { class: "legend" }, ...entries.map(([sign, text]) => el("li", {}, sign, text)));
}

function charts(page, clock) {
  const { samples, sensors, threshold } = page;
  const t = samples.t_s;
  const column = (rows, k) => rows.map((row) => row[k]);
  const top = ceiling(1.05 * Math.min(HIGHEST, Math.max(1.5 * threshold, ...samples.first.flat().map(Math.abs))));
  const held = (value) => Math.min(Math.max(value, -top), top);
  // Each stroke in the colour of its sensor: strips paint without one.
  const own = (paint, draw) =>
    sensors.forEach(({ colour }, k) => {
      const before = paint.target.childElementCount;
      draw(k);
      for (const node of [...paint.target.children].slice(before)) coloured(node, colour);
    });
  const strips = [
    {
      height: 150,
      low: -top,
      high: top,
      ticks: ticks(-top, top, 5),
      label: "1st harmonic, W/(m² sr)",
      draw: (paint) => {
        for (const level of [-threshold, threshold]) paint.line("line dashed", [t[0], t.at(-1)], [level, level]);
        own(paint, (k) => paint.line("line own", t, column(samples.first, k).map(held)));
      },
    },
    {
      height: 64,
      low: 0.4,
      high: 4.6,
      ticks: [],
      label: "presence",
      draw: (paint) =>
        own(paint, (k) => paint.line("line own bar", t, column(samples.present, k).map((on) => (on ? 4 - k : null)))),
    },
    {
      height: 110,
      low: 0,
      high: ceiling(1.02 * Math.max(...samples.error_deg)),
      ticks: ticks(0, ceiling(1.02 * Math.max(...samples.error_deg)), 4),
      label: "angle, deg",
      draw: (paint) => paint.line("line angle", t, samples.error_deg),
    },
    {
      height: 48,
      low: -0.2,
      high: 2.2,
      ticks: [0, 1, 2],
      name: (mode) => STEPS[mode],
      label: "step",
      draw: (paint) => paint.line("line angle", t.flatMap((x) => [x, x]), [samples.mode[0], ...samples.mode.flatMap((m) => [m, m]).slice(0, -1)]),
    },
  ];
  const label = "First harmonics with the thresholds of presence, presence, angle to the Earth's centre, step of the automaton";
  return new Chart({ label, strips, clock, shadow_s: page.shadow_s });
}

start();
