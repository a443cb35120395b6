# SPDX-License-Identifier: Apache-2.0
"""From a bag back to Episodes: what a planner saw and decided, tick by tick, without ROS."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import NamedTuple

from ..core.errors import BagError, InputError
from ..core.geometry import Pose2D
from ..core.types import Decision
from ..evaluation.metrics import MetricsAccumulator, Result, evaluate
from ..simulation.decision_digest import Digest, digest
from ..simulation.episode import Episode
from ..simulation.fleet import scenarios_with_others
from ..simulation.scenario import Scenario
from .bag_reader import BagReader
from .decisions import rising_decisions, stream_decisions
from .from_messages import robot_pose, stamp_ns
from .robot_topics import NO_NAMESPACE, below, chosen, messages_by_robot
from .run_setup import read_setup, read_setups

TRUTH = "/ground_truth"


class Recording(NamedTuple):
    """What a bag holds: the scenario as it was given, its seed, and an Episode by robot."""

    scenario: Scenario
    seed: int
    episodes: dict[str, Episode]  # in the scenario's order; a robot alone is called ALONE
    missed: dict[str, str]  # of whom the last decisions are left out: which, and why


def read_recording(
    path: str | Path, robots: Sequence[str] = (), *, salvage: bool = False
) -> Recording:
    """The Episodes of a bag, of all its robots or those named; the others move as they went.

    Decisions after the end of their inputs are left out and named in `missed`. `salvage` also
    reads a bag that was never closed. Raises BagError for a bag without configuration or without
    decisions, where a decision's inputs are missing before their end, and for a robot that is
    not there.
    """
    with BagReader(path, salvage=salvage) as reader:
        scenario, seed, setups = read_setups(reader)
        names = list(setups)
        wanted = chosen(reader.path, names, robots)
        ticks: dict[str, dict[int, Decision]] = {name: {} for name in names}
        missed: dict[str, str] = {}
        for found in stream_decisions(reader, names, missed):
            ticks[found.robot].setdefault(found.decision.stamp_ns, found.decision)
        truth = _read_truth(reader, names)
    episodes = {
        name: setup.episode(tuple(said for _, said in sorted(ticks[name].items())), truth[name])
        for name, setup in setups.items()
    }
    if scenario.robots:
        poses = [e.truth or tuple(tick.pose for tick in e.ticks) for e in episodes.values()]
        tick_ns = next(iter(setups.values())).planner.tick_ns
        worlds = dict(zip(names, scenarios_with_others(scenario, poses, tick_ns)))
        episodes = {name: replace(episodes[name], scenario=worlds[name]) for name in wanted}
    told = {name: missed[name] for name in episodes if name in missed}
    return Recording(scenario, seed, episodes, told)


def read_episode(path: str | Path, *, salvage: bool = False) -> Episode:
    """read_recording() of a bag of one robot; BagError for that of a fleet."""
    with BagReader(path, salvage=salvage) as reader:
        read_setup(reader)
    return read_recording(path, salvage=salvage).episodes[NO_NAMESPACE]


class Summary(NamedTuple):
    """A run in short: episode has its last tick only where the bag was streamed.

    missed says which of the last decisions are left out, and why, "" where none is.
    """

    episode: Episode
    result: Result
    digest: str
    missed: str


def summarize(path: str | Path, *, salvage: bool = False) -> Summary:
    """The Summary of a bag of one robot, of any length.

    Streams; raises as read_episode does, and where the stamp of a decision goes back.
    """
    with BagReader(path, salvage=salvage) as reader:
        setup, truth = read_setup(reader), _read_truth(reader, [NO_NAMESPACE])[NO_NAMESPACE]
        missed: dict[str, str] = {}
        stream = (found.decision for found in rising_decisions(reader, [NO_NAMESPACE], missed))
        first = next(stream)  # or it raises
        tally, hashed = MetricsAccumulator(setup.episode((first,))), Digest()
        for tick in chain([first], stream):
            tally.add(tick, truth.get(tick.stamp_ns))
            hashed.add(tick)
    episode = setup.episode((tick,), truth)
    result = tally.result(episode.outcome)
    return Summary(episode, result, hashed.hexdigest(), missed.get(NO_NAMESPACE, ""))


def summaries(
    path: str | Path, robots: Sequence[str] = (), *, salvage: bool = False
) -> dict[str, Summary]:
    """The Summary of each robot of a bag, or of those named; raises as read_recording does."""
    with BagReader(path, salvage=salvage) as reader:
        names = list(read_setups(reader).by_robot)
        chosen(reader.path, names, robots)
    if names == [NO_NAMESPACE]:
        return {NO_NAMESPACE: summarize(path, salvage=salvage)}
    # What the others did is part of what happened to each, so all has to be read first.
    found = read_recording(path, robots, salvage=salvage)
    return {
        name: Summary(e, evaluate(e), digest(e.ticks), found.missed.get(name, ""))
        for name, e in found.episodes.items()
    }


def _read_truth(reader: BagReader, robots: Sequence[str]) -> dict[str, dict[int, Pose2D]]:
    """Where each robot really was, by stamp, in a bag that says so."""
    found: dict[str, dict[int, Pose2D]] = {robot: {} for robot in robots}
    if not any(below(robot, TRUTH) in reader.topics for robot in robots):
        return found
    for robot, message in messages_by_robot(reader, robots, [TRUTH]):
        odom = message.message
        try:
            found[robot][stamp_ns(odom.header.stamp)] = robot_pose(odom)
        except InputError as error:
            raise BagError(f"{reader.path}: {below(robot, TRUTH)}: {error}") from None
    return found
