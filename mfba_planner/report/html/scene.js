// SPDX-License-Identifier: Apache-2.0
// The world of one run, drawn to scale as SVG in metres. SVG's y points down, so y changes its sign.

const AHEAD = 2; // s: an arrow shows the motion over this time
const BEHIND = 4; // s: an obstacle's trail shows its motion over this time
const STAR = starPoints(9, 3.8);

class Scene {
  constructor(run) {
    this.run = run;
    const { world } = run;
    this.times = world.times ?? run.ticks.time; // of the obstacles
    const [left, bottom, right, top] = world.view;
    this.width = right - left;
    this.element = svg("svg", {
      class: "scene",
      viewBox: `${left} ${-top} ${this.width} ${top - bottom}`,
      role: "img",
      "aria-label": `${run.title}: the world to scale`,
    });
    const grain = this.width / 1500; // m: smallest distance of two points of a line
    this.kept = thinned(run.ticks.x, run.ticks.y, grain);
    this.keptOf = world.obstacles.map(({ x, y }) => thinned(x, y, grain));
    this.fixed = []; // [element, x, y]: elements with a constant size in pixels
    this.drawGround(world);
    this.drawObstacles(world);
    this.drawSensors();
    this.drawPath();
    this.drawEnds(world);
    this.drawRobot(world);
    this.pixel = this.width / 600; // metres
    new ResizeObserver(() => this.measure()).observe(this.element);
  }

  add(tag, attributes, ...children) {
    const element = svg(tag, attributes, ...children);
    this.element.append(element);
    return element;
  }

  /** The grid with a round spacing, its numbers, and the walls of both kinds. */
  drawGround(world) {
    const [left, bottom, right, top] = world.view;
    const step = roundStep(Math.max(right - left, top - bottom) / 8);
    const lines = [];
    for (let x = Math.ceil(left / step) * step; x <= right; x += step) {
      lines.push(`M${x} ${-top}V${-bottom}`);
      const fits = x + 0.06 * this.width < right;
      const looks = fits ? { dx: 3 } : { dx: -3, "text-anchor": "end" };
      this.label(String(round(x)), x, bottom, { class: "axis", dy: -4, ...looks });
    }
    for (let y = Math.ceil(bottom / step) * step; y <= top; y += step) {
      lines.push(`M${left} ${-y}H${right}`);
      const unit = y + step > top ? " m" : "";
      const dy = y + 0.03 * this.width < top ? -4 : 13; // below its line if it would be cut off above
      this.label(`${round(y)}${unit}`, left, y, { class: "axis", dx: 3, dy });
    }
    this.element.prepend(svg("path", { class: "grid", d: lines.join("") }));
    const walls = world.segments.map(([x0, y0, x1, y1]) => `M${x0} ${-y0}L${x1} ${-y1}`);
    if (walls.length) this.add("path", { class: "segments", d: walls.join("") });
    this.map = this.add("path", { class: "map" });
    this.mapTicks = this.run.maps.map(({ tick }) => tick);
    this.returns = this.add("path", { class: "returns" });
    this.tracks = this.add("g", { class: "tracks" });
    this.perceivedTicks = this.run.perceived.map(({ tick }) => tick);
    if (!world.walls) return;
    const [x0, y0, x1, y1] = world.walls;
    this.add("rect", { class: "wall", x: x0, y: -y1, width: x1 - x0, height: y1 - y0 });
  }

  label(text, x, y, attributes) {
    const element = svg("text", attributes, text);
    this.keepSize(x, y, element);
    return element;
  }

  /** Put an element drawn in pixels around the origin at (x, y); measure() scales it. */
  keepSize(x, y, element) {
    const group = this.add("g", {}, element);
    this.fixed.push([group, x, y]);
    return group;
  }

