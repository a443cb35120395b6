# SPDX-License-Identifier: Apache-2.0
"""The benchmark's figures as one small file, docs/benchmark.json, and the README's table of it.

The sweeps themselves are too large to keep in the project.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from benchmark_runs import (
    DWA,
    LEAD,
    ORCA,
    PAPER,
    PEERS,
    PREDICTIVE,
    PREDICTIVE_KNOWN,
    PREDICTIVE_REALISTIC,
    Counts,
    Results,
)

from mfba_planner.evaluation.statistics import Interval
from mfba_planner.evaluation.suites import suite as suite_of
from mfba_planner.evaluation.sweep.summary import PlannerSummary
from mfba_planner.report.sweep_tables import markdown

FILE = "benchmark.json"
README_BEGIN = "<!-- bench/benchmark.py: begin -->\n"
README_END = "<!-- bench/benchmark.py: end -->\n"
# The README's rows, and its columns.
ROWS = {
    "random-10": "10 obstacles of 0.1 to 0.3 m/s",
    "random-20": "20 obstacles",
    "random-30": "30 obstacles",
    "fast-10": "10 of 0.5 to 2 m/s, robot 1 m/s",
    "fast-20": "20 of 0.5 to 2 m/s, robot 1 m/s",
    "dynabarn-like": "discs of 0.5 m, on average 0.74 to 1.72 m/s, robot 1 m/s",
    "pedestrians": "pedestrians (social forces), robot 1 m/s",
}
README_ENTRIES = (PAPER, DWA, ORCA, PREDICTIVE, PREDICTIVE_REALISTIC, PREDICTIVE_KNOWN)

Facts = Mapping[str, Any]


def facts(results: Results, suites: Sequence[str], counts: Counts, command: str) -> Facts:
    """Figures of every row of every suite (of the paper's suite: of both cases together)."""
    return {
        "command": command,
        "first": results.first,
        "suites": {
            suite: {
                "speed_mps": suite_of(suite).speed_mps,
                "planners": {
                    entry.label: _figures(results.standing(suite, entry, worlds(suite)))
                    for entries, worlds in ((LEAD, counts.lead), (PEERS, counts.rest))
                    for entry in entries
                },
            }
            for suite in suites
        },
    }


def _figures(standing: PlannerSummary) -> dict[str, Any]:
    return {
        "runs": standing.runs,
        "success": _rounded(standing.success),
        "certified_runs": standing.certified_runs,
        "certified": _rounded(standing.certified),
        "collided": standing.collisions,
        "gap": _rounded(standing.gap),
    }


def _rounded(interval: Interval | None) -> list[float] | None:
    """Middle and both ends, to a thousandth of a per cent."""
    if interval is None:
        return None
    return [round(value, 5) for value in (interval.middle, interval.low, interval.high)]


def to_json(found: Facts) -> str:
    """The text of the file, a line for each planner of each suite."""
    suites = []
    for name, suite in found["suites"].items():
        planners = ",\n".join(
            f"    {json.dumps(label)}: {json.dumps(figures)}"
            for label, figures in suite["planners"].items()
        )
        speed = json.dumps(suite["speed_mps"])
        suites.append(
            f'  {json.dumps(name)}: {{"speed_mps": {speed}, "planners": {{\n{planners}\n  }}}}'
        )
    body = ",\n".join(suites)
    command, first = json.dumps(found["command"]), json.dumps(found["first"])
    return f'{{"command": {command}, "first": {first}, "suites": {{\n{body}\n}}}}\n'


def readme_table(found: Facts) -> str:
    """The table between the marks of the README: success in certified worlds, and the gap."""
    head = ["worlds", *(f"`{e.planner}`{e.label.removeprefix(e.planner)}" for e in README_ENTRIES)]
    rows = [
        [f"{found['suites'][suite]['planners'][PREDICTIVE.label]['certified_runs']} x {words}"]
        + [_cell(found["suites"][suite]["planners"][entry.label]) for entry in README_ENTRIES]
        for suite, words in ROWS.items()
        if suite in found["suites"]
    ]
    return markdown(head, rows) + "\n"


def _cell(figures: Mapping[str, Any]) -> str:
    if figures["certified"] is None:
        return "-"
    success = f"{100.0 * figures['certified'][0]:.4g} %"
    return success if figures["gap"] is None else f"{success}, {100.0 * figures['gap'][0]:.2f} %"


def with_table(readme: str, found: Facts) -> str:
    """The README with its table replaced; unchanged without the marks."""
    before, begin, rest = readme.partition(README_BEGIN)
    _, end, after = rest.partition(README_END)
    if not (begin and end):
        return readme
    return before + begin + readme_table(found) + end + after
