// A chart of one or more strips over the time axis, in SVG, with the cursor of the clock; drawn anew for its width.
import { el, svg } from "./dom.js";
import { fixed } from "./text.js";

const [LEFT, RIGHT, TOP, BOTTOM, GAP] = [46, 10, 6, 34, 14];

export class Chart {
  // strips: [{ height, low, high, ticks, label, draw(paint) }]; more(t) are the points on the cursor.
  constructor({ label, strips, clock, shadow_s, held_s = [] }) {
    Object.assign(this, { strips, clock, shadow_s, held_s, width: 0 });
    this.height = TOP + BOTTOM + strips.reduce((sum, strip) => sum + strip.height + GAP, -GAP);
    this.svg = svg("svg", { role: "img", "aria-label": label, height: this.height });
    this.cursor = svg("line", { class: "cursor", y1: TOP, y2: this.height - BOTTOM });
    this.element = el("div", { class: "plot" }, this.svg);
    this.drag();
    new ResizeObserver(() => this.fit()).observe(this.element);
    clock.onChange(() => this.point());
  }

  // Other strips of the same heights.
  show(label, strips) {
    this.strips = strips;
    this.svg.setAttribute("aria-label", label);
    if (!this.width) return;
    this.draw();
    this.point();
  }

  fit() {
    const width = Math.floor(this.element.clientWidth);
    if (!width || width === this.width) return;
    this.width = width;
    this.svg.setAttribute("width", width);
    this.svg.setAttribute("viewBox", `0 0 ${width} ${this.height}`);
    this.draw();
    this.point();
  }

  x = (t) => {
    const { begin, end } = this.clock;
    const margin = 0.015 * (end - begin);
    return LEFT + ((t - begin + margin) / (end - begin + 2 * margin)) * (this.width - LEFT - RIGHT);
  };

  time(x) {
    const { begin, end } = this.clock;
    const [low, high] = [this.x(begin), this.x(end)];
    return begin + ((x - low) / (high - low)) * (end - begin);
  }

  draw() {
    this.svg.replaceChildren();
    let top = TOP;
    const right = this.width - RIGHT;
    const times = ticks(this.clock.begin, this.clock.end, Math.max(3, Math.floor(this.width / 95)));
    for (const strip of this.strips) {
      const { low, high, height } = strip;
      const base = top;
      const y = (value) => base + height - ((value - low) / (high - low)) * height;
      for (const [a, b] of this.spans(this.held_s)) {
        this.svg.append(svg("rect", { class: "held", x: a, width: b - a, y: base, height }));
      }
      for (const [a, b] of this.spans(this.shadow_s)) {
        this.svg.append(svg("rect", { class: "shade", x: a, width: b - a, y: base, height }));
      }
      for (const t of times) this.rule("grid", this.x(t), base, this.x(t), base + height);
      for (const value of strip.ticks) {
        this.rule("grid", LEFT, y(value), right, y(value));
        this.write("tick value", LEFT - 6, y(value) + 3.5, strip.name?.(value) ?? fixed(value, digits(strip.ticks)));
      }
      if (strip.label) this.write("axis side", 11, base + height / 2, strip.label);
      strip.draw(new Paint(this.svg, this.x, y));
      this.rule("frame", LEFT, base, LEFT, base + height);
      this.rule("frame", LEFT, base + height, right, base + height);
      top += height + GAP;
    }
    const under = this.height - BOTTOM + 15;
    for (const t of times) this.write("tick", this.x(t), under, fixed(t, 0));
    this.write("axis", (LEFT + right) / 2, under + 15, this.clock.axis ?? "time since epoch, s");
    this.svg.append(this.cursor);
  }

  // Of stretches of time, left and right edge of what is within the axis.
  spans(stretches) {
    const { begin, end } = this.clock;
    return stretches
      .map(([from, to]) => [this.x(Math.max(from, begin)), this.x(Math.min(to, end))])
      .filter(([a, b]) => b > a);
  }

  rule(kind, x1, y1, x2, y2) {
    this.svg.append(svg("line", { class: kind, x1, y1, x2, y2 }));
  }

  write(kind, x, y, text) {
    const turned = kind.includes("side") ? { transform: `rotate(-90 ${x} ${y})` } : {};
    this.svg.append(svg("text", { class: kind, x, y, ...turned }, text));
  }

  point() {
    if (!this.width) return;
    const x = this.x(this.clock.t);
    this.cursor.setAttribute("x1", x);
    this.cursor.setAttribute("x2", x);
  }

  // Press or drag sets the time; a finger that moves up or down scrolls the page instead.
  drag() {
    const seek = (event) => this.clock.seek(this.time(event.clientX - this.svg.getBoundingClientRect().left));
    this.svg.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      this.svg.setPointerCapture(event.pointerId);
      seek(event);
    });
    this.svg.addEventListener("pointermove", (event) => {
      if (this.svg.hasPointerCapture(event.pointerId)) seek(event);
    });
  }
}

class Paint {
  constructor(target, x, y) {
    Object.assign(this, { target, x, y });
  }

  path(kind, d) {
    if (d) this.target.append(svg("path", { class: kind, d }));
  }

  // A null ends a stretch.
  line(kind, t, values) {
    let pen = "M";
    let d = "";
    t.forEach((time, i) => {
      if (values[i] == null) pen = "M";
      else {
        d += `${pen}${this.x(time).toFixed(1)} ${this.y(values[i]).toFixed(1)}`;
        pen = "L";
      }
    });
    this.path(kind, d);
  }

  marks(kind, points) {
    const shape = { dot: "h0", cross: "m-3-3l6 6m0-6l-6 6", ring: "m-3 0a3 3 0 1 0 6 0a3 3 0 1 0-6 0" };
    const name = kind.split(" ")[0];
    this.path(kind, points.map(([t, value]) => `M${this.x(t).toFixed(1)} ${this.y(value).toFixed(1)}${shape[name]}`).join(""));
  }

  stems(kind, points) {
    const zero = this.y(0).toFixed(1);
    this.path(kind, points.map(([t, value]) => `M${this.x(t).toFixed(1)} ${zero}V${this.y(value).toFixed(1)}`).join(""));
  }

  // Between two curves, over the stretches where both are known.
  band(kind, t, low, high) {
    let run = [];
    const close = () => {
      const there = run.map((i) => `${this.x(t[i]).toFixed(1)} ${this.y(high[i]).toFixed(1)}`);
      const back = run.toReversed().map((i) => `${this.x(t[i]).toFixed(1)} ${this.y(low[i]).toFixed(1)}`);
      if (run.length > 1) this.path(kind, `M${[...there, ...back].join("L")}Z`);
      run = [];
    };
    t.forEach((_, i) => (low[i] == null || high[i] == null ? close() : run.push(i)));
    close();
  }
}

export function ticks(low, high, count) {
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
  return found;
}

export function ceiling(value) {
  if (!(value > 0)) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  return power * [1, 1.5, 2, 3, 4, 5, 6, 8, 10].find((factor) => factor * power >= value * (1 - 1e-12));
}

// Fewest decimals that tell all values, two where as few as six do not.
function digits(values) {
  const told = (count) => values.every((value) => Number.isInteger(Math.round(value * 1e9) / 10 ** (9 - count)));
  return [0, 1, 2, 3, 4, 5, 6].find(told) ?? 2;
}
