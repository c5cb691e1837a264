// The channels of any satellite: each reading with its residuals in sigmas, and the rates; what was held out is shaded.
import { Chart, ceiling, ticks } from "./chart.js";
import { coloured, el } from "./dom.js";
import { nearest, shades } from "./data.js";
import { fieldAngle } from "./field_angle.js";
import { fixed, short, signed } from "./text.js";

const [USED, REDUCED, OUT] = [1, 2, 3];
const AXES = ["x", "y", "z"];
const EDGE = 0.94;

export class ChannelCharts {
  constructor(page, motion, clock, places) {
    Object.assign(this, { page, clock, count: 0 });
    places.rates?.querySelector("h2").after(...this.rates());
    places.angle?.querySelector("h2").after(...fieldAngle(page, motion, clock, (label, strips) => this.chart(label, strips)));
    page.channels.forEach((channel, k) => {
      const head = places.channels[k].querySelector("h2");
      head.after(el("p", { class: "note" }, channel.note), this.key(channel), ...this.channel(channel));
    });
  }

  chart(label, strips) {
    return this.make(label, strips).element;
  }

  make(label, strips) {
    this.count += 1;
    const { clock, page } = this;
    return new Chart({ label, strips, clock, shadow_s: page.shadow_s, held_s: page.held_s });
  }

  legend(entries) {
    const all = [...entries, ...shades(this.page)];
    return el("ul", { class: "legend" }, ...all.map(([kind, text]) => el("li", {}, el("span", { class: `sign ${kind}` }), text)));
  }

  key({ use, readings, residuals }) {
    return this.legend([
      ["dot", "measured"],
      ["curve", "modelled"],
      ...(readings.some(({ direct, direct_line }) => direct ?? direct_line) ? [["dashed", "direct sunlight alone"]] : []),
      ["promised", "promised ±1σ"],
      ...(residuals.some(({ light }) => light) ? [["ring", "weighed down"]] : []),
      ...(use.some((u) => u !== USED) ? [["cross", "left out of the fit"]] : []),
    ]);
  }

  channel(channel) {
    const { readings, residuals, paired } = channel;
    const grid = (count, figures) => {
      // Panels of a box stand beside those of the face opposite.
      const threes = count % 3 === 0 && !(channel.scale && count % 2 === 0);
      const kind = count === 1 ? " one" : threes ? " three" : "";
      return el("div", { class: `panels${kind}` }, ...figures);
    };
    const own = readings.map((reading, k) => this.figure(channel, reading, paired ? residuals[k] : null));
    if (paired) return [grid(readings.length, own)];
    const turns = residuals.map((residual) => this.figure(channel, null, residual));
    return [grid(readings.length, own), grid(residuals.length, turns)];
  }

  // A reading, its residual below, or one of the two.
  figure(channel, reading, residual) {
    const { page } = this;
    const { name: of, unit, t_s: t, use } = channel;
    const { name, colour } = reading ?? residual;
    // How each sample was used, those that were weighed down told apart.
    const marked = use.slice();
    for (const i of residual?.light ?? []) if (marked[i] === USED) marked[i] = REDUCED;
    const strips = [reading && this.readingStrip(channel, reading, marked), residual && this.residualStrip(channel, residual, marked)];
    const now = el("output");
    this.clock.onChange(() => {
      const i = nearest(t, this.clock.t);
      const values = reading && `${short(reading.measured[i])} measured, ${short(reading.modelled[i])} modelled`;
      const off = residual && `${signed(residual.residual[i], 1)} σ, promised ${fixed(residual.promised[i], 1)}`;
      now.textContent = [values, off, ["", "", "weighed down", "left out"][marked[i]]].filter(Boolean).join(", ");
    });
    const head = el("h3", {}, el("span", { class: "name" }, name), el("small", {}, reading ? unit : "residual / σ"));
    const label = `${of} ${name}: ${reading ? "measured and modelled reading" : "residual"} against ${page.turn ? "the turn" : "time"}`;
    return coloured(el("figure", { class: "chart" }, head, now, this.chart(label, strips.filter(Boolean))), colour);
  }

