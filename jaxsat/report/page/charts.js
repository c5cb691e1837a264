// Six panels with residuals, and the angle to the field with its band: what the report's pictures show, with a cursor.
import { Chart, ceiling, ticks } from "./chart.js";
import { coloured, el } from "./dom.js";
import { fixed, signed } from "./text.js";

const [USED, REDUCED, OUT] = [1, 2, 3];
const AXES = ["x", "y", "z"];

export class Charts {
  constructor(page, clock, places) {
    Object.assign(this, { page, clock, count: 0 });
    const known = this.pairs((i, k) => [page.samples.measured_mA[i][k], page.samples.modelled_mA[i][k]]).flat();
    this.top = ceiling(1.02 * Math.max(1, ...known.filter(Number.isFinite)));
    const trusted = this.pairs((i, k) => (page.samples.use[i][k] === USED ? Math.abs(page.residual_mA[i][k]) : 0));
    this.reach = ceiling(1.1 * Math.max(...trusted)) || 1;
    const grid = el("div", { class: "panels" }, ...page.panels.map((panel, k) => this.panel(panel, k)));
    places.currents.querySelector("h2").after(this.key(), grid);
    places.angle.querySelector("h2").after(...this.angle());
  }

  pairs(value) {
    const { samples, panels } = this.page;
    return samples.t_s.flatMap((_, i) => panels.map((_, k) => value(i, k)));
  }

  chart(label, strips) {
    this.count += 1;
    return new Chart({ label, strips, clock: this.clock, shadow_s: this.page.shadow_s }).element;
  }

  key() {
    const uses = new Set(this.page.samples.use.flat());
    const entries = [
      ["dot", "measured"],
      ["curve", "modelled"],
      ["dashed", "direct sunlight alone"],
      ...(uses.has(REDUCED) ? [["ring", "weighted down"]] : []),
      ...(uses.has(OUT) ? [["cross", "left out of the fit"]] : []),
    ];
    const items = entries.map(([kind, text]) => el("li", {}, el("span", { class: `sign ${kind}` }), text));
    return el("ul", { class: "legend" }, ...items);
  }

  panel({ name, colour }, k) {
    const { page, clock, top, reach } = this;
    const { samples } = page;
    const column = (rows) => rows.map((row) => row[k]);
    const [measured, modelled, direct] = [samples.measured_mA, samples.modelled_mA, samples.direct_mA].map(column);
    const [residual, use] = [column(page.residual_mA), column(samples.use)];
    const t = samples.t_s;
    const points = (values, wanted) => t.map((time, i) => [time, values[i], use[i]]).filter(([, , u]) => wanted(u));
    const plain = (u) => u < REDUCED;
    const held = residual.map((value) => Math.min(Math.max(value, -reach), reach));
    const strips = [
      {
        height: 128,
        low: -0.03 * top,
        high: top,
        ticks: ticks(0, top, 3),
        label: "mA",
        draw: (paint) => {
          paint.line("line dashed", t, direct);
          paint.line("line own", t, modelled);
          paint.marks("dot", points(measured, plain));
          paint.marks("ring", points(measured, (u) => u === REDUCED));
          paint.marks("cross", points(measured, (u) => u === OUT));
        },
      },
      {
        height: 56,
        low: -reach,
        high: reach,
        ticks: [-reach / 2, 0, reach / 2],
        label: "resid.",
        draw: (paint) => {
          paint.line("line zero", [t[0], t.at(-1)], [0, 0]);
          paint.stems("stem own", points(held, (u) => u === USED));
          paint.marks("dot own", points(held, (u) => u === USED));
          paint.marks("ring", points(held, (u) => u === REDUCED));
          paint.marks("cross", points(held, (u) => u === OUT));
        },
      },
    ];
    const used = residual.filter((_, i) => use[i] === USED || use[i] === REDUCED);
    const rms = Math.sqrt(used.reduce((sum, r) => sum + r * r, 0) / used.length);
    const out = use.filter((u) => u === OUT).length;
    const summary = used.length ? `residual RMS ${fixed(rms, 2)} mA, ${used.length} used` : "nothing used";
    const now = el("output");
    clock.onChange(() => {
      const i = clock.sample();
      now.textContent = `${fixed(measured[i], 1)} measured, ${fixed(modelled[i], 1)} modelled, ${signed(residual[i], 1)} mA`;
    });
    const head = el("h3", {}, el("span", { class: "name" }, name), el("small", {}, summary + (out ? `, ${out} left out` : "")));
    const label = `Panel ${name}: measured and modelled current with residuals, ${summary}`;
    return coloured(el("figure", { class: "chart" }, head, now, this.chart(label, strips)), colour);
  }

  angle() {
    const { page, clock } = this;
    const { t_s: t, field_angle_deg: angle, field_angle_sigma_deg: sigma, attitude_sigma_deg: about } = page.samples;
    const low = angle.map((value, i) => (sigma[i] == null ? null : Math.max(0, value - sigma[i])));
    const high = angle.map((value, i) => (sigma[i] == null ? null : value + sigma[i]));
    const top = ceiling(1.05 * Math.max(...angle, ...high.filter((value) => value != null)));
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
      el("figure", { class: "chart" }, now, this.chart("Angle of body x to the magnetic field with its 1-sigma band", strips)),
    ];
  }
}
