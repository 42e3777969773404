// Short names for the DOM.

/**
 * Returns the element with an id: the kind of element depends on the id.
 * @returns {any}
 */
export const by = (id) => document.getElementById(id);

/**
 * Creates an HTML element.
 * @template {keyof HTMLElementTagNameMap} Name
 * @param {Name} name
 * @param {Record<string, any>} [properties]
 * @param {...(Node | string)} children
 * @returns {HTMLElementTagNameMap[Name]}
 */
export function node(name, properties = {}, ...children) {
  const element = Object.assign(document.createElement(name), properties);
  element.append(...children);
  return element;
}

/**
 * Returns the element with the focus.
 * @returns {any}
 */
export const focusedElement = () => document.activeElement;

/**
 * Asks for a name, without blocking the page: a modal prompt would end motion and hide STOP.
 * @returns {Promise<string>} the name; empty if the user cancels
 */
export function askName(title) {
  const dialog = by("naming"), input = by("naming-name");
  by("naming-title").textContent = title;
  input.value = "";
  dialog.returnValue = "";
  dialog.show();
  input.focus();
  return new Promise((resolve) => { dialog.onclose = () => resolve(dialog.returnValue === "save" ? input.value.trim() : ""); });
}

const SVG = "http://www.w3.org/2000/svg";

/**
 * Creates an SVG element.
 * @returns {any}
 */
export function svgNode(name, attributes, text) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  return element;
}
