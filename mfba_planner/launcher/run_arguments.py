# SPDX-License-Identifier: Apache-2.0
"""Command line arguments of a run, and the checked RunRequest that they describe."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..core.argument_parser import Parser
from ..core.errors import ConfigError
from ..core.option_specs import override
from ..paper import readings_of_paper
from ..perception.sensory_vector import SensorParams
from ..planning.planner_factory import DEFAULT_METHOD, params_for_method
from ..planning.planner_params import Method
from ..scenarios.run_config import NODES, Driver, RunConfig, with_perception
from ..scenarios.scenario_files import load_scenario
from ..swarm.bat_swarm import Algorithm
from .set_option import (
    add_optimizer_argument,
    add_set_argument,
    settings_of,
    with_robot_settings,
    with_settings,
)

RECORDER = "recorder"
# With discovery on this machine only, 32 processes find each other, later ones may not (measured
# with Fast DDS). A robot is two; recorder, world_sim, launcher and one viewer are four.
MOST_ROBOTS = 14
PROCESS_GB = 0.05  # without shared memory
TIMEOUT_S = 600.0

_DESCRIPTION = """\
Run one episode: a robot drives among moving obstacles to its goal. Writes a directory with the
bag, result.json, a picture and, with several processes, their log.
"""
_EPILOG = """\
exit code: 0 goal reached without collision; 1 anything else, with the reason in one line;
130 Ctrl-C (the recording until then is complete).

examples:
  {prog} case1 --seed 1
  {prog} my_world.yaml --algorithm ba --set planner.step_length_m=0.08
  {prog} case2 --real-time --speed 2 --planner-args='--log-level debug'
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRequest:
    """One run to make; out is None for a new directory below ./runs."""

    config: RunConfig
    out: Path | None = None
    timeout_s: float = TIMEOUT_S
    picture: bool = True
    view: bool = False
    node_args: dict[str, list[str]]


def read_request(args: list[str], prog: str) -> RunRequest:
    """Turn a command line into a RunRequest; ConfigError for whatever cannot be accepted."""
    parser = Parser(prog=prog, description=_DESCRIPTION, epilog=_EPILOG.format(prog=prog))
    add_world_arguments(parser)
    driver = parser.add_argument_group("driver")
    driver.add_argument(
        "--driver",
        choices=[member.value for member in Driver],
        help="how the nodes run; the decisions are the same (default: multi-process, for "
        "several robots in-process)",
    )
    driver.add_argument(
        "--real-time", action="store_true", help="tick on a wall timer instead of in lockstep"
    )
    driver.add_argument(
        "--speed",
        type=float,
        metavar="FACTOR",
        help="simulated seconds per wall second; implies --real-time (default: 1)",
    )
    driver.add_argument(
        "--timeout",
        type=float,
        metavar="SECONDS",
        help=f"end the run after this wall time (default: {TIMEOUT_S:g}, or more if the "
        "scenario's time limit takes longer in real time)",
    )
    for node in (*NODES, RECORDER):
        driver.add_argument(
            f"--{node.replace('_', '-')}-args",
            action="append",
            default=[],
            metavar="'ARGS'",
            help=f"more --ros-args for {node}, such as '-p NAME:=VALUE' (multi-process only)",
        )
    output = parser.add_argument_group("output")
    output.add_argument(
        "--out", type=Path, metavar="DIR", help="directory to create (default: runs/run-NNN)"
    )
    output.add_argument("--no-picture", action="store_true", help="leave out run.png")
    output.add_argument(
        "--view", action="store_true", help="open the run in Rerun's viewer at its end"
    )
    return _build_request(parser.parse(args))


def add_world_arguments(parser: argparse.ArgumentParser, peers: Collection[str] = ()) -> None:
    """Add the arguments that define an episode, for any driver: scenario, seed, planner, --set.

    With peers --planner takes those names too, and MODULE:NAME; the caller checks it.
    """
    parser.add_argument(
        "scenario",
        nargs="?",
        default="case1",
        metavar="SCENARIO",
        help="a name that `mfba scenarios` lists, or a .yaml file (default: %(default)s)",
    )
    parser.add_argument("--seed", type=int, default=0, help="seed of all randomness (default: 0)")
    parser.add_argument(
        "--algorithm", choices=[a.value for a in Algorithm], help="mfba (default) or plain ba"
    )
    parser.add_argument(
        "--reading",
        metavar="NAME",
        help="interpretation of the paper's path planning: "
        f"{', '.join(readings_of_paper.PLANNERS)} (default: {readings_of_paper.DEFAULT_METHOD})",
    )
    others = f"; or {', '.join(peers)}, or MODULE:NAME, as `mfba sweep`" if peers else ""
    parser.add_argument(
        "--planner",
        choices=None if peers else [method.value for method in Method],
        metavar="NAME" if peers else None,
        help="paper: Algorithm 1; predictive: predicts obstacles, with its own step and swarm"
        f"{others} (default: {DEFAULT_METHOD.value}; "
        f"{Method.PAPER.value} with --algorithm, --reading or --swarm)",
    )
    parser.add_argument(
        "--swarm",
        metavar="NAME",
        help=f"interpretation of the paper's eq. 3-10: {', '.join(readings_of_paper.SWARMS)}",
    )
    add_optimizer_argument(parser)
    add_set_argument(parser)


