// SPDX-License-Identifier: Apache-2.0
// The decision of one run at a tick, as text: mode, reason, Vs, Vg and values.

const MOST_CELLS = 36; // more bits than this are shown as digits only

class Readout {
  constructor(run) {
    this.run = run;
    this.mode = html("strong", { class: "mode", "data-field": "mode" });
    this.reason = html("p", { class: "reason", "data-field": "reason" });
    this.vs = new Bits("Vs", run.bits[0], run.wedges.length);
    this.vg = new Bits("Vg", run.bits[1], run.wedges.length);
    this.fields = {};
    this.element = html(
      "div",
      { class: "readout" },
      html("p", { class: "modeline" }, html("span", { class: "dot" }), this.mode),
      this.reason,
      this.vs.element,
      this.vg.element,
      html("dl", {}, ...this.terms()),
    );
  }

  terms() {
    const names = {
      tick: "tick",
      time: "time",
      position: "position",
      waypoint: "waypoint",
      speed: "speed",
      clearance: "clearance until the next tick",
      near: "within sensing range",
    };
    return Object.entries(names).map(([key, name]) => {
      this.fields[key] = html("dd", { "data-field": key });
      return html("div", {}, html("dt", {}, name), this.fields[key]);
    });
  }

  show(k) {
    const { ticks, reasons } = this.run;
    const mode = DATA.modes[ticks.mode[k]];
    set(this.element, { "data-mode": mode.key });
    setText(this.mode, mode.label);
    setText(this.reason, reasons[ticks.reason[k]]);
    this.vs.show(ticks.vs[k], 0);
    this.vg.show(ticks.vg[k], ticks.gap[k]);
    const texts = {
      tick: `${k} of ${ticks.time.length - 1}`,
      time: figure(ticks.time[k], 3, "s"),
      position: point(ticks.x[k], ticks.y[k], 3),
      waypoint: point(ticks.waypoint_x[k], ticks.waypoint_y[k], 3),
      speed: figure(ticks.speed[k], 3, "m/s"),
      clearance: figure(ticks.clearance[k], 3, "m"),
      near: this.named(ticks.near[k]),
    };
    for (const [key, text] of Object.entries(texts)) setText(this.fields[key], text);
  }

  /** What is within sensing range: obstacles by number, robots by name. */
  named(numbers) {
    const names = numbers.map((number) => this.run.world.obstacles[number - 1].name);
    const isNumber = (name) => /^\d+$/.test(name);
    const obstacles = names.filter(isNumber).join(", ");
    const robots = names.filter((name) => !isNumber(name));
    return [...(obstacles ? [`obstacle ${obstacles}`] : []), ...robots].join(", ") || "nothing";
  }

  /** The same in one sentence, for screen readers. */
  sentence(k) {
    const { ticks, reasons } = this.run;
    const mode = DATA.modes[ticks.mode[k]].label;
    return `${this.run.name}: tick ${k}, ${figure(ticks.time[k], 2, "s")}, ${mode}, ${
      reasons[ticks.reason[k]]
    }`;
  }
}

/** A vector of bits as a row of numbered cells. */
class Bits {
  constructor(name, meaning, count) {
    this.name = name;
    this.cells = [];
    if (count <= MOST_CELLS) {
      for (let i = 1; i <= count; i++) this.cells.push(html("i", {}, String(i)));
    }
    this.row = html("span", { class: "cells", role: "img", "data-field": name.toLowerCase() });
    this.row.append(...this.cells);
    if (!this.cells.length) this.row.classList.add("digits");
    this.element = html(
      "p",
      { class: `bits ${name.toLowerCase()}`, title: `${name}: ${meaning}` },
      html("b", {}, name),
      this.row,
    );
  }

  show(bits, chosen) {
    set(this.row, { "aria-label": `${this.name} ${bits}`, "data-bits": bits });
    this.cells.forEach((cell, i) => {
      cell.classList.toggle("set", bits[i] === "1");
      cell.classList.toggle("chosen", i + 1 === chosen);
    });
    if (!this.cells.length) setText(this.row, (bits.match(/.{1,12}/g) || []).join(" "));
  }
}
