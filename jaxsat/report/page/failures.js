// The cases that failed, by their reason, and the command that shows the one that is chosen.
import { texts } from "./axes.js";
import { el } from "./dom.js";
import { named, sign } from "./scatter.js";

const ROWS = 15;

// Which case is looked at, told to all that show it.
export class Choice {
  constructor(number) {
    this.number = number;
    this.listeners = [];
  }

  onChange(listener) {
    this.listeners.push(listener);
  }

  choose(number) {
    this.number = number;
    for (const listener of this.listeners) listener();
  }
}

export function failures(page, choice) {
  const { statuses, counts, outcomes } = page;
  const rows = page.case.map((_, i) => i).filter((i) => page.status[i] > 0);
  const list = rows.length ? rows : page.case.map((_, i) => i);
  let shown = ROWS;
  const select = el("select", { "aria-label": "Which", onchange: () => fill((shown = ROWS)) });
  select.append(el("option", { value: "" }, rows.length ? `all that failed: ${texts.count(page.failed)}` : "all cases"));
  statuses.forEach((name, code) => {
    if (code && counts[code]) select.append(el("option", { value: code }, `${name}: ${texts.count(counts[code])}`));
  });
  const head = ["case", "ended", ...outcomes.map(named)].map((text, k) => el("th", { class: k > 1 ? "number" : "" }, text));
  const body = el("tbody");
  const more = el("button", { type: "button", onclick: () => fill((shown += 10 * ROWS)) }, "More");
  const note = el("p", { class: "note" });

  function fill() {
    const code = select.value;
    const chosen = list.filter((i) => code === "" || page.status[i] === Number(code));
    body.replaceChildren(...chosen.slice(0, shown).map(row));
    more.hidden = chosen.length <= shown;
    const all = code === "" ? (rows.length ? page.failed : page.cases) : counts[Number(code)];
    const here = Math.min(shown, chosen.length);
    const kept = chosen.length < all ? ` This page holds ${texts.count(chosen.length)} of them; summary.json has the numbers of all.` : "";
    note.textContent = `${texts.count(here)} of ${texts.count(all)} are listed.${kept}`;
    mark();
  }

  function row(i) {
    const button = el("button", { type: "button", class: "number", onclick: () => choice.choose(page.case[i]) }, String(page.case[i]));
    const values = outcomes.map(({ data }) => el("td", { class: "number" }, texts.value(data[i])));
    const ended = el("td", {}, sign(page.status[i]), ` ${statuses[page.status[i]]}`);
    const made = el("tr", {}, el("td", {}, button), ended, ...values);
    made.dataset.case = page.case[i];
    return made;
  }

  function mark() {
    for (const made of body.children) made.classList.toggle("chosen", Number(made.dataset.case) === choice.number);
  }

  choice.onChange(mark);
  fill();
  const table = el("table", {}, el("thead", {}, el("tr", {}, ...head)), body);
  return el("div", { class: "failures" }, el("div", { class: "choosers" }, el("label", {}, "show ", select)), el("div", { class: "scroll" }, table), more, note);
}

// The command of the chosen case, to be copied.
export function replay(page, choice) {
  const code = el("code", {});
  const copy = el("button", { type: "button" }, "Copy");
  copy.addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(code.textContent);
      copy.textContent = "Copied";
    } catch {
      getSelection().selectAllChildren(code);
    }
  });
  const tell = () => {
    code.textContent = `${page.replay} ${choice.number}`;
    copy.textContent = "Copy";
  };
  choice.onChange(tell);
  tell();
  return el("p", { class: "replay" }, el("span", {}, "To look at this case: "), code, copy);
}