  drawObstacles(world) {
    this.trails = world.obstacles.map(() => this.add("path", { class: "trail" }));
    const robots = new Set(DATA.runs.map(({ name }) => name));
    this.obstacles = world.obstacles.map((obstacle) => {
      const { name } = obstacle;
      const isOther = DATA.fleet && robots.has(name);
      const group = this.add(
        "g",
        { class: isOther ? "obstacle other" : "obstacle", "data-name": name },
        svg("circle", { class: "enlarged", r: obstacle.radius + world.robot_radius }),
        svg("circle", { class: "body", r: obstacle.radius }),
        svg("path", { class: "motion" }),
      );
      const number = svg("text", { class: "number" }, name);
      const sized = svg("g", {}, number);
      group.append(sized);
      this.fixed.push([sized, 0, 0]);
      return { group, motion: group.querySelector(".motion") };
    });
  }

  /** Call act with the name of another robot of the fleet when that is pressed. */
  onPress(act) {
    this.element.addEventListener("click", ({ target }) => {
      const other = target.closest(".other");
      if (other) act(other.dataset.name);
    });
  }

  /** The ring around the robot: sectors (or headings) and gaps. */
  drawSensors() {
    const { wedges, reach, gap_headings: headings } = this.run;
    this.sensors = this.add("g", { class: "sensors" });
    this.sectors = wedges.map(([from, to]) => {
      const [[x0, y0], [x1, y1]] = [polar(reach, from), polar(reach, to)];
      const wedge = `M0 0L${x0} ${y0}A${reach} ${reach} 0 0 0 ${x1} ${y1}Z`;
      return svg("path", { class: "sector", d: wedge });
    });
    this.gaps = headings.map((heading) => {
      const [x, y] = polar(reach, heading);
      return svg("path", { class: "gap", d: `M${0.86 * x} ${0.86 * y}L${x} ${y}` });
    });
    this.chosenGap = svg("path", { class: "chosen-gap" });
    const ring = svg("circle", { class: "ring", r: reach });
    this.sensors.append(...this.sectors, ring, ...this.gaps, this.chosenGap);
  }

  /** The whole path, faint, and on top the path so far, coloured by mode. */
  drawPath() {
    const { x, y, mode } = this.run.ticks;
    this.add("path", { class: "whole-path", d: line(x, y, this.kept, 0, x.length - 1) });
    this.stretches = [];
    for (let first = 0, k = 1; k <= mode.length; k++) {
      if (k < mode.length && mode[k] === mode[first]) continue;
      const { key } = DATA.modes[mode[first]];
      const element = this.add("path", { class: "past", "data-mode": key });
      this.stretches.push({ first, end: Math.min(k, mode.length - 1), element });
      first = k;
    }
  }

  drawEnds(world) {
    this.keepSize(...world.start, svg("circle", { class: "start", r: 5 }));
    this.keepSize(...world.goal, svg("polygon", { class: "goal", points: STAR }));
  }

  drawRobot(world) {
    this.bats = this.add("g", { class: "bats" });
    this.velocity = this.add("path", { class: "velocity" });
    const circles = world.footprint.length ? world.footprint : [[0, 0, world.robot_radius]];
    this.robot = this.add(
      "g",
      { class: "robot" },
      ...circles.map(([x, y, r]) => svg("circle", { class: "outline", cx: x, cy: -y, r })),
      svg("circle", { class: "center", r: 0.16 * world.robot_radius }),
    );
    this.waypoint = this.add("g", {}, svg("path", { class: "waypoint", d: "M0-5L5 0L0 5L-5 0Z" }));
  }

  /** Measure a pixel (m) and scale texts and marks with it. */
  measure() {
    const scale = this.element.getScreenCTM();
    if (!scale || !scale.a) return;
    this.pixel = 1 / scale.a;
    for (const [element, x, y] of this.fixed) {
      set(element, { transform: `translate(${x} ${-y}) scale(${this.pixel})` });
    }
    if (this.shown) this.show(...this.shown);
  }

