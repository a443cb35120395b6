# SPDX-License-Identifier: Apache-2.0
"""Read a bag back into Episodes: the decisions of each tick, without ROS."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import NamedTuple

from ..core.planner_types import Decision
from ..evaluation.metrics import MetricsAccumulator, Result, evaluate
from ..simulation.decision_digest import Digest, digest
from ..simulation.episode import Episode
from ..simulation.fleet import scenarios_with_others
from ..simulation.scenario import Scenario
from .bag_reader import BagReader
from .decisions_with_sectors import rising_decisions, stream_decisions
from .fleet_topics import NO_NAMESPACE, select_robots
from .run_parameters import read_setup, read_setups
from .true_poses import read_truth


class Recording(NamedTuple):
    """Content of a bag: the scenario as configured, its seed, and an Episode by robot."""

    scenario: Scenario
    seed: int
    episodes: dict[str, Episode]  # in the scenario's sequence; NO_NAMESPACE for a single robot
    omitted: dict[str, str]  # by robot: which last decisions are omitted, and why


def read_recording(
    path: str | Path, robots: Sequence[str] = (), *, salvage: bool = False
) -> Recording:
    """The Episodes of a bag, of all its robots or those named; the others move as recorded.

    Decisions after the last of their inputs are omitted and noted in the Recording. `salvage`
    also reads a bag that was never closed. Raises BagError for a bag without configuration or
    decisions, for missing inputs before the last ones, and for an unknown robot.
    """
    with BagReader(path, salvage=salvage) as reader:
        scenario, seed, setups = read_setups(reader)
        names = list(setups)
        selected = select_robots(reader.path, names, robots)
        ticks: dict[str, dict[int, Decision]] = {name: {} for name in names}
        omitted: dict[str, str] = {}
        for recorded in stream_decisions(reader, names, omitted):
            ticks[recorded.robot].setdefault(recorded.decision.stamp_ns, recorded.decision)
        truth = read_truth(reader, setups)
    episodes = {
        name: setup.episode(
            tuple(decision for _, decision in sorted(ticks[name].items())), truth[name]
        )
        for name, setup in setups.items()
    }
    if scenario.robots:
        poses = [e.truth or tuple(tick.pose for tick in e.ticks) for e in episodes.values()]
        tick_ns = next(iter(setups.values())).planner.tick_ns
        worlds = dict(zip(names, scenarios_with_others(scenario, poses, tick_ns)))
        episodes = {name: replace(episodes[name], scenario=worlds[name]) for name in selected}
    selected_notes = {name: text for name, text in omitted.items() if name in episodes}
    return Recording(scenario, seed, episodes, selected_notes)


def read_episode(path: str | Path, *, salvage: bool = False) -> Episode:
    """The Episode of a bag of one robot, as read_recording(); BagError for a fleet's bag."""
    with BagReader(path, salvage=salvage) as reader:
        read_setup(reader)
    return read_recording(path, salvage=salvage).episodes[NO_NAMESPACE]


class Summary(NamedTuple):
    """A run in short; `episode` holds only the last tick if the bag was streamed.

    The last field is the note about omitted decisions, "" if none is.
    """

    episode: Episode
    result: Result
    digest: str
    omitted: str


def summarize(path: str | Path, *, salvage: bool = False) -> Summary:
    """The Summary of a bag of one robot, of any length: the bag is streamed.

    Raises as read_episode(), and BagError if the stamp of a decision decreases.
    """
    with BagReader(path, salvage=salvage) as reader:
        setup = read_setup(reader)
        truth = read_truth(reader, {NO_NAMESPACE: setup})[NO_NAMESPACE]
        omitted: dict[str, str] = {}
        stream = (
            recorded.decision for recorded in rising_decisions(reader, [NO_NAMESPACE], omitted)
        )
        first = next(stream)  # raises BagError without decisions
        metrics, hasher = MetricsAccumulator(setup.episode((first,))), Digest()
        for tick in chain([first], stream):
            metrics.add(tick, truth.get(tick.stamp_ns))
            hasher.add(tick)
    episode = setup.episode((tick,), truth)
    result = metrics.result(episode.outcome)
    return Summary(episode, result, hasher.hexdigest(), omitted.get(NO_NAMESPACE, ""))


def summaries(
    path: str | Path, robots: Sequence[str] = (), *, salvage: bool = False
) -> dict[str, Summary]:
    """The Summary of each robot of a bag, or of those named; raises as read_recording()."""
    with BagReader(path, salvage=salvage) as reader:
        names = list(read_setups(reader).by_robot)
        select_robots(reader.path, names, robots)
    if names == [NO_NAMESPACE]:
        return {NO_NAMESPACE: summarize(path, salvage=salvage)}
    # The robots are moving obstacles of each other, so all are read before any is evaluated.
    recorded = read_recording(path, robots, salvage=salvage)
    return {
        name: Summary(e, evaluate(e), digest(e.ticks), recorded.omitted.get(name, ""))
        for name, e in recorded.episodes.items()
    }
