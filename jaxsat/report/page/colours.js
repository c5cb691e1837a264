// Two schemes: shades that people with red-green blindness tell apart, and those of the paper; kept like the theme.
import { el } from "./dom.js";

const KEY = "jaxsat-colours";

// paper: colours of the page's data and what takes their place; first: with which scheme a new reader begins.
export function schemeButton(paper, first, theme) {
  const root = document.documentElement;
  const button = el("button", { class: "scheme", type: "button", onclick: () => keep(root.dataset.colours !== "paper") });
  const choose = (published) => {
    if (published) root.dataset.colours = "paper";
    else delete root.dataset.colours;
    for (const [own, other] of Object.entries(paper)) {
      if (published) root.style.setProperty(variable(own), other);
      else root.style.removeProperty(variable(own));
    }
    button.textContent = published ? "Safe colours" : "Paper’s colours";
    const what = published ? "colours told apart with red-green blindness" : "the colours of Penkov et al. 2009";
    button.setAttribute("aria-label", `Switch to ${what}`);
    theme.tell();
  };
  const keep = (published) => {
    choose(published);
    try {
      localStorage.setItem(KEY, published ? "paper" : "safe");
    } catch {
      // As with the theme.
    }
  };
  choose((remembered() ?? first) === "paper");
  return button;
}

function variable(colour) {
  return `--of-${colour.slice(1)}`;
}

function remembered() {
  try {
    return localStorage.getItem(KEY);
  } catch {
    return null;
  }
}
