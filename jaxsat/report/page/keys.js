// Space plays, arrows step, Home and End jump: anywhere on the page but where a control needs the key itself.
const STEPS = { ArrowLeft: -1, ArrowRight: 1, PageUp: -10, PageDown: 10 };

export function bindKeys(clock) {
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { target, key } = event;
    const slider = target.matches("input[type=range]");
    if (!slider && target.matches("input, select, textarea")) return;
    if (key === " " && target.matches("button, summary, a")) return;
    if (!act(clock, key, slider, event.shiftKey)) return;
    event.preventDefault();
  });
}

function act(clock, key, slider, far) {
  if (key === " ") clock.toggle();
  else if (key === "ArrowLeft" || key === "ArrowRight") clock.step(STEPS[key] * (far ? 10 : 1));
  // Elsewhere these scroll the page.
  else if (slider && key in STEPS) clock.step(STEPS[key]);
  else if (slider && (key === "ArrowUp" || key === "ArrowDown")) clock.step(key === "ArrowUp" ? 1 : -1);
  else if (key === "Home") clock.seek(clock.begin);
  else if (key === "End") clock.seek(clock.end);
  else return false;
  return true;
}
