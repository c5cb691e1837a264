// Numbers at the cursor: where, in what light, how it turns, and what each face gives.
import { coloured, el } from "./dom.js";
import { nearest } from "./data.js";
import { fixed, short, signed, utc } from "./text.js";

const USE = ["no light", "", "weighted down", "left out"];

export class Readouts {
  constructor(page, motion, clock) {
    this.page = page;
    this.motion = motion;
    this.cells = {};
    const list = el("dl", { class: "readouts" });
    const names = ["UTC", "light", "height", "ground point", "field", "x to field"];
    for (const name of page.turn ? names : [...names, "rate"]) {
      this.cells[name] = el("dd");
      list.append(el("div", {}, el("dt", {}, name), this.cells[name]));
    }
    this.caption = el("caption");
    const own = channelLines(page);
    this.rows = own.lines.map((line) => this.row(line));
    this.title = own.title;
    const heads = [own.what, "measured", "modelled", own.residual, ""].map((text, k) =>
      el("th", { scope: "col", class: k && k < 4 ? "number" : "" }, text),
    );
    const table = el(
      "table",
      { class: "faces many" },
      this.caption,
      el("thead", {}, el("tr", {}, ...heads)),
      el("tbody", {}, ...this.rows.map((row) => row.element)),
    );
    this.element = el("div", { class: "at-cursor" }, list, el("div", { class: "scroll" }, table));
    clock.onChange(() => this.show(clock));
  }

  row({ name, colour, at }) {
    const cells = ["measured", "modelled", "residual"].map(() => el("td", { class: "number" }));
    const note = el("td", { class: "use" });
    const head = el("th", { scope: "row" }, coloured(el("span", { class: "chip" }), colour), name);
    return { at, cells, note, element: el("tr", {}, head, ...cells, note) };
  }

  show(clock) {
    const { motion, page } = this;
    const { t } = clock;
    const at = motion.groundPoint(t);
    const sample = clock.sample();
    const { samples } = page;
    const sigma = samples.field_angle_sigma_deg[sample];
    const side = (value, positive, negative) => `${fixed(Math.abs(value), 1)}° ${value < 0 ? negative : positive}`;
    const texts = {
      UTC: utc(page, t).slice(0, 19).replace("T", " "),
      light: motion.inShadow(t) ? "in the Earth's shadow" : "sunlit",
      height: fixed(at.height, 0, "km"),
      "ground point": `${side(at.latitude, "N", "S")}, ${side(at.longitude, "E", "W")}`,
      field: fixed(motion.field(t).length(), 2, "µT"),
      "x to field": `${fixed(motion.fieldAngle(t), 1)}°${sigma == null ? "" : `, 1σ ${fixed(sigma, 2)}°`}`,
      ...(page.turn ? {} : { rate: `${fixed(motion.rate(t), 3)} deg/s` }),
    };
    for (const [name, text] of Object.entries(texts)) this.cells[name].textContent = text;
    this.caption.textContent = this.title(sample);
    for (const { at, cells, note } of this.rows) {
      const [texts, use] = at(sample, t);
      cells.forEach((cell, column) => (cell.textContent = texts[column]));
      note.textContent = use;
    }
  }
}

// Lines of the table: name, colour, and at(sample, t) with the three numbers as text and how they were used.
function channelLines(page) {
  const lines = page.channels.flatMap(({ name, unit, t_s, use, paired, readings, residuals }) =>
    readings.map((reading, k) => ({
      name: `${name} ${reading.name}${unit && `, ${unit}`}`,
      colour: reading.colour,
      at: (_, t) => {
        const i = nearest(t_s, t);
        const off = paired ? signed(residuals[k].residual[i], 1) : "";
        return [[short(reading.measured[i]), short(reading.modelled[i]), off], USE[use[i]]];
      },
    })),
  );
  return { lines, title: () => "Of each channel the sample next to the cursor", what: "reading", residual: "residual / σ" };
}
