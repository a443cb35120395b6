// SPDX-License-Identifier: Apache-2.0
// One clock for all runs. It stops only at instants: the times at which some run has a tick.

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8, 16];
const SAME = 1e-6; // s: ticks of two runs closer than this are one instant

class Clock {
  constructor(runs) {
    const times = runs.flatMap((run) => run.ticks.time).sort((a, b) => a - b);
    this.instants = times.filter((t, i) => i === 0 || t - times[i - 1] > SAME);
    this.index = 0;
    this.time = this.instants[0];
    this.speed = 1;
    this.playing = false;
    this.callbacks = []; // called with this clock after every change
  }

  get last() {
    return this.instants.length - 1;
  }

  /** Stop at instant number index, limited to the first and the last. */
  seek(index) {
    this.playing = false;
    this.index = Math.max(0, Math.min(this.last, index));
    this.time = this.instants[this.index];
    this.notify();
  }

  /** Stop at the instant nearest to a time (s). */
  seekTime(time) {
    const index = indexAt(this.instants, time);
    const next = this.instants[index + 1];
    this.seek(next !== undefined && next - time < time - this.instants[index] ? index + 1 : index);
  }

  play() {
    if (this.playing) return;
    if (this.index === this.last) this.seek(0);
    this.playing = true;
    this.before = null;
    requestAnimationFrame((now) => this.frame(now));
    this.notify();
  }

  pause() {
    if (this.playing) this.seek(this.index);
  }

  /** Move up or down the list of speeds by so many entries. */
  changeSpeed(by) {
    const now = SPEEDS.indexOf(this.speed);
    this.speed = SPEEDS[Math.max(0, Math.min(SPEEDS.length - 1, now + by))];
    this.notify();
  }

  frame(now) {
    if (!this.playing) return;
    if (this.before !== null) this.time += ((now - this.before) / 1000) * this.speed;
    this.before = now;
    if (this.time >= this.instants[this.last]) return this.seek(this.last);
    this.index = indexAt(this.instants, this.time);
    this.notify();
    requestAnimationFrame((next) => this.frame(next));
  }

  notify() {
    for (const callback of this.callbacks) callback(this);
  }
}

/** Index of the last of some increasing times that is not after a time, or 0. */
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
