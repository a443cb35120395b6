// SPDX-License-Identifier: Apache-2.0
// Make elements, format numbers, read the data. Names from bags become text or attributes only.

const DATA = JSON.parse(document.getElementById("data").textContent);
const SVG = "http://www.w3.org/2000/svg";

/** Make an HTML element; children: elements or text; attributes that are null are left out. */
function html(tag, attributes = {}, ...children) {
  return filled(document.createElement(tag), attributes, children);
}

/** The same for SVG. */
function svg(tag, attributes = {}, ...children) {
  return filled(document.createElementNS(SVG, tag), attributes, children);
}

function filled(element, attributes, children) {
  set(element, attributes);
  element.append(...children);
  return element;
}

function set(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null) element.removeAttribute(name);
    else if (element.getAttribute(name) !== String(value)) element.setAttribute(name, value);
  }
}

/** Set a text only if it differs: screen readers announce every change. */
function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** A number with its unit, or a dash for null. */
function figure(value, digits, unit) {
  return value === null || value === undefined ? "–" : `${value.toFixed(digits)} ${unit}`;
}

function point(x, y, digits) {
  return x === null || y === null ? "–" : `(${x.toFixed(digits)}, ${y.toFixed(digits)}) m`;
}

/** The current value of a CSS colour variable. */
function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}
