// Any two numbers of the cases against each other: a mark a case, by colour and shape how it ended.
import { Axes, texts } from "./axes.js";
import { el, svg } from "./dom.js";

// Of each way to end; the first is success. Told apart by shape as well as by colour.
export const SHAPES = ["h0", "m-3-3l6 6m0-6l-6 6", "m0-4l4 7h-8z", "m-3-3h6v6h-6z", "m0-4.5l4 4.5l-4 4.5l-4-4.5z", "m-4 0h8m-4-4v8"];
const REACH = 14;
// Numbers of so few kinds are spread sideways, or their marks would hide each other.
const FEW = 12;

export class Scatter {
  constructor(page, choice) {
    Object.assign(this, { page, choice, off: new Set() });
    this.columns = [...page.inputs, ...page.outcomes];
    const across = page.inputs.find(({ name }) => name === page.across) ?? page.outcomes[0];
    const up = page.outcomes[0];
    this.across = chooser("across", page, across.name, () => this.redraw());
    this.up = chooser("up", page, up.name, () => this.redraw());
    this.output = el("output", { "aria-live": "off" });
    this.note = el("p", { class: "note" });
    this.axes = new Axes({ height: 400, label: "", x: { low: 0, high: 1 }, y: { low: 0, high: 1 }, draw: (paint) => this.paint(paint) });
    const choosers = el(
      "div",
      { class: "choosers" },
      el("label", {}, "across ", this.across),
      el("label", {}, "up ", this.up),
      el("button", { type: "button", onclick: () => this.swap() }, "Swap"),
    );
    this.element = el("div", { class: "scatter" }, choosers, this.legend(), this.output, this.axes.element, this.note);
    this.axes.svg.addEventListener("pointermove", (event) => this.hover(event));
    this.axes.svg.addEventListener("pointerleave", () => this.say());
    this.axes.svg.addEventListener("click", (event) => {
      const near = this.nearest(event);
      if (near != null) choice.choose(page.case[near]);
    });
    choice.onChange(() => {
      this.say();
      this.axes.show({});
    });
    this.redraw();
  }

  legend() {
    const { statuses, counts } = this.page;
    const items = statuses.flatMap((name, code) => {
      if (!counts[code]) return [];
      const toggle = (event) => {
        this.off[this.off.has(code) ? "delete" : "add"](code);
        event.currentTarget.setAttribute("aria-pressed", String(!this.off.has(code)));
        this.redraw();
      };
      const name_ = `${name}: ${texts.count(counts[code])}`;
      return [el("button", { type: "button", class: "kind", "aria-pressed": "true", onclick: toggle }, sign(code), name_)];
    });
    return el("div", { class: "kinds", role: "group", "aria-label": "How cases ended: shown or not" }, ...items);
  }

  swap() {
    [this.across.value, this.up.value] = [this.up.value, this.across.value];
    this.redraw();
  }

  column(select) {
    return this.columns.find(({ name }) => name === select.value);
  }

  redraw() {
    const [x, y] = [this.column(this.across), this.column(this.up)];
    this.x = x;
    this.y = y;
    const titles = [x, y].map(named);
    this.axes.show({
      label: `${titles[1]} against ${titles[0]}, a mark a case`,
      x: { ...range(x), title: titles[0] },
      y: { ...range(y), title: titles[1], none: y.data.some(Number.isNaN) },
    });
    this.note.textContent = this.noted();
    this.say();
  }

  noted() {
    const { page, x, y } = this;
    const shown = page.case.length;
    const parts = [];
    if (shown < page.cases) {
      const [bad, good] = [page.failed_shown, shown - page.failed_shown];
      parts.push(
        `${texts.count(shown)} of ${texts.count(page.cases)} cases are drawn: ${texts.count(bad)} of ${texts.count(page.failed)} that failed, every so manyth of the rest (${texts.count(good)}).`,
      );
    } else parts.push(`All ${texts.count(shown)} cases are drawn.`);
    const none = y.data.filter(Number.isNaN).length;
    if (none) parts.push(`${texts.count(none)} without ${y.title.toLowerCase()} stand above the axis.`);
    const lost = x.data.filter(Number.isNaN).length;
    if (lost) parts.push(`${texts.count(lost)} without ${x.title.toLowerCase()} are not drawn.`);
    if (x.few) parts.push(`Cases of one ${x.title.toLowerCase()} are spread sideways.`);
    const beyond = [x, y].map((column) => column.data.filter((v) => v < column.span[0] || v > column.span[1]).length);
    if (beyond[0] + beyond[1]) parts.push(`${texts.count(beyond[0] + beyond[1])} beyond the axes stand at their ends.`);
    return parts.join(" ");
  }

