// Numbers at the cursor: where, in what light, how it turns, and what each face gives.
import { coloured, el } from "./dom.js";
import { fixed, signed, utc } from "./text.js";

const USE = ["no light", "", "weighted down", "left out"];

export class Readouts {
  constructor(page, motion, clock) {
    this.page = page;
    this.motion = motion;
    this.cells = {};
    const list = el("dl", { class: "readouts" });
    for (const name of ["UTC", "light", "height", "ground point", "field", "x to field", "rate"]) {
      this.cells[name] = el("dd");
      list.append(el("div", {}, el("dt", {}, name), this.cells[name]));
    }
    this.caption = el("caption");
    this.rows = page.panels.map((panel) => this.row(panel));
    const heads = ["face", "measured", "modelled", "residual", ""].map((text, k) =>
      el("th", { scope: "col", class: k && k < 4 ? "number" : "" }, text),
    );
    const table = el(
      "table",
      { class: "faces" },
      this.caption,
      el("thead", {}, el("tr", {}, ...heads)),
      el("tbody", {}, ...this.rows.map((row) => row.element)),
    );
    this.element = el("div", { class: "at-cursor" }, list, el("div", { class: "scroll" }, table));
    clock.onChange(() => this.show(clock));
  }

  row(panel) {
    const cells = ["measured", "modelled", "residual"].map(() => el("td", { class: "number" }));
    const note = el("td", { class: "use" });
    const head = el("th", { scope: "row" }, coloured(el("span", { class: "chip" }), panel.colour), panel.name);
    return { cells, note, element: el("tr", {}, head, ...cells, note) };
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
      rate: `${fixed(motion.rate(t), 3)} deg/s`,
    };
    for (const [name, text] of Object.entries(texts)) this.cells[name].textContent = text;
    this.caption.textContent = `Currents, mA, of the sample at t = ${fixed(samples.t_s[sample], 0)} s`;
    this.rows.forEach(({ cells, note }, k) => {
      const values = [samples.measured_mA, samples.modelled_mA, page.residual_mA].map((rows) => rows[sample][k]);
      const texts = [fixed(values[0], 1), fixed(values[1], 1), signed(values[2], 1)];
      cells.forEach((cell, column) => (cell.textContent = texts[column]));
      note.textContent = USE[samples.use[sample][k]];
    });
  }
}
