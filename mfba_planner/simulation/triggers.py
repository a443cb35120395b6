# SPDX-License-Identifier: Apache-2.0
"""The triggers of a scenario, found again from where its robots were: a function of both."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from ..core.geometry import Point
from .scenario import Scenario
from .triggered_motion import is_waiting, start_triggered, waiting

Moment = tuple[float, Sequence[Point]]  # a tick: its time (s), the robots' positions (m)


def with_triggers(scenario: Scenario) -> list[int]:
    """The numbers (from 1) of the obstacles that have a trigger."""
    return [n for n, obstacle in enumerate(scenario.obstacles, start=1) if obstacle.trigger]


def before_triggers(scenario: Scenario) -> Scenario:
    """The scenario as configured: all triggers unreached."""
    if not with_triggers(scenario):
        return scenario
    obstacles = tuple(waiting(o.trigger) if o.trigger else o for o in scenario.obstacles)
    return replace(scenario, obstacles=obstacles)


def after_triggers(scenario: Scenario, moments: Iterable[Moment]) -> Scenario:
    """The scenario of a run: each waiting obstacle starts at the first moment of its trigger."""
    if not any(map(is_waiting, scenario.obstacles)):
        return scenario
    obstacles = scenario.obstacles
    for time_s, positions in moments:
        obstacles = start_triggered(obstacles, time_s, positions)
        if not any(map(is_waiting, obstacles)):
            break
    return scenario if obstacles == scenario.obstacles else replace(scenario, obstacles=obstacles)
