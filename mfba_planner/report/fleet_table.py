# SPDX-License-Identifier: Apache-2.0
"""A fleet's result as text: a row per robot, and the reason why the run is no success."""

from __future__ import annotations

from collections.abc import Sequence

from mfba_planner.evaluation.metrics import Result
from mfba_planner.simulation.episode import Outcome

_HEAD = "{:<12}  outcome       length     time  clearance  collisions  encounters\n"
_ROW = "{:<12}  {:<12}  {:>6.3f} m  {:>5.2f} s  {:>7.3f} m  {:>10}  {:>10}\n"


def fleet_text(names: Sequence[str], results: Sequence[Result]) -> str:
    """A row per robot, and the number of robots at the goal without collision."""
    rows = [
        _ROW.format(
            name, r.outcome.value, r.length_m, r.time_s, r.min_clearance_m, r.collisions,
            len(r.encounters),
        )
        for name, r in zip(names, results, strict=True)
    ]  # fmt: skip
    good = sum(r.success for r in results)
    end = f"{good} of {len(results)} robots at the goal without collision\n"
    return _HEAD.format("robot") + "".join(rows) + end


def why_no_success(results: Sequence[Result]) -> str:
    """Why a fleet's run is no success, as text; empty for a success."""
    hits = sum(r.collisions for r in results)
    late = sum(r.outcome is not Outcome.GOAL_REACHED for r in results)
    faults = [f"{hits} collisions"] if hits else []
    faults += [f"{late} of {len(results)} robots not at the goal"] if late else []
    return f"no success: {', '.join(faults)}; try another --seed or --planner" if faults else ""