  /** Show tick k, with positions interpolated by a fraction (0 to 1) from times[now] to the next. */
  show(k, now, fraction) {
    const { ticks, world } = this.run;
    const isNew = !this.shown || this.shown[0] !== k || this.drawn !== this.pixel;
    this.shown = [k, now, fraction];
    this.drawn = this.pixel;
    const at = (values, from) =>
      between(values[from], values[Math.min(from + 1, values.length - 1)], fraction);
    const x = at(ticks.x, k);
    const y = at(ticks.y, k);
    this.moveTo(this.robot, x, y, world.footprint.length ? at(ticks.yaw, k) : 0);
    // Sectors, gaps and waypoint are those of the tick: they are not interpolated.
    if (isNew) this.showDecision(k);
    this.moveTo(this.sensors, x, y);
    world.obstacles.forEach((obstacle, i) => this.showObstacle(i, obstacle, k, now, at));
    for (const { first, end, element } of this.stretches) {
      const until = Math.min(k, end);
      const tip = until === k && k < end && x !== null ? `L${x} ${-y}` : "";
      set(element, { d: first > k ? "" : line(ticks.x, ticks.y, this.kept, first, until) + tip });
    }
  }

  moveTo(element, x, y, yaw = 0) {
    const hidden = x === null || y === null;
    const turned = yaw ? ` rotate(${(-180 / Math.PI) * yaw})` : "";
    set(element, {
      transform: hidden ? null : `translate(${x} ${-y})${turned}`,
      visibility: hidden ? "hidden" : null,
    });
  }

  showObstacle(i, obstacle, k, now, at) {
    const { group, motion } = this.obstacles[i];
    const x = at(obstacle.x, now);
    const y = at(obstacle.y, now);
    this.moveTo(group, x, y);
    const first = indexAt(this.times, this.times[now] - BEHIND);
    const trail = line(obstacle.x, obstacle.y, this.keptOf[i], first, now);
    set(this.trails[i], { d: x === null ? "" : `${trail}L${x} ${-y}` }); // null: it is absent
    const [vx, vy] = [obstacle.vx[now], obstacle.vy[now]];
    const edge = obstacle.radius / (Math.hypot(vx, vy) || 1);
    set(motion, { d: this.arrow(edge * vx, edge * vy, AHEAD * vx, AHEAD * vy) });
    group.classList.toggle("near", this.run.ticks.near[k].includes(i + 1));
  }

  showDecision(k) {
    const { ticks } = this.run;
    this.showMap(k);
    this.showPerceived(k);
    const mode = DATA.modes[ticks.mode[k]].key;
    set(this.element, { "data-mode": mode, "data-tick": k });
    const isAnySet = ticks.vs[k].includes("1");
    this.sectors.forEach((sector, i) => sector.classList.toggle("set", ticks.vs[k][i] === "1"));
    this.gaps.forEach((gap, i) => {
      gap.classList.toggle("open", isAnySet && ticks.vg[k][i] === "0");
      gap.classList.toggle("closed", isAnySet && ticks.vg[k][i] === "1");
    });
    const chosen = ticks.gap[k];
    const ray = chosen ? polar(this.run.reach, this.run.gap_headings[chosen - 1]) : null;
    set(this.chosenGap, { d: ray ? `M0 0L${ray[0]} ${ray[1]}` : "" });
    const [x, y] = [ticks.x[k], ticks.y[k]];
    const [wx, wy] = [ticks.waypoint_x[k], ticks.waypoint_y[k]];
    const moves = x !== null && wx !== null && (wx !== x || wy !== y);
    set(this.velocity, { d: moves ? this.arrow(x, y, AHEAD * ticks.vx[k], AHEAD * ticks.vy[k]) : "" });
    set(this.waypoint, {
      transform: moves ? `translate(${wx} ${-wy}) scale(${this.pixel})` : null,
      visibility: moves ? null : "hidden",
    });
    const r = 2.2 * this.pixel;
    const bats = [];
    for (let i = 0; i < ticks.bats[k].length; i += 2) {
      bats.push(svg("circle", { cx: ticks.bats[k][i], cy: -ticks.bats[k][i + 1], r }));
    }
    this.bats.replaceChildren(...bats);
  }

