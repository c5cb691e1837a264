// The angle of body x to the magnetic field with its 1-sigma band, above the attitude's own.
import { ceiling, ticks } from "./chart.js";
import { el } from "./dom.js";
import { interval, shades } from "./data.js";
import { fixed } from "./text.js";

const AXES = ["x", "y", "z"];

// Elements of the chart: legend and figure; chart(label, strips) draws strips over the page's time.
export function fieldAngle(page, motion, clock, chart) {
  const { t_s: t, field_angle_deg: angle, field_angle_sigma_deg: sigma, attitude_sigma_deg: about } = page.samples;
  // Between the samples the motion tells it, where the page has that.
  const times = (motion && page.curve?.t_s) ?? t;
  const fine = times === t ? angle : times.map((time) => motion.fieldAngle(time));
  const wide = times === t ? sigma : times.map((time) => between(t, sigma, time));
  const low = fine.map((value, i) => (wide[i] == null ? null : Math.max(0, value - wide[i])));
  const high = fine.map((value, i) => (wide[i] == null ? null : value + wide[i]));
  const top = ceiling(1.05 * [...fine, ...high].reduce((most, value) => Math.max(most, value ?? 0), 0));
  const sigmas = [...about.flat(), ...sigma].filter((value) => value != null);
  const widest = ceiling(1.25 * Math.max(0, ...sigmas));
  const strips = [
    {
      height: 190,
      low: 0,
      high: top,
      ticks: ticks(0, top, 5),
      label: "angle, deg",
      draw: (paint) => {
        paint.band("band", times, low, high);
        paint.line("line angle", times, fine);
      },
    },
    {
      height: 84,
      low: 0,
      high: widest,
      ticks: ticks(0, widest, 2),
      label: "1σ, deg",
      draw: (paint) => {
        AXES.forEach((axis, k) => paint.line(`line about-${axis}`, t, about.map((row) => row[k])));
        paint.line("line dashed", t, sigma);
      },
    },
  ];
  const now = el("output");
  clock.onChange(() => {
    const i = clock.sample();
    const part = sigma[i] == null ? "1σ unknown" : `1σ ${fixed(sigma[i], 2)}°`;
    const axes = AXES.map((axis, k) => `${axis} ${fixed(about[i][k], 2)}°`).join(", ");
    now.textContent = `${fixed(angle[i], 2)}°, ${part}; attitude 1σ about ${axes}`;
  });
  const items = [
    ["angle", "angle of body x to the field"],
    ["band", "±1σ"],
    ...AXES.map((axis) => [`about-${axis}`, `attitude 1σ about ${axis}`]),
    ["dashed", "1σ of the angle"],
    ...shades(page),
  ];
  const key = items.map(([kind, text]) => el("li", {}, el("span", { class: `sign ${kind}` }), text));
  return [
    el("ul", { class: "legend" }, ...key),
    el("figure", { class: "chart" }, now, chart("Angle of body x to the magnetic field with its 1-sigma band", strips)),
  ];
}

// On the straight line between two samples; null where one of them is not known.
function between(t, values, time) {
  const i = interval(t, time);
  const [a, b] = [values[i], values[Math.min(i + 1, t.length - 1)]];
  if (a == null || b == null) return null;
  const span = t[i + 1] - t[i];
  return span > 0 ? a + ((b - a) * (time - t[i])) / span : a;
}
