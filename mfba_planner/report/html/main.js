// SPDX-License-Identifier: Apache-2.0
// Build the page, and update all of it when the clock changes.

const { runs } = DATA;
const root = document.documentElement;
const clock = new Clock(runs);
const reducedMotion = matchMedia("(prefers-reduced-motion: reduce)");
const views = runs.map((run) => ({ run, scene: new Scene(run), readout: new Readout(run) }));
const charts = new Charts(DATA.charts, clock);
const transport = new Transport(runs, clock, () =>
  visibleViews().map(({ run, readout }) => readout.sentence(tickOf(run))).join("; "),
);
let chosen = 0; // in a fleet: number of the robot that is shown

/** Of a fleet the scene of the chosen robot; otherwise all runs, side by side. */
function visibleViews() {
  return DATA.fleet ? [views[chosen]] : views;
}

function tickOf(run) {
  return indexAt(run.ticks.time, clock.time);
}

function show() {
  for (const { run, scene, readout } of visibleViews()) {
    const { times } = scene;
    const k = tickOf(run);
    const now = indexAt(times, clock.time);
    const span = now + 1 < times.length ? times[now + 1] - times[now] : 0;
    const fraction = span > 0 && !reducedMotion.matches ? (clock.time - times[now]) / span : 0;
    scene.show(k, now, Math.max(0, Math.min(1, fraction)));
    readout.show(k);
  }
  transport.show();
  charts.show();
}

function card({ run, scene, readout }, number) {
  const verdict = html("span", { class: `verdict ${run.success ? "good" : "bad"}` }, run.outcome);
  return html(
    "article",
    { class: "card", "data-run": number + 1 },
    html("header", {}, html("h2", {}, runName(run, number)), verdict, html("p", {}, run.title)),
    html("div", { class: "stage" }, scene.element),
    readout.element,
  );
}

/** Choose the robot of a fleet: from this list, or by pressing another robot in the scene. */
function robotChoice() {
  const select = html(
    "select",
    { id: "robot", "aria-label": "Robot" },
    ...runs.map(({ name }, number) => html("option", { value: number }, name)),
  );
  const choose = (number) => {
    chosen = number;
    select.value = number;
    document.querySelectorAll(".card").forEach((element, i) => {
      element.hidden = i !== number;
    });
    charts.choose(number);
    show();
  };
  select.addEventListener("change", () => choose(Number(select.value)));
  for (const { scene } of views) {
    scene.onPress((name) => choose(runs.findIndex((run) => run.name === name)));
  }
  return { element: html("label", {}, "Robot ", select), choose };
}

function legend() {
  const shown = new Set(runs.flatMap((run) => run.ticks.mode));
  const items = DATA.modes
    .filter((_, number) => shown.has(number))
    .map(({ key, label }) => entry(label, svg("path", { d: "M1 8H21", class: "past", "data-mode": key })));
  items.push(
    entry("obstacle, and its edge enlarged by the robot",
      svg("circle", { cx: 11, cy: 8, r: 7, class: "enlarged" }),
      svg("circle", { cx: 11, cy: 8, r: 4, class: "body" })),
    entry(`its motion in ${AHEAD} s`, svg("path", { d: "M1 8H20M14 4L20 8L14 12", class: "motion" })),
    ...(runs.some((run) => run.maps.length)
      ? [entry("local map: what stands, as seen", svg("path", { d: "M3 8h0M8 8h0M13 8h0M18 8h0", class: "map" }))]
      : []),
    ...(runs.some((run) => run.perceived.length)
      ? [
          entry("returns of the lidar", svg("path", { d: "M3 8h0M8 8h0M13 8h0M18 8h0", class: "returns" })),
          entry(`tracked obstacle; moving: in ${AHEAD} s`,
            svg("circle", { cx: 6, cy: 8, r: 5, class: "track" }),
            svg("circle", { cx: 16, cy: 8, r: 5, class: "track moving" })),
        ]
      : []),
    entry("sensing range, sector or heading that is set",
      svg("path", { d: "M2 14A18 18 0 0 1 20 14L11 2Z", class: "sector set" }),
      svg("path", { d: "M1 14A18 18 0 0 1 21 14", class: "ring" })),
    entry("gap: open, closed, chosen",
      svg("path", { d: "M3 3V13", class: "gap open" }),
      svg("path", { d: "M11 3V13", class: "gap closed" }),
      svg("path", { d: "M19 1V15", class: "chosen-gap" })),
    entry("bats, and the chosen waypoint",
      svg("g", { class: "bats" }, svg("circle", { cx: 4, cy: 5, r: 2 }), svg("circle", { cx: 7, cy: 12, r: 2 })),
      svg("path", { d: "M16 3L21 8L16 13L11 8Z", class: "waypoint" })),
  );
  return html("ul", { class: "legend", "aria-label": "Legend" }, ...items);
}