  paint(paint) {
    const { page, x, y } = this;
    if (!x) return;
    // Pixels of each case; null where it is not shown.
    const held = (value, [low, high]) => Math.min(Math.max(value, low), high);
    this.places = page.case.map((_, i) => {
      if (this.off.has(page.status[i]) || Number.isNaN(x.data[i])) return null;
      // A shift of its own for each case, the same at every look.
      const aside = x.few ? 0.8 * x.few * (((i * 0.618034) % 1) - 0.5) : 0;
      const px = paint.x(held(x.data[i], x.span) + aside);
      return [px, Number.isNaN(y.data[i]) ? 8 + (i % 7) * 1.5 : paint.y(held(y.data[i], y.span))];
    });
    if (this.axes.y.none) paint.add(svg("text", { class: "tick value", x: this.axes.left - 6, y: 16 }, "none"));
    page.statuses.forEach((_, code) => {
      let d = "";
      this.places.forEach((place, i) => {
        if (place && page.status[i] === code) d += `M${place[0].toFixed(1)} ${place[1].toFixed(1)}${shape(code)}`;
      });
      paint.path(`case ended-${Math.min(code, SHAPES.length - 1)}${page.case.length > 1500 ? " many" : ""}`, d);
    });
    const at = page.case.indexOf(this.choice.number);
    const place = at < 0 ? null : this.places[at];
    if (place) paint.add(svg("circle", { class: "chosen", cx: place[0], cy: place[1], r: 8 }));
  }

  nearest(event) {
    const { px, py } = this.axes.at(event);
    let [best, least] = [null, REACH ** 2];
    this.places.forEach((place, i) => {
      if (!place) return;
      const off = (place[0] - px) ** 2 + (place[1] - py) ** 2;
      if (off < least) [best, least] = [i, off];
    });
    return best;
  }

  hover(event) {
    this.say(this.nearest(event));
  }

  say(i = null) {
    const at = i ?? this.page.case.indexOf(this.choice.number);
    if (at < 0) {
      this.output.textContent = "Point at a case; click it for the command that shows it.";
      return;
    }
    const value = ({ title, unit, data }) => `${title} ${texts.value(data[at])} ${Number.isNaN(data[at]) ? "" : unit}`.trim();
    const ended = this.page.statuses[this.page.status[at]];
    this.output.textContent = `Case ${this.page.case[at]}, ${ended}: ${value(this.x)}; ${value(this.y)}`;
  }
}

export function sign(code) {
  const mark = svg("path", { class: `case ended-${Math.min(code, SHAPES.length - 1)}`, d: `M8 8${shape(code)}` });
  return svg("svg", { class: "shape", width: 16, height: 16, "aria-hidden": "true" }, mark);
}

export function named({ title, unit }) {
  return unit ? `${title}, ${unit}` : title;
}

function shape(code) {
  return SHAPES[Math.min(code, SHAPES.length - 1)];
}

function chooser(name, { inputs, outcomes }, chosen, onchange) {
  const option = (column) => el("option", { value: column.name, selected: column.name === chosen }, named(column));
  const group = (label, columns) => (columns.length ? el("optgroup", { label }, ...columns.map(option)) : null);
  return el("select", { name, onchange }, group("drawn for each case", inputs), group("outcomes", outcomes));
}

// Where the axis begins and ends: that of the histogram where stray cases lie beyond it.
function range(column) {
  const known = column.data.filter((value) => !Number.isNaN(value));
  let [low, high] = [0, 1];
  if (known.length) [low, high] = [known.reduce((a, b) => Math.min(a, b)), known.reduce((a, b) => Math.max(a, b))];
  if (column.beyond && column.edges.length) [low, high] = [Math.max(low, column.edges[0]), Math.min(high, column.edges.at(-1))];
  const logarithmic = Boolean(column.logarithmic && low > 0);
  column.span = [low, high];
  const kinds = [...new Set(known)].sort((a, b) => a - b);
  // Half the least distance of two kinds.
  column.few = kinds.length > 1 && kinds.length <= FEW && !logarithmic ? 0.5 * Math.min(...kinds.slice(1).map((v, k) => v - kinds[k])) : 0;
  if (logarithmic) return { low: low / 1.1, high: high * 1.1, logarithmic };
  const margin = column.few || 0.03 * (high - low) || 0.5 * Math.abs(high) || 0.5;
  return { low: low - margin, high: high + margin, logarithmic };
}
