// SPDX-License-Identifier: Apache-2.0
// Elements, numbers in words, and the data. Names from bags only ever become text or attributes.

const DATA = JSON.parse(document.getElementById("data").textContent);
const SVG = "http://www.w3.org/2000/svg";

/** An HTML element; children are elements or text, attributes that are null are left out. */
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

/** Change a text only where it differs: readers of the screen are told of every change. */
function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** A figure with its unit, or a dash for one that does not exist. */
function figure(value, digits, unit) {
  return value === null || value === undefined ? "–" : `${value.toFixed(digits)} ${unit}`;
}

function point(x, y, digits) {
  return x === null || y === null ? "–" : `(${x.toFixed(digits)}, ${y.toFixed(digits)}) m`;
}

/** What a CSS variable stands for now. */
function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}
