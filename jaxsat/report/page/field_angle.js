// The angle of body x to the magnetic field with its 1-sigma band, above the attitude's own.
import { ceiling, ticks } from "./chart.js";
import { el } from "./dom.js";
import { fixed } from "./text.js";

const AXES = ["x", "y", "z"];

// Elements of the chart: legend and figure; chart(label, strips) draws strips over the page's time.
export function fieldAngle(page, clock, chart) {
  const { t_s: t, field_angle_deg: angle, field_angle_sigma_deg: sigma, attitude_sigma_deg: about } = page.samples;
  const low = angle.map((value, i) => (sigma[i] == null ? null : Math.max(0, value - sigma[i])));
  const high = angle.map((value, i) => (sigma[i] == null ? null : value + sigma[i]));
  const top = ceiling(1.05 * Math.max(0, ...[...angle, ...high].filter((value) => value != null)));
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
        paint.band("band", t, low, high);
        paint.line("line angle", t, angle);
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
  ];
  const key = items.map(([kind, text]) => el("li", {}, el("span", { class: `sign ${kind}` }), text));
  return [
    el("ul", { class: "legend" }, ...key),
    el("figure", { class: "chart" }, now, chart("Angle of body x to the magnetic field with its 1-sigma band", strips)),
  ];
}
