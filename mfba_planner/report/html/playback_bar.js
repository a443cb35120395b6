// SPDX-License-Identifier: Apache-2.0
// The replay controls: play, pause, one tick, speed and the time line; also by keyboard.

const KEYS = {
  " ": (clock) => (clock.playing ? clock.pause() : clock.play()),
  ArrowLeft: (clock, far) => clock.seek(clock.index - (far ? 10 : 1)),
  ArrowRight: (clock, far) => clock.seek(clock.index + (far ? 10 : 1)),
  Home: (clock) => clock.seek(0),
  End: (clock) => clock.seek(clock.last),
  "+": (clock) => clock.changeSpeed(1),
  "=": (clock) => clock.changeSpeed(1), // + without shift
  "-": (clock) => clock.changeSpeed(-1),
};

class Transport {
  constructor(runs, clock, describe) {
    this.runs = runs;
    this.clock = clock;
    this.describe = describe;
    this.slider = html("input", {
      type: "range", id: "time", min: 0, max: clock.last, step: 1, value: 0,
      "aria-label": "Time", "aria-keyshortcuts": "ArrowLeft ArrowRight Home End",
    });
    this.slider.addEventListener("input", () => clock.seek(Number(this.slider.value)));
    this.play = button("play", "Play", "Space", () => KEYS[" "](clock));
    this.speed = html(
      "select",
      { id: "speed", "aria-label": "Speed", "aria-keyshortcuts": "+ -" },
      ...SPEEDS.map((speed) => html("option", { value: speed }, `${speed}×`)),
    );
    this.speed.addEventListener("change", () => {
      clock.speed = Number(this.speed.value);
    });
    this.now = html("output", { id: "now", for: "time" });
    this.announcement = html("p", { class: "visually-hidden", "aria-live": "polite" });
    this.element = html(
      "div",
      { class: "transport", role: "group", "aria-label": "Replay" },
      html("div", { class: "timeline" }, ribbons(runs, clock), this.slider),
      html(
        "div",
        { class: "buttons" },
        button("first", "To the start", "Home", () => clock.seek(0)),
        button("back", "One tick back", "ArrowLeft", () => clock.seek(clock.index - 1)),
        this.play,
        button("next", "One tick on", "ArrowRight", () => clock.seek(clock.index + 1)),
        button("last", "To the end", "End", () => clock.seek(clock.last)),
        this.speed,
        this.now,
      ),
      this.announcement,
    );
    document.addEventListener("keydown", (event) => this.onKey(event));
  }

  onKey(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const { target } = event;
    if (target instanceof HTMLSelectElement) return;
    const presses = target instanceof HTMLButtonElement || target.tagName === "SUMMARY";
    if (event.key === " " && presses) return; // the browser presses the focused control
    const scrolls = target.classList && target.classList.contains("scroll");
    if (scrolls && event.key.startsWith("Arrow")) return;
    const act = KEYS[event.key];
    if (!act) return;
    event.preventDefault();
    act(this.clock, event.shiftKey);
  }

  show() {
    const { clock } = this;
    const text = clock.playing ? "Pause" : "Play";
    set(this.play, { "aria-label": text, title: `${text} (Space)`, "data-icon": clock.playing ? "pause" : "play" });
    this.slider.value = clock.index;
    this.speed.value = clock.speed;
    const time = clock.instants[clock.index];
    setText(this.now, `${time.toFixed(2)} s`);
    const sentence = this.describe();
    set(this.slider, { "aria-valuetext": sentence });
    if (!clock.playing) setText(this.announcement, sentence);
  }
}

function button(icon, text, key, act) {
  const element = html("button", {
    type: "button", id: icon, "data-icon": icon, "aria-label": text, "aria-keyshortcuts": key,
    title: `${text} (${key})`,
  });
  element.addEventListener("click", act);
  return element;
}

/** The modes of each run along the time line, one row per run. */
function ribbons(runs, clock) {
  const drawn = svg("svg", {
    class: "ribbons", viewBox: `0 0 ${Math.max(1, clock.last)} ${runs.length}`,
    preserveAspectRatio: "none", "aria-hidden": "true",
  });
  runs.forEach((run, row) => {
    const { time, mode } = run.ticks;
    for (let first = 0, k = 1; k <= mode.length; k++) {
      if (k < mode.length && mode[k] === mode[first]) continue;
      const from = indexAt(clock.instants, time[first]);
      const to = indexAt(clock.instants, time[Math.min(k, time.length - 1)]);
      const { key } = DATA.modes[mode[first]];
      drawn.append(
        svg("rect", { x: from, y: row + 0.1, width: to - from, height: 0.8, "data-mode": key }),
      );
      first = k;
    }
  });
  return drawn;
}
