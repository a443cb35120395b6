# SPDX-License-Identifier: Apache-2.0
"""Helper of `mfba report` and `mfba view`, not a command: reads runs and names them.

A bag is read. A result (`mfba sim --out`) is simulated again, and must have the digest that the
result names. Needs no ROS.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from ...core.argument_parser import Parser
from ...core.errors import ConfigError, InputError
from ...core.option_specs import override
from ...core.output_files import RESULT, bag_or_result_in
from ...core.shipped_files import scenario_names
from ...perception.sensory_vector import SensorParams
from ...planning.planner_params import PlannerParams
from ...recording.decisions_without_inputs import print_omissions
from ...recording.fleet_topics import NO_NAMESPACE, select_robots
from ...recording.local_maps import NO_MAPS, RobotMaps, read_local_maps
from ...recording.perceived import NOTHING_PERCEIVED, RobotPerceived
from ...recording.read_episode import Recording, read_recording
from ...recording.read_perceived import read_perceived
from ...report.result_json import read_result
from ...scenarios.scenario_files import load_scenario
from ...simulation.decision_digest import digest
from ...simulation.episode import Episode
from ...simulation.run_episode import simulate
from ...simulation.scenario import Scenario


def add_paths(parser: Parser) -> None:
    """Add the arguments `paths` (one run or more) and --robot."""
    parser.add_argument(
        "paths", type=Path, nargs="+", metavar="BAG|RESULT", help="run or bag directory, or file"
    )
    parser.add_robots()


class NamedEpisodes(NamedTuple):
    """(name, run) pairs; fleet_names has all robots' names if the runs are one fleet's.

    maps holds the local maps of the bags by the run's name, perceived what real robots perceived.
    """

    runs: list[tuple[str, Episode]]
    fleet_names: tuple[str, ...] = ()
    maps: RobotMaps = NO_MAPS
    perceived: RobotPerceived = NOTHING_PERCEIVED


def named_episodes(paths: list[Path], robots: Sequence[str] = ()) -> NamedEpisodes:
    """Read or simulate the runs; print what is left out. Raises BagError, InputError."""
    loaded = [_recording(path, robots) for path in paths]
    first, maps, perceived = loaded[0]
    if len(paths) == 1 and first.scenario.robot_names:
        return NamedEpisodes(list(first.episodes.items()), first.scenario.robot_names, maps)
    runs, maps_of, perceived_of = [], {}, {}
    for path, (recording, maps, perceived) in zip(paths, loaded):
        for robot, episode in recording.episodes.items():
            name = ".".join(filter(None, (_name(path), robot)))
            runs.append((name, episode))
            maps_of[name], perceived_of[name] = maps.get(robot, ()), perceived.get(robot, ())
    return NamedEpisodes(runs, maps=maps_of, perceived=perceived_of)


def _name(path: Path) -> str:
    """A run's name on the page: its directory or file, without `bag` or `result.json`."""
    path = path.absolute()
    if path.name in ("bag", RESULT):
        return path.parent.name
    return path.name if path.is_dir() else path.stem


def _recording(path: Path, robots: Sequence[str]) -> tuple[Recording, RobotMaps, RobotPerceived]:
    """A recording, its local maps, and what its robots perceived."""
    path = bag_or_result_in(path)
    if path.suffix != ".json":
        recording = read_recording(path, robots)
        print_omissions(path, recording.omitted)
        episodes = recording.episodes
        return recording, read_local_maps(path, episodes), read_perceived(path, episodes)
    select_robots(path, [NO_NAMESPACE], robots)
    episode = _simulate_result(path)
    return Recording(episode.scenario, episode.seed, {NO_NAMESPACE: episode}, {}), NO_MAPS, {}


def _simulate_result(path: Path) -> Episode:
    """Simulate the run of a result; InputError unless its digest is the result's."""
    data = read_result(path)
    parameters = data["parameters"]
    try:
        episode = simulate(
            _scenario_of(data),
            planner=override(PlannerParams(), parameters["planner"]),
            sensor=override(SensorParams(), parameters["sensor"]),
            seed=data["seed"],
        )
    except (ConfigError, InputError, KeyError, TypeError) as error:
        raise InputError(
            f"{path}: its run cannot be simulated again ({error}); give its bag"
        ) from None
    simulated_digest = digest(episode.ticks)
    if simulated_digest != data["digest"]:
        raise InputError(
            f"{path}: simulated again, its run has other decisions (digest "
            f"{simulated_digest[:12]}, not {data['digest'][:12]}); give its bag"
        )
    return episode


def _scenario_of(data: dict[str, Any]) -> Scenario:
    """The scenario of a result; older results only have its name."""
    if "world" in data:
        return load_scenario(json.dumps(data["world"]))
    if data["scenario"] not in scenario_names():
        raise InputError(f"scenario {data['scenario']} is not shipped")
    return load_scenario(data["scenario"])
