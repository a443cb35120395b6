# SPDX-License-Identifier: Apache-2.0
"""Named runs from bags and results, for commands that show some of them; needs no ROS.

A bag is read. Of a result (`mfba sim --out`) the run is made again, and must take the decisions
that the result's digest stands for.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from ..core.argument_parser import Parser
from ..core.errors import ConfigError, InputError
from ..core.options import override
from ..core.outputs import bag_in
from ..core.resources import scenario_names
from ..perception.sensory_vector import SensorParams
from ..planning.planner_params import PlannerParams
from ..recording.omitted_decisions import tell
from ..recording.read_episode import Recording, read_recording
from ..recording.robot_topics import NO_NAMESPACE, chosen
from ..report.result_json import read_result
from ..scenarios.scenario_files import load_scenario
from ..simulation.decision_digest import digest
from ..simulation.episode import Episode
from ..simulation.scenario import Scenario
from ..simulation.simulate import simulate

_RESULT = "result.json"


def add_paths(parser: Parser) -> None:
    """The argument `paths`: one run or more; and which robots of a fleet's."""
    parser.add_argument(
        "paths", type=Path, nargs="+", metavar="BAG|RESULT", help="run or bag directory, or file"
    )
    parser.add_robots()


class Named(NamedTuple):
    """Runs by name; roster names all robots of the fleet, where the runs are of one only."""

    runs: list[tuple[str, Episode]]
    roster: tuple[str, ...] = ()


def named_episodes(paths: list[Path], robots: Sequence[str] = ()) -> Named:
    """Read or make the runs, and say what is left out of them; raises BagError, InputError."""
    recordings = [_runs(path, robots) for path in paths]
    first = recordings[0]
    if len(paths) == 1 and NO_NAMESPACE not in first.episodes:
        return Named(list(first.episodes.items()), first.scenario.robot_names)
    runs = []
    for path, recording in zip(paths, recordings):
        for robot, episode in recording.episodes.items():
            runs.append((".".join(filter(None, (_name(path), robot))), episode))
    return Named(runs)


def _name(path: Path) -> str:
    """What a run is called on the page: the last part of its path that tells it from others."""
    path = path.absolute()
    if path.name in ("bag", _RESULT):
        return path.parent.name
    return path.name if path.is_dir() else path.stem


def _runs(path: Path, robots: Sequence[str]) -> Recording:
    bag = bag_in(path)
    if bag == path and not any(path.glob("*.mcap")) and (path / _RESULT).is_file():
        path = path / _RESULT
    if path.suffix != ".json":
        recording = read_recording(bag, robots)
        tell(bag, recording.missed)
        return recording
    chosen(path, [NO_NAMESPACE], robots)
    episode = _again(path)
    return Recording(episode.scenario, episode.seed, {NO_NAMESPACE: episode}, {})


def _again(path: Path) -> Episode:
    """The run of a result, made again; InputError unless it decides as the result says."""
    data = read_result(path)
    told = data["parameters"]
    try:
        episode = simulate(
            _world(data),
            planner=override(PlannerParams(), told["planner"]),
            sensor=override(SensorParams(), told["sensor"]),
            seed=data["seed"],
        )
    except (ConfigError, InputError, KeyError, TypeError) as error:
        raise InputError(f"{path}: its run cannot be made again ({error}); give its bag") from None
    made = digest(episode.ticks)
    if made != data["digest"]:
        raise InputError(
            f"{path}: made again, its run decides otherwise (digest {made[:12]}, not "
            f"{data['digest'][:12]}); give its bag"
        )
    return episode


def _world(data: dict[str, Any]) -> Scenario:
    """The world of a result; the older ones only name it."""
    if "world" in data:
        return load_scenario(json.dumps(data["world"]))
    if data["scenario"] not in scenario_names():
        raise InputError(f"scenario {data['scenario']} is not shipped")
    return load_scenario(data["scenario"])
