# SPDX-License-Identifier: Apache-2.0
"""The generated text of docs/benchmark.md: targets first, then every table."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from importlib.metadata import version
from statistics import median

from benchmark_costs import NAMES, Costs
from benchmark_pictures import Example
from benchmark_runs import (
    CROWDS,
    DIFFERENTIAL,
    DWA,
    INGREDIENTS,
    LEAD,
    ORCA,
    PAPER,
    PAPER_KNOWN,
    PEERS,
    PERCEPTIONS,
    PREDICTIVE,
    PREDICTIVE_KNOWN,
    PREDICTIVE_REALISTIC,
    STRIPPED,
    Counts,
    Entry,
    Results,
)

from mfba_planner.evaluation.statistics import Interval
from mfba_planner.evaluation.suites import suite as suite_of
from mfba_planner.evaluation.sweep.summary import PlannerSummary
from mfba_planner.evaluation.sweep.table import sorted_hash
from mfba_planner.report.sweep_tables import (
    NOTE,
    VERSUS_NOTE,
    markdown,
    percent,
    summary_table,
    versus_table,
)

# Least success in certified worlds.
SUCCESS: dict[Entry, dict[str, float]] = {
    PREDICTIVE: {
        "random-10": 0.999, "random-20": 0.999, "random-30": 0.995, "adversarial": 0.99,
        "fast-10": 0.97, "fast-20": 0.97,
    },
    DIFFERENTIAL: {"random-10": 0.995, "random-20": 0.995, "random-30": 0.99},
    PREDICTIVE_REALISTIC: {"random-10": 0.98, "random-20": 0.98, "random-30": 0.98},
    PREDICTIVE_KNOWN: {
        "random-10": 0.999, "random-20": 0.999, "random-30": 0.995, "adversarial": 0.99,
    },
}  # fmt: skip
# Largest mean gap.
GAP: dict[Entry, dict[str, float]] = {
    PREDICTIVE: {"random-10": 0.012, "random-20": 0.03, "random-30": 0.05},
    PREDICTIVE_KNOWN: {"random-10": 0.007, "random-20": 0.018, "random-30": 0.033},
}
CASE_GAP = {1: 0.005, 2: 0.01}
PER_MINUTE = {PAPER_KNOWN: 10_000, PREDICTIVE_KNOWN: 3000}
DECISION_US, SLOPE = 300.0, 1.0

ROWS_NOTE = (
    "A planner's name alone: from 360 beams of 3.5 m. realistic: from these on a differential "
    "drive, with ranges off by 2 cm, odometry by 2 cm and 0.02 rad (standard deviations), scans "
    "0.1 s old. known: told the truth within SR, and `paper` its exact twelve bits. "
    "`straight` senses nothing."
)

Lines = Iterator[Sequence[str]]


def render(
    results: Results,
    suites: Sequence[str],
    counts: Counts,
    costs: Costs,
    rates: Mapping[str, Sequence[float]],
    examples: Sequence[Example],
    command: str,
) -> str:
    """Everything between the marks."""
    blocks = [_facts(results, suites, counts, command), "## Targets"]
    targets = [*_targets(results, suites, counts), *_cost_targets(results.workers, costs, rates)]
    blocks.append(markdown(("what", "target", "found", ""), targets))
    missed = [f"{line[0]}: {line[2]}" for line in targets if line[3].startswith("**missed")]
    blocks.append(f"Missed: {'; '.join(missed)}." if missed else "None is missed.")
    blocks += ["## Suites", NOTE + ". " + ROWS_NOTE]
    blocks += ["![success and gap](images/benchmark.png)"]
    for suite in suites:
        blocks += [f"### {suite}", _suite(results, suite, counts)]
    blocks += ["## predictive beside ORCA, DWA and the paper's", VERSUS_NOTE + "."]
    blocks += [_pairs(results, suites, counts, timed=False)]
    blocks += ["The same with time instead of length, so that waiting counts:"]
    blocks += [_pairs(results, suites, counts, timed=True)]
    for one in examples:
        blocks += [
            f"{one.words}:\n\n```sh\n{one.command}\n```",
            f"![{one.words}](images/{one.file})",
        ]
    for title, entries, where, worlds in (
        ("What predictive sees", PERCEPTIONS, CROWDS, counts.perceived),
        ("What each ingredient buys, circles known", INGREDIENTS, STRIPPED, counts.rest),
    ):
        found = [
            _named(suite, results.standing(suite, entry, worlds(suite)))
            for suite in suites
            if suite in where
            for entry in entries
        ]
        if found:
            blocks += [f"## {title}", summary_table(found)]
    if any(suite in STRIPPED for suite in suites):
        blocks.append("![ablation](images/benchmark-ablation.png)")
    blocks += ["## What a decision costs", _costs(costs)]
    blocks += ["![decision time](images/benchmark-cost.png)"]
    return "\n\n".join(block for block in blocks if block) + "\n"


def _pairs(results: Results, suites: Sequence[str], counts: Counts, *, timed: bool) -> str:
    return versus_table(
        [
            replace(found, planner=f"{suite}: predictive")
            for suite in suites
            for other in (ORCA, DWA, PAPER)
            for found in [
                results.versus(suite, PREDICTIVE, other, counts.lead(suite), timed=timed)
            ]
        ]
    )


def _facts(results: Results, suites: Sequence[str], counts: Counts, command: str) -> str:
    versions = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "pyrvo"))
    lines = [
        f"Made by\n\n```sh\n{command}\n```\n",
        f"- Python {platform.python_version()}, {versions}; {platform.machine()}, "
        f"{os.cpu_count()} cores, which other jobs may have shared: trust ratios of times",
        f"- suite seed 0; N worlds from {results.first} on, seed 0 in each; in `paper` a seed for "
        "each repeat",
    ]
    for suite in suites:
        rows = [r for e in LEAD for r in results.of(0, suite, e, counts.lead(suite))]
        rows += [r for e in PEERS for r in results.of(0, suite, e, counts.rest(suite))]
        lines.append(
            f"- {suite}: {counts.lead(suite)} worlds for {_words(LEAD)}, {counts.rest(suite)} for "
            f"{_words(PEERS)}; robot {suite_of(suite).speed_mps:g} m/s; sorted hash of these "
            f"rows `{sorted_hash(rows)[:16]}`"
        )
    return "\n".join(lines)


def _words(entries: Sequence[Entry]) -> str:
    return ", ".join(dict.fromkeys(entry.planner for entry in entries))


def _named(prefix: str, standing: PlannerSummary) -> PlannerSummary:
    return replace(standing, planner=f"{prefix}: {standing.planner}")


def _suite(results: Results, suite: str, counts: Counts) -> str:
    cases = (1, 2) if suite == "paper" else (0,)
    found = [
        _named(f"case {case}", standing) if case else standing
        for case in cases
        for entries, worlds in ((LEAD, counts.lead(suite)), (PEERS, counts.rest(suite)))
        for entry in entries
        for standing in [results.standing(suite, entry, worlds, case)]
    ]
    return summary_table(found)


def verdict(found: Interval, target: float, *, at_least: bool) -> str:
    """Whether a target is met, and whether by the whole interval."""
    sign = 1.0 if at_least else -1.0
    if sign * (found.middle - target) < 0.0:
        return "**missed**"
    surely = (found.low - target) if at_least else (target - found.high)
    return "met" if surely >= 0.0 else "met, but not by the whole interval"


def _targets(results: Results, suites: Sequence[str], counts: Counts) -> Lines:
    for targets, value, at_least in ((SUCCESS, "certified", True), (GAP, "gap", False)):
        for entry, by_suite in targets.items():
            worlds = counts.perceived if entry is DIFFERENTIAL else counts.lead
            for suite, target in by_suite.items():
                if suite not in suites:
                    continue
                one = results.standing(suite, entry, worlds(suite))
                found: Interval | None = getattr(one, value)
                if at_least and found is None:
                    continue  # the oracle certifies none of the worlds
                name = entry.label if entry is not DIFFERENTIAL else "predictive, differential"
                what = f"{'success, certified' if at_least else 'mean gap,'} {suite}, {name}"
                of = one.certified_runs if at_least else one.runs
                yield _line(what, found, target, at_least=at_least, of=of)
    for case, most in CASE_GAP.items() if "paper" in suites else ():
        one = results.standing("paper", PREDICTIVE, counts.lead("paper"), case)
        free = "met" if not one.collisions else "**missed**"
        yield [f"collisions, case {case}", "0", f"{one.collisions} of {one.runs}", free]
        yield _line(f"mean gap, case {case}", one.gap, most, at_least=False, of=one.runs)


def _line(
    what: str, found: Interval | None, target: float, *, at_least: bool, of: int
) -> Sequence[str]:
    sign = ">=" if at_least else "<="
    measured = "-" if found is None else f"{percent(found)} of {of}"
    judged = "**missed**" if found is None else verdict(found, target, at_least=at_least)
    return [what, f"{sign} {100.0 * target:g} %", measured, judged]


def _cost_targets(workers: int, costs: Costs, rates: Mapping[str, Sequence[float]]) -> Lines:
    for entry, least in PER_MINUTE.items():
        taken = rates[entry.label]
        found = median(taken)
        yield [
            f"episodes per minute, {entry.label}, random-10, workers: {workers}",
            f">= {least}",
            f"{found:.0f} ({min(taken):.0f} to {max(taken):.0f} in {len(taken)} sweeps)",
            "met" if found >= least else "**missed**",
        ]
    for what, found, most in (
        (
            "median us of a predictive decision, 10 in range, again and again",
            costs.repeated_us,
            DECISION_US,
        ),
        ("the same in turn with the other planners", costs.at("predictive", 10), DECISION_US),
        ("exponent of its growth, 10 to 1000 in range", costs.slope("predictive"), SLOPE),
    ):
        measured = f"{found:.3g}" if found < 100.0 else f"{found:.0f}"
        yield [what, f"<= {most:g}", measured, "met" if found <= most else "**missed**"]


def _costs(costs: Costs) -> str:
    lines = [
        [
            str(count),
            *(f"{costs.at(name, count):.0f}" for name in NAMES),
            *(f"{costs.at('predictive', count) / costs.at(n, count):.2f}" for n in NAMES[1:]),
        ]
        for count in costs.counts
    ]
    head = ["in range", *(f"{n}, us" for n in NAMES), *(f"predictive / {n}" for n in NAMES[1:])]
    slopes = ", ".join(f"{name} {costs.slope(name):.2f}" for name in NAMES)
    return (
        "Medians of CPU time (one thread), all planners in turn among the same circles (evenly "
        "over the sensing region, which grows with their number beyond 10), "
        f"{costs.rounds} rounds at 10 and fewer where more are in range. With nothing in between, "
        f"`predictive` takes {costs.repeated_us:.0f} us with 10 in range. "
        f"Growth as count^s from 10 on: s = {slopes}. `orca` is pyrvo asked "
        "`ROUNDS` times per decision; `dwa` is ours, all velocities at once in numpy, and step by "
        "step it simulates one velocity after the other, as PythonRobotics' tutorial goes about "
        f"it.\n\n{markdown(head, lines)}"
    )
