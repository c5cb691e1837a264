// The whole sky about body z, as the spacecraft sees it: the distance from the middle is the angle from z.
import { coloured, el, svg } from "./dom.js";

const SIZE = 400;
const RADIUS = 186;
const DEG = Math.PI / 180;
const ARROW_DEG = 30;

export class Sky {
  constructor(page, clock) {
    Object.assign(this, { page, clock });
    this.svg = svg("svg", { class: "sky", viewBox: `${-SIZE / 2} ${-SIZE / 2} ${SIZE} ${SIZE}`, role: "img" });
    this.element = el("div", { class: "sky-frame" }, this.svg);
    this.rim = circle("space", RADIUS);
    this.earth = svg("path", { class: "earth", "fill-rule": "evenodd" });
    this.trail = svg("path", { class: "trail" });
    this.centre = circle("centre", 3.5);
    this.sun = circle("sun", 6);
    this.moon = circle("moon", 5);
    this.arrow = svg("path", { class: "arrow" });
    const rings = [30, 60, 90, 120, 150].map((angle) => circle("ring-of-sky", scaled(angle)));
    const names = [60, 120].map((angle) => svg("text", { x: 0.71 * scaled(angle), y: 0.71 * scaled(angle) }, `${angle}°`));
    this.sensors = page.sensors.map(({ name, colour }) => ({
      name: svg("text", { class: "sensor-name" }, name),
      scan: coloured(svg("path", { class: "scan" }), colour),
    }));
    const cross = svg("path", { class: "axis-z", d: "M-6 0h12M0-6v12" });
    this.svg.append(this.rim, this.earth, ...rings, ...names, this.trail, this.centre, this.moon, this.sun, cross);
    for (const { scan, name } of this.sensors) this.svg.append(scan, name);
    this.svg.append(this.arrow);
    clock.onChange(() => this.draw());
  }

  draw() {
    const { samples, disk_deg, moon, sun } = this.page;
    const i = this.clock.sample();
    const nadir = samples.nadir[i];
    this.svg.setAttribute("aria-label", `Sky about body z: Earth's centre ${samples.error_deg[i].toFixed(1)} degrees off`);
    this.earth.setAttribute("d", disk(nadir, disk_deg * DEG));
    put(this.centre, nadir);
    this.trail.setAttribute("d", trail(samples.nadir, i));
    const behind = (direction) => dot(direction, nadir) > Math.cos(disk_deg * DEG);
    for (const [mark, rows, wanted] of [[this.sun, samples.sun, sun], [this.moon, samples.moon, moon]]) {
      mark.toggleAttribute("hidden", !wanted || behind(rows[i]));
      put(mark, rows[i]);
    }
    this.sensors.forEach(({ scan, name }, k) => this.scan(scan, name, samples.azimuths[i][k], samples.present[i][k]));
    // z moves toward x by a turn about y, toward y by one against x.
    const [wx, wy] = samples.rate_deg_s[i];
    const size = Math.hypot(wx, wy);
    const length = scaled(ARROW_DEG) * Math.min(size / this.page.search_rate_deg_s, 1.5);
    this.arrow.setAttribute("d", length > 2 ? arrow([wy / size, -wx / size], length) : "");
  }

  scan(path, name, [x, y], present) {
    const { cone_deg, amplitude_deg } = this.page;
    const [inner, outer] = [scaled(cone_deg - amplitude_deg), scaled(cone_deg + amplitude_deg)];
    path.setAttribute("d", `M${x * inner} ${y * inner}L${x * outer} ${y * outer}`);
    path.classList.toggle("present", Boolean(present));
    name.setAttribute("x", x * (outer + 13));
    name.setAttribute("y", y * (outer + 13) + 4);
  }
}

function circle(kind, r) {
  return svg("circle", { class: kind, r, cx: 0, cy: 0 });
}

function scaled(angle_deg) {
  return (RADIUS * angle_deg) / 180;
}

function dot(a, b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Looking along z with x to the right, y points down.
function project([x, y, z]) {
  const across = Math.hypot(x, y);
  const r = scaled(Math.atan2(across, z) / DEG) / (across || 1);
  return [x * r, y * r];
}

function put(mark, direction) {
  const [x, y] = project(direction);
  mark.setAttribute("cx", x);
  mark.setAttribute("cy", y);
}

function path(points) {
  return points.map(([x, y], n) => `${n ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}`).join("");
}

function disk(nadir, radius) {
  const least = nadir.map(Math.abs).indexOf(Math.min(...nadir.map(Math.abs)));
  const other = [0, 0, 0].with(least, 1);
  const u = unit(cross(nadir, other));
  const v = cross(nadir, u);
  const edge = [];
  for (let n = 0; n < 240; n++) {
    const [c, s] = [Math.cos((n * Math.PI) / 120) * Math.sin(radius), Math.sin((n * Math.PI) / 120) * Math.sin(radius)];
    edge.push(project(nadir.map((value, k) => Math.cos(radius) * value + c * u[k] + s * v[k])));
  }
  // With the point behind the spacecraft in it, the disk is what lies outside of its edge.
  const all = -nadir[2] > Math.cos(radius) ? `M${RADIUS} 0A${RADIUS} ${RADIUS} 0 1 0 ${-RADIUS} 0A${RADIUS} ${RADIUS} 0 1 0 ${RADIUS} 0Z` : "";
  return `${all}${path(edge)}Z`;
}

function trail(rows, end) {
  let [d, before] = ["", null];
  for (const row of rows.slice(0, end + 1)) {
    const point = project(row);
    // Past the point behind, a line across the whole sky would be no motion.
    const jump = !before || Math.hypot(point[0] - before[0], point[1] - before[1]) > 40;
    d += `${jump ? "M" : "L"}${point[0].toFixed(1)} ${point[1].toFixed(1)}`;
    before = point;
  }
  return d;
}

function arrow([x, y], length) {
  const [tip, back] = [length, length - 7];
  const at = (along, side) => `${(x * along - y * side).toFixed(1)} ${(y * along + x * side).toFixed(1)}`;
  return `M0 0L${at(tip, 0)}M${at(back, 4)}L${at(tip, 0)}L${at(back, -4)}`;
}

function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

function unit(a) {
  const size = Math.hypot(...a);
  return a.map((value) => value / size);
}
