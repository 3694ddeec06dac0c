// The beginning of every page's scripts: the page's data, and functions for elements.

const opening = JSON.parse(document.querySelector("#data").textContent);
const SVG = new DOMParser().parseFromString("<svg></svg>", "text/html").querySelector("svg").namespaceURI; // no address in the page

function element(name, attributes = {}, ...children) {
  return made(document.createElement(name), attributes, children);
}

/** An element of an SVG. */
function shape(name, attributes = {}, ...children) {
  return made(document.createElementNS(SVG, name), attributes, children);
}

/** A button that does something. */
function button(does, attributes, ...children) {
  const made = element("button", { type: "button", ...attributes }, ...children);
  made.addEventListener("click", does);
  return made;
}

function made(bare, attributes, children) {
  for (const [key, value] of Object.entries(attributes)) bare.setAttribute(key, value);
  bare.append(...children);
  return bare;
}
