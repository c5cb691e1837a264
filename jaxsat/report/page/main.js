// Finds the places that the report left for the script and fills them; whatever fails leaves the pictures in place.
import { ChannelCharts } from "./channels.js";
import { attitude } from "./attitude.js";
import { Clock } from "./clock.js";
import { schemeButton } from "./colours.js";
import { el } from "./dom.js";
import { bindKeys } from "./keys.js";
import { Motion } from "./motion.js";
import { Readouts } from "./readouts.js";
import { readPage } from "./data.js";
import { Theme } from "./theme.js";
import { transport } from "./transport.js";
import { Views, webglWorks } from "./views.js";

function start() {
  const page = readPage(document.getElementById("data").textContent);
  const theme = new Theme();
  const switches = el("div", { class: "switches" }, page.paper ? schemeButton(page.paper, page.scheme, theme) : null, theme.button);
  document.querySelector("header").append(switches);
  if (page.samples.t_s.length < 2) return;

  const clock = new Clock(page);
  if (page.turn) clock.axis = `turn about the ${page.turn.about}, deg`;
  const place = (name) => document.querySelector(`[data-live="${name}"]`);
  const live = el("div", { class: "live" });
  place("motion").before(live);
  for (const section of document.querySelectorAll("[data-live]")) live.append(unfold(section));
  for (const item of document.querySelectorAll("nav.contents li[hidden]")) item.hidden = false;

  const motion = page.scene && new Motion(page);
  let views = null;
  if (motion) {
    const section = place("motion");
    const still = section.querySelector("details");
    if (webglWorks()) {
      views = new Views(page, motion, clock, theme);
      section.querySelector("h2").after(views.element);
    } else {
      still?.setAttribute("open", "");
      section.querySelector("h2").after(el("p", { class: "note" }, "This browser shows no WebGL: no view to turn."));
    }
    const readouts = new Readouts(page, motion, clock, theme);
    const state = el("section", { class: "state", "aria-label": "State at the cursor" }, readouts.element);
    section.after(transport(page, clock), state);
    if (still) state.append(still);
  } else {
    place("motion").after(transport(page, clock));
    drop(place("motion"));
  }
  const places = { rates: place("rates"), angle: place("field-angle"), channels: page.channels.map((_, k) => place(`channel-${k}`)) };
  const charts = new ChannelCharts(page, motion, clock, places);
  // A turn stands at one instant.
  if (place("attitude")) {
    const told = motion && !page.turn;
    if (told) place("attitude").querySelector("h2").after(...attitude(page, motion, clock, (label, strips) => charts.make(label, strips)));
    else drop(place("attitude"));
  }
  bindKeys(clock);

  const asked = Number(new URLSearchParams(location.hash.slice(1)).get("t") ?? NaN);
  clock.seek(Number.isFinite(asked) ? asked : page.turn?.angle_deg ?? clock.begin);
  window.jaxsat = {
    seek: (t) => clock.seek(t),
    play: () => clock.play(),
    pause: () => clock.pause(),
    state: () => ({
      t_s: clock.t,
      playing: clock.playing,
      theme: theme.dark ? "dark" : "light",
      charts: charts.count,
      frames: views?.frames ?? 0,
      ...(motion && motion.plain(clock.t)),
    }),
  };
}

// With its line in the contents.
function drop(section) {
  document.querySelector(`nav.contents a[href="#${section.id}"]`)?.parentElement.remove();
  section.remove();
}

function unfold(section) {
  section.hidden = false;
  section.querySelector("details")?.removeAttribute("open");
  const summary = section.querySelector("summary");
  if (summary) summary.textContent = "Picture for papers (PNG)";
  return section;
}

start();
