// SPDX-License-Identifier: Apache-2.0
// The tables of result, configuration and digest, with a column per run.

function resultTable(runs) {
  const rows = runs[0].result.map(([name], i) => [name, runs.map((run) => run.result[i])]);
  const body = rows.map(([name, cells]) =>
    html(
      "tr",
      {},
      html("th", { scope: "row" }, name),
      ...cells.map(([, value, remark], i) => resultCell(name, value, remark, runs[i])),
    ),
  );
  return table("Result", runs, body);
}

function resultCell(name, value, remark, run) {
  const judged = name === "outcome" ? (run.success ? "good" : "bad") : null;
  const cell = html("td", {}, html("span", { class: judged ? `judged ${judged}` : null }, value));
  if (remark) cell.append(html("small", {}, remark));
  return cell;
}

/** Every option; with several runs those that differ come first. */
function configurationTable(runs) {
  const names = runs[0].configuration.map(([name]) => name);
  const rows = names.map((name, i) => {
    const values = runs.map((run) => run.configuration[i]);
    const differs = values.some(([, value]) => value !== values[0][1]);
    return { name, values, differs };
  });
  rows.sort((a, b) => Number(b.differs) - Number(a.differs));
  const body = rows.map(({ name, values, differs }) =>
    html(
      "tr",
      { class: differs ? "differs" : null },
      html("th", { scope: "row" }, name),
      ...values.map(([, value, unit, isDefault]) =>
        html("td", { class: isDefault ? null : "changed" }, unit ? `${value} ${unit}` : value),
      ),
    ),
  );
  const changed = rows.filter(({ values }) => values.some(([, , , isDefault]) => !isDefault));
  const differing = rows.filter(({ differs }) => differs).length;
  const remarks = [`${changed.length} of ${rows.length} not at their default`];
  if (runs.length > 1) remarks.push(`${differing} not the same in all runs`);
  return html(
    "details",
    {},
    html("summary", {}, html("h2", {}, "Configuration"), html("span", {}, remarks.join(", "))),
    table("Configuration", runs, body),
  );
}

function digestTable(runs) {
  const body = runs.map((run, i) =>
    html(
      "tr",
      {},
      html("th", { scope: "row" }, runName(run, i)),
      html("td", { class: "digest" }, run.digest),
    ),
  );
  return html("table", { class: "digests" }, html("tbody", {}, ...body));
}

function table(caption, runs, body) {
  const heads = runs.map((run, i) => html("th", { scope: "col" }, runName(run, i)));
  const head = html("thead", {}, html("tr", {}, html("td"), ...heads));
  const children = [html("caption", { class: "visually-hidden" }, caption)];
  if (runs.length > 1) children.push(head);
  children.push(html("tbody", {}, ...body));
  // A wide table scrolls inside its own box; tabindex lets the keyboard scroll it.
  return html(
    "div",
    { class: "scroll", tabindex: "0", role: "region", "aria-label": caption },
    html("table", {}, ...children),
  );
}

/** The name of a run in its colour. */
function runName(run, number) {
  const [color] = DATA.looks[number];
  return html("span", { class: "run", "data-run": number + 1, style: `--c: var(--run-${color})` }, run.name);
}
