// SPDX-License-Identifier: Apache-2.0
// Charts of clearance and speed over time. matplotlib drew them for several widths; this shows the
// one that fits, with a cursor at the clock's time. Press or drag on it to move the clock.

class Charts {
  constructor(sheets, clock) {
    this.sheets = sheets;
    this.clock = clock;
    this.element = html("div", {
      id: "charts",
      role: "img",
      "aria-label": "Clearance and speed over time; the values of a tick are beside its world",
    });
    this.cursor = svg("path", { class: "cursor" });
    for (const type of ["pointerdown", "pointermove"]) {
      this.element.addEventListener(type, (event) => this.onPointer(event));
    }
    new ResizeObserver(() => this.fit()).observe(this.element);
  }

  /** Show the widest drawing that the page has room for. */
  fit() {
    const width = this.element.clientWidth;
    const sheet = this.sheets.filter(({ from_px: from }) => from <= width).pop();
    if (!sheet || sheet === this.sheet) return;
    this.sheet = sheet;
    const drawn = new DOMParser().parseFromString(sheet.svg, "image/svg+xml").documentElement;
    for (const element of drawn.querySelectorAll("metadata, style")) element.remove();
    set(drawn, { width: null, height: null });
    drawn.append(this.cursor);
    this.element.replaceChildren(document.importNode(drawn, true));
    this.cursor = this.element.querySelector(".cursor");
    const [, , w, h] = drawn.getAttribute("viewBox").split(" ").map(Number);
    this.size = { w, h };
    this.highlight();
    this.show();
  }

  /** Highlight the line of one run. */
  choose(number) {
    this.chosen = number;
    this.highlight();
  }

  highlight() {
    if (this.chosen === undefined) return;
    for (const line of this.element.querySelectorAll('[id^="line-"]')) {
      line.classList.toggle("aside", line.id !== `line-${this.chosen + 1}`);
    }
  }

  show() {
    if (!this.sheet) return;
    const { start, end, left, right } = this.sheet;
    const time = this.clock.instants[this.clock.index];
    const x = this.size.w * (left + ((time - start) / (end - start)) * (right - left));
    set(this.cursor, { d: `M${x.toFixed(2)} 16V${this.size.h - 22}` });
  }

  onPointer(event) {
    if (!this.sheet || !(event.buttons & 1)) return;
    const { start, end, left, right } = this.sheet;
    const box = this.element.getBoundingClientRect();
    const fraction = ((event.clientX - box.left) / box.width - left) / (right - left);
    this.clock.seekTime(start + fraction * (end - start));
  }
}
