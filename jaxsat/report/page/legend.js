// What the lines and arrows of the views are; colours are those of page.css by the same names.
import { el } from "./dom.js";

const MEANINGS = {
  orbit: "orbit",
  "shadow-arc": "its arc in the Earth's shadow",
  sun: "Sun; its meridian",
  field: "magnetic field B; field line",
  "x-axis": "body x",
  nadir: "nadir",
  equator: "equator",
  greenwich: "Greenwich meridian",
};

export function legend() {
  return el(
    "ul",
    { class: "legend" },
    ...Object.entries(MEANINGS).map(([name, text]) => el("li", {}, el("span", { class: `line ${name}` }), text)),
  );
}