/** The legend of the charts, if there are several runs. */
function chartKey() {
  if (runs.length === 1) return [];
  const entries = runs.map((run, number) => {
    const [color, lengths] = DATA.looks[number];
    const dashes = lengths.map((length) => 2 * length).join(" ") || "none";
    const style = `stroke: var(--run-${color}); stroke-width: 2; stroke-dasharray: ${dashes}`;
    return entry(run.name, svg("path", { d: "M-6 8H28", style }));
  });
  return [html("ul", { class: "legend key", "aria-label": "Runs in the charts" }, ...entries)];
}

function entry(text, ...shapes) {
  return html("li", {}, svg("svg", { viewBox: "0 0 22 16", "aria-hidden": "true" }, ...shapes), text);
}

function themeButton() {
  const element = html("button", { type: "button", id: "theme" });
  const use = (theme) => {
    root.dataset.theme = theme;
    element.textContent = theme === "dark" ? "Light" : "Dark";
    set(element, { "aria-label": `Switch to the ${theme === "dark" ? "light" : "dark"} theme` });
  };
  const system = matchMedia("(prefers-color-scheme: dark)");
  system.addEventListener("change", () => use(system.matches ? "dark" : "light"));
  element.addEventListener("click", () => use(root.dataset.theme === "dark" ? "light" : "dark"));
  use(system.matches ? "dark" : "light");
  return element;
}

const choice = DATA.fleet ? robotChoice() : null;
const about = [...new Set(runs.map((run) => run.world.description))].filter(Boolean).join("; ");
document.getElementById("app").append(
  html("header", { class: "top" }, html("div", {}, html("h1", {}, DATA.worlds), html("p", {}, about)),
    html("div", { class: "choices" }, ...(choice ? [choice.element] : []), themeButton())),
  html(
    "main",
    {},
    html("section", { class: "runs", "aria-label": "Runs" }, ...views.map(card)),
    ...(runs.length > 1 ? [legend()] : []),
    html("section", { "aria-label": "Charts", class: "panel" }, ...chartKey(), charts.element),
    html("section", { class: "panel" }, html("h2", {}, "Result"), resultTable(runs)),
    html("section", { class: "panel" }, configurationTable(runs)),
    html("section", { class: "panel" }, html("h2", {}, "Decision digest"), digestTable(runs)),
  ),
  transport.element,
  html("footer", {},
    html("p", { class: "keys" }, "Keys: space plays and pauses; ← → move by one tick, with shift by ten; Home and End; + and − change the speed."),
    html("p", {}, `mfba_planner ${DATA.version}`)),
);
root.dataset.runs = runs.length;
root.dataset.count = visibleViews().length;
root.style.setProperty("--rows", Math.min(runs.length, 6));
if (runs.length === 1) views[0].readout.element.append(legend());
clock.callbacks.push(show);
if (choice) choice.choose(0);
show();
charts.fit();
performance.mark("mfba-ready");
root.dataset.ready = "yes";
