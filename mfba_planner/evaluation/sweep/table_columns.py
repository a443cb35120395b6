# SPDX-License-Identifier: Apache-2.0
"""Columns of the sweep table: type and meaning of each, and the row of a run."""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from ...core.geometry import distance
from ...simulation.episode import Outcome
from ..contacts_and_clearances import RunMotion
from ..metrics import Result, assess
from ..optimality_scores import barn_score, optimality_gap, spl, time_to_goal_s
from .single_run import CompletedRun
from .sweep_spec import Run

Row = dict[str, Any]
FAILED = "failed"

# name: (type, meaning); empty where not applicable, inf for never
_KEY: dict[str, tuple[type, str]] = {
    "suite": (str, "suite of worlds"),
    "world": (int, "number of the world in its suite"),
    "planner": (str, "planner"),
    "seed": (int, "seed of the planner and of sensor noise"),
}
_RUN: dict[str, tuple[type, str]] = {
    "outcome": (str, "goal_reached, time_limit, or failed (a fault of the planner)"),
    "failure": (str, "tick and fault of the planner, empty without a fault"),
    "success": (bool, "goal reached without collision"),
    "length_m": (float, "path length (eq. 1), m"),
    "time_s": (float, "simulated time of the run, s"),
    "time_to_goal_s": (float, "simulated time to the goal, inf if not reached, s"),
    "ticks": (int, "decisions"),
    "collisions": (
        int,
        "contacts, one per obstacle (all walls are one) and unbroken run of ticks",
    ),
    "hits_moving": (int, "of these, robot into obstacle: the robot moved when contact started"),
    "hits_standing": (int, "of these, obstacle into standing robot"),
    "first_contact_with": (int, "obstacle of the first contact, from 1; 0: none, -1: a wall"),
    "first_contact_s": (float, "start of the step in which it occurs, s"),
    "min_clearance_m": (float, "smallest gap between edges, continuous in time, m"),
    "mean_clearance_m": (float, "smallest gap of each step, mean over the steps, m"),
    "min_ttc_s": (float, "smallest time to collision at the velocities of a step, s"),
    "turning_rad": (float, "sum of all turns, rad"),
    "curvature_radpm": (float, "turning / length, rad/m"),
    "heading_changes": (int, "turns of more than 15 degrees"),
    "jerk_mps3": (float, "mean third difference of the path over tick^3, m/s^3"),
    "mode_switches": (int, "changes of the planner's mode"),
    "avoidance_s": (float, "time in obstacle avoidance, s"),
    "blocked_ticks": (int, "ticks without a free gap"),
    "stopped_ticks": (int, "ticks with input that the planner refused"),
    "encounters": (int, "obstacles that came within SR"),
    "obstacles": (int, "obstacles of the world"),
    "straight_m": (float, "distance from start to goal, m"),
}
_ORACLE: dict[str, tuple[type, str]] = {
    "certificate": (str, "of the oracle: feasible, infeasible or undecided; empty without oracle"),
    "survivability": (float, "share of positions where no obstacle touches a standing robot"),
    "optimum_m": (float, "shortest collision-free path at constant speed, full knowledge, m"),
    "gap": (float, "length / optimum - 1, where the goal was reached"),
    "spl": (float, "success weighted by path length, against the optimum"),
    "barn": (float, "BARN score, against the optimum at full speed"),
}
_FROM_MOTION = [field.name for field in fields(RunMotion) if field.name in _RUN]
_FROM_RESULT = [field.name for field in fields(Result) if field.name in _RUN]
COLUMNS = {**_KEY, **_RUN, **_ORACLE}
SCENARIO: dict[str, tuple[type, str]] = {
    "scenario": (str, "name of the scenario, in a suite of scenario files")
}
# Wall times differ from run to run, so these are in a separate table.
TIMINGS: dict[str, tuple[type, str]] = {
    **_KEY,
    "decision_us": (
        float,
        "decision time, median of the ticks, us; empty for runs computed together",
    ),
    "decision_max_us": (float, "longest decision, us; empty likewise"),
    "wall_ms": (float, "wall time of the run, ms; an equal share for runs computed together"),
}


def run_row(run: Run, completed: CompletedRun) -> Row:
    """The row of a run, without the oracle's columns."""
    result, run_motion = assess(completed.episode)
    scenario = completed.episode.scenario
    row = {
        **dict.fromkeys(_RUN),
        **run._asdict(),
        **{name: getattr(run_motion, name) for name in _FROM_MOTION},
        **{name: getattr(result, name) for name in _FROM_RESULT},
        "outcome": FAILED if completed.fault else result.outcome.value,
        "failure": completed.fault_at,
        "time_to_goal_s": time_to_goal_s(result),
        "encounters": len(result.encounters),
        "obstacles": len(scenario.obstacles),
        "straight_m": distance(scenario.start_m, scenario.goal_m),
    }
    return {name: row[name] for name in (*_KEY, *_RUN)}


def lost_row(run: Run, failure: str) -> Row:
    """The row of a run that hung or whose process died: no figures."""
    row = {**dict.fromkeys((*_KEY, *_RUN)), **run._asdict()}
    return {**row, "outcome": FAILED, "failure": failure, "success": False}


def timing_row(times_ns: tuple[int, ...], wall_ms: float) -> Row:
    """The wall times of a run."""
    times = times_ns or (math.nan,)
    return {
        "decision_us": statistics.median(times) / 1e3,
        "decision_max_us": max(times) / 1e3,
        "wall_ms": wall_ms,
    }


def with_optimum(row: Row, optimum: Mapping[str, Any] | None, speed_mps: float) -> Row:
    """The row with the oracle's columns (optimum None: a sweep without oracle)."""
    found: Row = {**row, **dict.fromkeys(_ORACLE)}
    if optimum is None:
        return {**found, "certificate": ""}
    found |= {name: optimum[name] for name in ("certificate", "survivability")}
    optimum_m = optimum["optimum_m"]
    if not math.isfinite(optimum_m):
        return found
    length_m, success = row["length_m"], bool(row["success"])
    if row["outcome"] == Outcome.GOAL_REACHED.value:
        found["gap"] = optimality_gap(length_m, optimum_m)
    found["optimum_m"] = optimum_m
    found["spl"] = spl(success, length_m or 0.0, optimum_m)
    found["barn"] = barn_score(success, row["time_s"] or 0.0, optimum_m / speed_mps)
    return found
