// The page of a sweep: histograms, any outcome against anything that was drawn, and the cases that failed.
import { el } from "./dom.js";
import { Choice, failures, replay } from "./failures.js";
import { histogram } from "./histogram.js";
import { Scatter } from "./scatter.js";
import { Theme } from "./theme.js";

function start() {
  const page = JSON.parse(document.getElementById("data").textContent);
  for (const column of [...page.outcomes, ...page.inputs]) column.data = numbers(column.values);
  const theme = new Theme();
  document.querySelector("header").append(theme.button);

  const failed = page.status.findIndex((code) => code > 0);
  const choice = new Choice(page.case[Math.max(failed, 0)]);
  const outcomes = section("distributions");
  const summary = outcomes.querySelector("summary");
  if (summary) {
    outcomes.querySelector("details").removeAttribute("open");
    summary.textContent = "Picture for papers (PNG)";
  }
  const legend = el("ul", { class: "legend" });
  const kinds = [["bar-good", "succeeded"], ...(page.failed ? [["bar-bad", "failed"]] : [])];
  for (const [kind, name] of kinds) legend.append(el("li", {}, el("span", { class: `box ${kind}` }), name));
  legend.append(el("li", {}, el("span", { class: "sign dashed" }), "5 and 95 %"), el("li", {}, el("span", { class: "sign" }), "50 %"));
  outcomes.querySelector("h2").after(legend, el("div", { class: "panels outcomes" }, ...page.outcomes.map(histogram)));

  const scatter = new Scatter(page, choice);
  section("scatter").append(scatter.element, replay(page, choice));
  section("failures").append(failures(page, choice), replay(page, choice));
  window.jaxsat = {
    choose: (number) => choice.choose(number),
    state: () => ({
      case: choice.number,
      theme: theme.dark ? "dark" : "light",
      across: scatter.across.value,
      up: scatter.up.value,
      drawn: scatter.places?.filter(Boolean).length,
    }),
  };
}

function section(name) {
  const found = document.querySelector(`[data-live="${name}"]`);
  found.hidden = false;
  return found;
}

// Little-endian float32 in base64.
function numbers(text) {
  const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  return Array.from({ length: bytes.length / 4 }, (_, i) => view.getFloat32(4 * i, true));
}

start();
