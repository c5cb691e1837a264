// Play, slider and speed: one bar, which stays in sight while anything that it moves is.
import { el } from "./dom.js";
import { clockText } from "./text.js";

const SPEEDS = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000];

export function transport(page, clock) {
  const play = el("button", { type: "button", class: "play", onclick: () => clock.toggle() });
  const back = step("Previous sample", "‹", () => clock.step(-1));
  const on = step("Next sample", "›", () => clock.step(1));
  const slider = el("input", {
    type: "range",
    "aria-label": clock.axis ?? "Time since the epoch",
    min: clock.begin,
    max: clock.end,
    step: "any",
    oninput: () => clock.seek(Number(slider.value)),
  });
  const now = el("output", { class: "now" });
  const speed = el(
    "select",
    { "aria-label": "Speed", onchange: () => (clock.speed = Number(speed.value)) },
    ...SPEEDS.map((value) => el("option", { value, selected: value === clock.speed }, `${value}×`)),
  );
  clock.onChange(() => {
    play.textContent = clock.playing ? "❚❚" : "▶";
    play.setAttribute("aria-label", clock.playing ? "Pause" : "Play");
    slider.value = clock.t;
    const dark = page.shadow_s.some(([begin, end]) => clock.t >= begin && clock.t <= end);
    const text = clockText(page, clock.t);
    slider.setAttribute("aria-valuetext", `${text}${dark ? ", in the Earth's shadow" : ""}`);
    now.replaceChildren(...text.split(", ").map((part) => el("span", {}, part)));
  });
  return el(
    "div",
    { class: "transport", role: "group", "aria-label": "Time" },
    el("div", { class: "buttons" }, back, play, on),
    el("div", { class: "rail" }, shadowMarks(page, clock), slider),
    now,
    speed,
  );
}

function step(label, text, onclick) {
  return el("button", { type: "button", "aria-label": label, title: label, onclick }, text);
}

function shadowMarks(page, clock) {
  const marks = el("div", { class: "marks", "aria-hidden": "true" });
  const share = (t) => `${(100 * (Math.min(Math.max(t, clock.begin), clock.end) - clock.begin)) / (clock.end - clock.begin)}%`;
  for (const [begin, end] of page.shadow_s) {
    if (end < clock.begin || begin > clock.end) continue;
    const mark = el("span");
    mark.style.left = share(begin);
    mark.style.right = `calc(100% - ${share(end)})`;
    marks.append(mark);
  }
  return marks;
}
