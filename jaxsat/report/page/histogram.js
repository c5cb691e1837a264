// How an outcome is distributed: bars of cases that failed on top of those that succeeded, and 5, 50, 95 %.
import { Axes, texts } from "./axes.js";
import { el } from "./dom.js";

export function histogram(outcome) {
  const { title, unit, meaning, cases, missing, beyond, edges, succeeded, failed, marks, logarithmic, whole } = outcome;
  const notes = [`${texts.count(cases)} cases`];
  if (missing) notes.push(`${texts.count(missing)} without it`);
  if (beyond) notes.push(`${texts.count(beyond)} beyond the axis`);
  const output = el("output", { "aria-live": "off" }, said());
  const figure = el(
    "figure",
    { class: "outcome" },
    el("h3", {}, title, unit ? el("small", {}, `, ${unit}`) : ""),
    el("p", { class: "note" }, meaning),
    el("small", {}, notes.join(", ")),
  );
  if (!edges.length) return fill(figure, el("p", {}, "No case has it."));

  function said() {
    if (!cases) return "";
    return `5, 50, 95 %: ${marks.map(texts.value).join(", ")}${unit ? ` ${unit}` : ""}`;
  }

  const most = Math.max(...succeeded.map((n, k) => n + failed[k]));
  const axes = new Axes({
    height: 150,
    label: `Histogram of ${title}: ${said()}`,
    x: { low: edges[0], high: edges.at(-1), logarithmic, whole },
    y: { low: 0, high: most * 1.05, whole: true },
    draw(paint) {
      const bars = (kind, from, counts) => {
        let d = "";
        counts.forEach((n, k) => {
          if (!n) return;
          const [left, right] = [paint.x(edges[k]), paint.x(edges[k + 1])];
          const gap = right - left > 4 ? 0.5 : 0;
          d += `M${f(left + gap)} ${f(paint.y(from[k]))}H${f(right - gap)}V${f(paint.y(from[k] + n))}H${f(left + gap)}Z`;
        });
        paint.path(kind, d);
      };
      bars("bar-good", succeeded.map(() => 0), succeeded);
      bars("bar-bad", succeeded, failed);
      marks.forEach((value, k) => {
        if (value != null && value >= edges[0] && value <= edges.at(-1)) paint.rule(k === 1 ? "mark" : "mark side", value);
      });
    },
  });
  const tell = (event) => {
    const value = axes.at(event).x;
    const k = edges.findIndex((edge) => edge > value) - 1;
    if (k < 0) return;
    const range = `${texts.value(edges[k])} to ${texts.value(edges[k + 1])}${unit ? ` ${unit}` : ""}`;
    output.textContent = `${range}: ${texts.count(succeeded[k])} succeeded, ${texts.count(failed[k])} failed`;
  };
  axes.svg.addEventListener("pointermove", tell);
  axes.svg.addEventListener("pointerdown", tell);
  axes.svg.addEventListener("pointerleave", () => (output.textContent = said()));
  return fill(figure, output, axes.element);
}

const f = (x) => x.toFixed(1);

function fill(node, ...children) {
  node.append(...children);
  return node;
}
