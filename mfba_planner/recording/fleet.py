# SPDX-License-Identifier: Apache-2.0
"""From a fleet's bag back to an Episode of each of its robots, without ROS."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ..core.episode import Episode
from ..core.errors import BagError
from ..core.fleet import alone, seen_by
from .decisions import stream_decisions
from .episode import read_setup, read_truth
from .reader import BagReader


def read_fleet(path: str | Path, *, salvage: bool = False) -> tuple[Episode, ...]:
    """The Episodes of a bag of several robots, in the scenario's order.

    Raises BagError as read_episode() does, and for a bag of one robot.
    """
    with BagReader(path, salvage=salvage) as reader:
        scenario = read_setup(reader, fleet=True).scenario
        if not scenario.robots:
            raise BagError(f"{path}: holds one robot's run; read it with read_episode")
        found = []
        for number, member in enumerate(scenario.robots):
            setup = read_setup(reader, fleet=True, robot=member.name)
            namespace = f"/{member.name}"
            ticks = tuple(tick for tick, _ in stream_decisions(reader, namespace))
            truth = read_truth(reader, namespace)
            setup = setup._replace(scenario=alone(scenario, number))
            found.append(setup.episode(ticks, truth))
    poses = [episode.truth or tuple(tick.pose for tick in episode.ticks) for episode in found]
    return tuple(
        replace(episode, scenario=seen_by(scenario, number, poses, episode.planner.tick_ns))
        for number, episode in enumerate(found)
    )
