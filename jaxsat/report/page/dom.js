// Elements with attributes and children, in HTML and in SVG.
const SVG = "http://www.w3.org/2000/svg";

export function el(tag, attributes = {}, ...children) {
  return fill(document.createElement(tag), attributes, children);
}

export function svg(tag, attributes = {}, ...children) {
  return fill(document.createElementNS(SVG, tag), attributes, children);
}

function fill(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (value !== false && value != null) node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...children.filter((child) => child != null));
  return node;
}

// By the object model: a style attribute is what the page's policy forbids. The scheme may put another in its place.
export function coloured(node, colour) {
  node.style.setProperty("--own", `var(--of-${colour.slice(1)}, ${colour})`);
  return node;
}
