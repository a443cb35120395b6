// SPDX-License-Identifier: Apache-2.0
// One clock for all runs. It rests at instants only: the times at which some run has a tick.

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8, 16];
const SAME = 1e-6; // s: ticks of two runs that are closer than this are one instant

class Clock {
  constructor(runs) {
    const times = runs.flatMap((run) => run.ticks.time).sort((a, b) => a - b);
    this.instants = times.filter((t, i) => i === 0 || t - times[i - 1] > SAME);
    this.index = 0;
    this.time = this.instants[0];
    this.speed = 1;
    this.playing = false;
    this.listeners = []; // called with this clock after every change
  }

  get last() {
    return this.instants.length - 1;
  }

  /** Rest at instant number index, or at the nearest there is. */
  rest(index) {
    this.playing = false;
    this.index = Math.max(0, Math.min(this.last, index));
    this.time = this.instants[this.index];
    this.tell();
  }

  restAt(time) {
    const index = indexAt(this.instants, time);
    const next = this.instants[index + 1];
    this.rest(next !== undefined && next - time < time - this.instants[index] ? index + 1 : index);
  }

  play() {
    if (this.playing) return;
    if (this.index === this.last) this.rest(0);
    this.playing = true;
    this.before = null;
    requestAnimationFrame((now) => this.frame(now));
    this.tell();
  }

  pause() {
    if (this.playing) this.rest(this.index);
  }

  /** One step up or down the list of speeds. */
  faster(by) {
    const now = SPEEDS.indexOf(this.speed);
    this.speed = SPEEDS[Math.max(0, Math.min(SPEEDS.length - 1, now + by))];
    this.tell();
  }

  frame(now) {
    if (!this.playing) return;
    if (this.before !== null) this.time += ((now - this.before) / 1000) * this.speed;
    this.before = now;
    if (this.time >= this.instants[this.last]) return this.rest(this.last);
    this.index = indexAt(this.instants, this.time);
    this.tell();
    requestAnimationFrame((next) => this.frame(next));
  }

  tell() {
    for (const listener of this.listeners) listener(this);
  }
}

/** The last of some rising times that is not after a time, or the first. */
function indexAt(times, time) {
  let low = 0;
  let high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= time + SAME) low = middle;
    else high = middle - 1;
  }
  return low;
}
