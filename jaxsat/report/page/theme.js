// Light or dark: that of the system until the button says otherwise.
import { el } from "./dom.js";

const KEY = "jaxsat-theme";

export class Theme {
  constructor() {
    this.system = matchMedia("(prefers-color-scheme: dark)");
    this.listeners = [];
    this.button = el("button", { class: "theme", type: "button", onclick: () => this.toggle() });
    this.probe = el("span", { hidden: true });
    document.body.append(this.probe);
    const kept = remembered();
    if (kept) document.documentElement.dataset.theme = kept;
    this.system.addEventListener("change", () => this.tell());
    this.tell();
  }

  get dark() {
    const own = document.documentElement.dataset.theme;
    return own ? own === "dark" : this.system.matches;
  }

  toggle() {
    const theme = this.dark ? "light" : "dark";
    document.documentElement.dataset.theme = theme;
    try {
      localStorage.setItem(KEY, theme);
    } catch {
      // A browser that keeps nothing for files: the choice lasts as long as the page.
    }
    this.tell();
  }

  onChange(listener) {
    this.listeners.push(listener);
    listener(this);
  }

  tell() {
    this.button.textContent = this.dark ? "Light" : "Dark";
    this.button.setAttribute("aria-label", `Switch to ${this.dark ? "light" : "dark"} colours`);
    for (const listener of this.listeners) listener(this);
  }

  // A colour of the data as the scheme has it.
  own(colour) {
    return this.colour(`of-${colour.slice(1)}, ${colour}`);
  }

  // A colour of page.css as the browser has resolved it for the theme.
  colour(name) {
    this.probe.style.color = `var(--${name})`;
    return getComputedStyle(this.probe).color;
  }
}

function remembered() {
  try {
    return localStorage.getItem(KEY);
  } catch {
    return null;
  }
}