  readingStrip({ t_s: t, unit, scale }, { measured, modelled, direct, line, direct_line }, use) {
    // Lines go through what is modelled between the samples, where the page has it.
    const along = this.page.curve?.t_s;
    // A wild reading must not flatten the others: it stands at the edge.
    const shown = [...modelled, ...(line ?? []), ...measured.filter((_, i) => use[i] !== OUT)].filter((value) => value != null);
    const [least, most] = extremes(shown);
    const margin = 0.08 * (most - least) || 0.1 * Math.abs(most) || 1;
    // Panels share theirs.
    const [low, high] = scale ?? [least - margin, most + margin];
    const points = (wanted) => marks(t, measured, low, high, (i) => use[i] === wanted);
    return {
      height: 120,
      low,
      high,
      ticks: ticks(low, high, 4),
      label: unit,
      draw: (paint) => {
        if (direct ?? direct_line) paint.line("line dashed", direct_line ? along : t, direct_line ?? direct);
        paint.line("line own", line ? along : t, line ?? modelled);
        paint.marks(`dot ${size(t)}`, points(USED));
        paint.marks("ring", points(REDUCED));
        paint.marks("cross", points(OUT));
      },
    };
  }

  residualStrip({ t_s: t, reach }, { residual, promised }, use) {
    const points = (wanted) => marks(t, residual, -EDGE * reach, EDGE * reach, (i) => use[i] === wanted);
    const within = promised.map((value) => (value == null ? null : Math.min(value, reach)));
    return {
      height: 64,
      low: -reach,
      high: reach,
      ticks: [-reach / 2, 0, reach / 2],
      label: "r / σ",
      draw: (paint) => {
        paint.band("promised", t, within.map((value) => value && -value), within);
        paint.line("line zero", [t[0], t.at(-1)], [0, 0]);
        paint.marks(`dot own ${size(t)}`, points(USED));
        paint.marks("ring", points(REDUCED));
        paint.marks("cross", points(OUT));
      },
    };
  }

  rates() {
    const { page, clock } = this;
    const { t_s: t, rate_deg_s: rate, attitude_sigma_deg: about } = page.samples;
    const { t_s: times, rate_deg_s: rates } = page.curve ?? page.samples;
    const [least, most] = extremes(rates.flat().filter((value) => value != null));
    const margin = 0.08 * (most - least) || 0.1;
    const widest = ceiling(1.15 * extremes([0, ...about.flat().filter((value) => value != null)])[1]);
    const curves = (paint, times, rows) =>
      AXES.forEach((axis, k) => paint.line(`line about-${axis}`, times, rows.map((row) => row[k])));
    const strips = [
      {
        height: 150,
        low: least - margin,
        high: most + margin,
        ticks: ticks(least - margin, most + margin, 4),
        label: "deg/s",
        draw: (paint) => curves(paint, times, rates),
      },
      { height: 84, low: 0, high: widest, ticks: ticks(0, widest, 2), label: "1σ, deg", draw: (paint) => curves(paint, t, about) },
    ];
    const now = el("output");
    clock.onChange(() => {
      const i = clock.sample();
      const list = (row, digits) => AXES.map((axis, k) => `${axis} ${fixed(row[k], digits)}`).join(", ");
      now.textContent = `${list(rate[i], 4)} deg/s; attitude 1σ about ${list(about[i], 3)} deg`;
    });
    return [
      this.legend(AXES.map((axis) => [`about-${axis}`, `about body ${axis}`])),
      el("figure", { class: "chart" }, now, this.chart("Angular velocity with the attitude's 1-sigma below", strips)),
    ];
  }
}

// Many dots are small, so that the line below them is seen.
const size = (t) => (t.length > 100 ? "fine" : "");

function extremes(values) {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return low <= high ? [low, high] : [0, 1];
}

// Points (t, value) of the chosen samples, those beyond the edges on them.
function marks(t, values, low, high, chosen) {
  const held = (value) => Math.min(Math.max(value, low), high);
  return t.map((time, i) => [time, values[i], i]).filter(([, v, i]) => v != null && chosen(i)).map(([time, v]) => [time, held(v)]);
}