def read_config(parsed: argparse.Namespace, **more: Any) -> RunConfig:
    """The RunConfig of the arguments, applied as reading, swarm, algorithm, planner, --set.

    Raises ConfigError for what contradicts or has no effect.
    """
    if parsed.planner == Method.PREDICTIVE.value:
        refuse_options_of_paper(parsed, "reading", "swarm")
    planner = readings_of_paper.planner(parsed.reading or readings_of_paper.DEFAULT_METHOD)
    if parsed.swarm:
        planner = replace(planner, bat=readings_of_paper.swarm(parsed.swarm))
    if parsed.algorithm:
        planner = override(planner, {"bat.algorithm": parsed.algorithm})
    algorithm_1 = any((parsed.algorithm, parsed.reading, parsed.swarm))
    planner = params_for_method(parsed.planner, planner, algorithm_1=algorithm_1)
    scenario = load_scenario(parsed.scenario)
    robot, others = with_robot_settings(scenario.robot, settings_of(parsed))
    planner, sensor = with_settings(planner, SensorParams(), others)
    scenario, planner = with_perception(replace(scenario, robot=robot), planner)
    return RunConfig(
        scenario=scenario,
        planner=planner,
        sensor=sensor,
        seed=parsed.seed,
        **more,
    )


def refuse_options_of_paper(parsed: argparse.Namespace, *options: str) -> None:
    """Raise ConfigError for one of these options beside another planner than paper."""
    for option in options:
        if getattr(parsed, option):
            raise ConfigError(
                f"--{option}: of planner paper only; leave it out with {parsed.planner}"
            )


def _build_request(parsed: argparse.Namespace) -> RunRequest:
    driver = Driver(parsed.driver or _default_driver(parsed.scenario))
    real_time = parsed.real_time or parsed.speed is not None
    if real_time and driver is Driver.CORE:
        raise ConfigError("--real-time: the core driver has no clock; choose another --driver")
    speed = {} if parsed.speed is None else {"speed_factor": parsed.speed}
    config = read_config(parsed, driver=driver, real_time=real_time, **speed)
    robots = len(config.scenario.robots)
    if robots and driver is Driver.CORE:
        raise ConfigError(
            f"--driver core: writes no directory for {robots} robots; use `mfba sim`, or "
            "another --driver"
        )
    if robots > MOST_ROBOTS and driver is Driver.MULTI_PROCESS:
        raise ConfigError(
            f"--driver multi-process: {robots} robots would be {2 * robots + 2} processes of "
            f"{PROCESS_GB:g} GB, too many for DDS discovery; give --driver in-process, or "
            f"{MOST_ROBOTS} robots at most"
        )
    if robots and real_time:
        raise ConfigError(
            f"--real-time: {robots} robots run in lockstep only; leave it out, or use "
            "`ros2 launch mfba_planner simulate.launch.py` to watch them"
        )
    node_args = {
        node: _split(f"--{node.replace('_', '-')}-args", getattr(parsed, f"{node}_args"))
        for node in (*NODES, RECORDER)
    }
    given = [node for node, args in node_args.items() if args]
    if given and driver is not Driver.MULTI_PROCESS:
        raise ConfigError(
            f"--{given[0].replace('_', '-')}-args: the {driver.value} driver starts no processes; "
            "use --set, or --driver multi-process"
        )
    if parsed.view:
        from ..report.rerun_viewer import require_viewer

        require_viewer()
    return RunRequest(
        config=config,
        view=parsed.view,
        out=parsed.out,
        timeout_s=_timeout_s(parsed.timeout, config),
        picture=not parsed.no_picture,
        node_args=node_args,
    )


def _default_driver(scenario: str) -> Driver:
    """In-process for a fleet, which would need two processes per robot; else multi-process."""
    return Driver.IN_PROCESS if load_scenario(scenario).robots else Driver.MULTI_PROCESS


def _split(option: str, texts: list[str]) -> list[str]:
    try:
        return [word for text in texts for word in shlex.split(text)]
    except ValueError as error:
        raise ConfigError(f"{option} {texts[-1]}: {error}; quote as in a shell") from None


def _timeout_s(given: float | None, config: RunConfig) -> float:
    if given is None:
        wall_s = config.scenario.time_limit_s / config.speed_factor if config.real_time else 0.0
        return max(TIMEOUT_S, 60.0 + wall_s)
    if not 0.0 < given < float("inf"):
        raise ConfigError(f"--timeout={given:g}: out of range; give a finite number above 0, s")
    return given
