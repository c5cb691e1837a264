// Two axes of numbers in SVG, linear or logarithmic, drawn anew for their width; and numbers as texts.
import { ticks } from "./chart.js";
import { el, svg } from "./dom.js";

const [LEFT, RIGHT, TOP, BOTTOM] = [52, 12, 8, 22];
// Between digits and beside units: numbers of many digits are read in threes.
const THIN = "\u202f";

export const texts = {
  count: (n) => String(n).replace(/\B(?=(\d{3})+$)/g, THIN),
  value(x) {
    if (x == null || Number.isNaN(x)) return "none";
    if (x === 0) return "0";
    const size = Math.abs(x);
    if (size >= 1e6 || size < 1e-3) return x.toExponential(2).replace("e+", "e");
    return String(Number(x.toPrecision(4)));
  },
};

export class Axes {
  // x and y: { low, high, logarithmic, whole, title }; draw(paint) paints inside, and above it where y.none is set.
  constructor({ height, label, x, y, draw }) {
    Object.assign(this, { height, x, y, draw, width: 0 });
    this.svg = svg("svg", { role: "img", "aria-label": label, height });
    this.element = el("div", { class: "plot" }, this.svg);
    new ResizeObserver(() => this.fit()).observe(this.element);
  }

  fit() {
    const width = Math.floor(this.element.clientWidth);
    if (!width || width === this.width) return;
    this.width = width;
    this.again();
  }

  // After another choice of what is shown.
  show(changes) {
    Object.assign(this, changes);
    this.svg.setAttribute("aria-label", this.label ?? "");
    if (this.width) this.again();
  }

  again() {
    this.svg.setAttribute("width", this.width);
    this.svg.setAttribute("height", this.height);
    this.svg.setAttribute("viewBox", `0 0 ${this.width} ${this.height}`);
    this.svg.replaceChildren();
    this.bottom = this.height - BOTTOM - (this.x.title ? 18 : 0);
    this.left = LEFT + (this.y.title ? 16 : 0);
    this.top = TOP + (this.y.none ? 24 : 0);
    const across = scale(this.x, this.left, this.width - RIGHT);
    const up = scale(this.y, this.bottom, this.top);
    this.inverse = [scale.back(this.x, this.left, this.width - RIGHT), scale.back(this.y, this.bottom, this.top)];
    const right = this.width - RIGHT;
    for (const value of marks(this.x, Math.max(2, Math.floor(this.width / 80)))) {
      this.line("grid", across(value), this.top, across(value), this.bottom);
      this.write("tick", across(value), this.bottom + 15, texts.value(value));
    }
    for (const value of marks(this.y, Math.max(2, Math.floor(this.height / 45)))) {
      this.line("grid", this.left, up(value), right, up(value));
      this.write("tick value", this.left - 6, up(value) + 3.5, texts.value(value));
    }
    this.line("frame", this.left, this.top, this.left, this.bottom);
    this.line("frame", this.left, this.bottom, right, this.bottom);
    if (this.x.title) this.write("axis", (this.left + right) / 2, this.height - 5, this.x.title);
    if (this.y.title) {
      const [x, y] = [11, (this.top + this.bottom) / 2];
      this.svg.append(svg("text", { class: "axis side", x, y, transform: `rotate(-90 ${x} ${y})` }, this.y.title));
    }
    this.draw({
      x: across,
      y: up,
      path: (kind, d) => d && this.svg.append(svg("path", { class: kind, d })),
      rule: (kind, value) => this.line(kind, across(value), this.top, across(value), this.bottom),
      add: (node) => this.svg.append(node),
    });
  }

  // Of a pointer: its values and its place in the drawing.
  at(event) {
    const box = this.svg.getBoundingClientRect();
    const [px, py] = [event.clientX - box.left, event.clientY - box.top];
    return { px, py, x: this.inverse[0](px), y: this.inverse[1](py) };
  }

  line(kind, x1, y1, x2, y2) {
    this.svg.append(svg("line", { class: kind, x1, y1, x2, y2 }));
  }

  write(kind, x, y, text) {
    this.svg.append(svg("text", { class: kind, x, y }, text));
  }
}

function scale({ low, high, logarithmic }, from, to) {
  const own = logarithmic ? Math.log : (value) => value;
  const [a, b] = [own(low), own(high)];
  return (value) => from + ((own(value) - a) / (b - a)) * (to - from);
}

scale.back = ({ low, high, logarithmic }, from, to) => {
  const [a, b] = logarithmic ? [Math.log(low), Math.log(high)] : [low, high];
  return (place) => {
    const value = a + ((place - from) / (to - from)) * (b - a);
    return logarithmic ? Math.exp(value) : value;
  };
};

function marks({ low, high, logarithmic, whole }, count) {
  if (!logarithmic) return ticks(low, high, count).filter((value) => !whole || Number.isInteger(value));
  const decades = [];
  for (let power = Math.ceil(Math.log10(low)); power <= Math.log10(high); power++) decades.push(10 ** power);
  if (decades.length < 2) return [low, Math.sqrt(low * high), high].map((value) => Number(value.toPrecision(2)));
  const step = Math.ceil(decades.length / count);
  return decades.filter((_, k) => k % step === 0);
}
