# SPDX-License-Identifier: Apache-2.0
"""Format the values of a run as text: the same in tables, pictures and pages."""

from __future__ import annotations

import math

from mfba_planner.core.geometry import distance
from mfba_planner.core.planner_types import Mode
from mfba_planner.evaluation.metrics import Result
from mfba_planner.simulation.episode import Episode, Outcome

MODES = {
    Mode.IDLE: "idle (no goal)",
    Mode.PATH_GENERATION: "path generation",
    Mode.OBSTACLE_AVOIDANCE: "obstacle avoidance",
    Mode.BLOCKED: "blocked (every gap closed)",
    Mode.STOPPED: "stopped (unusable input)",
    Mode.ARRIVED: "arrived",
}
UNKNOWN = "unknown"
_OUTCOMES = {
    Outcome.GOAL_REACHED: "goal reached",
    Outcome.TIME_LIMIT: "time limit",
    Outcome.INTERRUPTED: "interrupted",
}


def bits(of_headings: bool) -> tuple[str, str]:
    """The meaning of a set bit of Vs, and of Vg."""
    if of_headings:
        return "headings that lead to a contact", "the same: every heading is its own gap"
    return "sectors with an obstacle", "closed gaps"


def outcome(result: Result) -> str:
    """The outcome of the run."""
    return _OUTCOMES[result.outcome]


def number(value: float, digits: int, unit: str = "", absent: str = "none") -> str:
    """A number with its unit, or the text `absent` for inf and NaN."""
    if not math.isfinite(value):
        return absent
    size = f"{value:.{digits}f}" if abs(value) < 1e7 else f"{value:.6g}"
    return f"{size} {unit}".rstrip()


def length(result: Result) -> str:
    """Path length."""
    return number(result.length_m, 3, "m", absent=UNKNOWN)


def time(result: Result) -> str:
    """Simulated time."""
    return number(result.time_s, 2, "s")


def clearance(result: Result) -> str:
    """Smallest gap between robot and obstacle edges."""
    return number(result.min_clearance_m, 3, "m", absent="no obstacle")


def fitness(result: Result) -> str:
    """1 / length, as printed in Tables 5 and 7."""
    return number(result.fitness, 6, "1/m", absent="never moved")


def straight_m(episode: Episode) -> float:
    """Distance from start to goal (m)."""
    return distance(episode.scenario.start_m, episode.scenario.goal_m)


def one_line(text: str, limit: int) -> str:
    """Text without line breaks or control characters, cut at limit characters."""
    text = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return text if len(text) <= limit else f"{text[: limit - 3].rstrip()}..."


def run_title(episode: Episode) -> str:
    """Scenario, algorithm, seed and driver of the run, as one line."""
    return (
        f"{one_line(episode.scenario.name, 40)}, {episode.label},"
        f" seed {one_line(str(episode.seed), 24)}, {episode.driver} driver"
    )