  /** The last local map until tick k: a dot for each occupied cell. */
  showMap(k) {
    const number = k < this.mapTicks[0] ? -1 : indexAt(this.mapTicks, k);
    if (this.mapShown === number) return;
    this.mapShown = number;
    showDots(this.map, this.run.maps[number]?.points ?? []);
  }

  /** The returns of the last scan until tick k, and the tracks then, with an arrow if they move. */
  showPerceived(k) {
    const number = k < this.perceivedTicks[0] ? -1 : indexAt(this.perceivedTicks, k);
    if (this.perceivedShown === number) return;
    this.perceivedShown = number;
    const { points, tracks } = this.run.perceived[number] ?? { points: [], tracks: [] };
    showDots(this.returns, points);
    this.tracks.replaceChildren(
      ...tracks.flatMap(([x, y, r, vx, vy]) => {
        const kind = vx || vy ? "track moving" : "track";
        const circle = svg("circle", { class: kind, cx: x, cy: -y, r });
        const arrow = this.arrow(x, y, AHEAD * vx, AHEAD * vy);
        return arrow ? [circle, svg("path", { class: kind, d: arrow })] : [circle];
      }),
    );
  }

  /** A line with a head of seven pixels, from (x, y) along (dx, dy). */
  arrow(x, y, dx, dy) {
    const length = Math.hypot(dx, dy);
    const head = 7 * this.pixel;
    if (!(length > head)) return "";
    const [ux, uy] = [dx / length, dy / length];
    const [tx, ty] = [x + dx, y + dy];
    const wing = (side) => {
      const [wx, wy] = [tx - head * (ux + side * 0.5 * uy), ty - head * (uy - side * 0.5 * ux)];
      return `M${tx} ${-ty}L${wx} ${-wy}`;
    };
    return `M${x} ${-y}L${tx} ${-ty}${wing(1)}${wing(-1)}`;
  }
}

/** A dot for each point; points are in cm, as differences. */
function showDots(element, points) {
  const dots = [];
  for (let i = 0, x = 0, y = 0; i < points.length; i += 2) {
    x += points[i];
    y += points[i + 1];
    dots.push(`M${x / 100} ${-y / 100}h0`);
  }
  set(element, { d: dots.join(""), "data-points": dots.length });
}

function between(a, b, fraction) {
  return a === null || b === null ? a : a + fraction * (b - a);
}

/** The point at radius and angle, in drawing coordinates (y points down). */
function polar(radius, angle) {
  return [radius * Math.cos(angle), -radius * Math.sin(angle)];
}

/** Indices of the points that a line needs: known ones, at least a grain (m) apart. */
function thinned(x, y, grain) {
  const kept = [];
  let [ax, ay] = [Infinity, Infinity];
  x.forEach((px, k) => {
    if (px === null || y[k] === null) return;
    if ((px - ax) ** 2 + (y[k] - ay) ** 2 < grain ** 2) return;
    [ax, ay] = [px, y[k]];
    kept.push(k);
  });
  return kept;
}

/** An SVG path from point first to point last through the kept points between. */
function line(x, y, kept, first, last) {
  const commands = [];
  const add = (k) => {
    if (x[k] !== null && y[k] !== null) commands.push(`${commands.length ? "L" : "M"}${x[k]} ${-y[k]}`);
  };
  add(first);
  for (let i = indexAt(kept, first); i < kept.length && kept[i] < last; i++) {
    if (kept[i] > first) add(kept[i]);
  }
  if (last > first) add(last);
  return commands.join("");
}

function roundStep(rough) {
  const power = 10 ** Math.floor(Math.log10(rough));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= rough);
}

function round(value) {
  return Number(value.toPrecision(6));
}

function starPoints(outer, inner) {
  const points = [];
  for (let i = 0; i < 10; i++) {
    const angle = (Math.PI * i) / 5 - Math.PI / 2;
    const radius = i % 2 ? inner : outer;
    points.push(`${(radius * Math.cos(angle)).toFixed(2)},${(radius * Math.sin(angle)).toFixed(2)}`);
  }
  return points.join(" ");
}
