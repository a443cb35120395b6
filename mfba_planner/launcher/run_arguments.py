# SPDX-License-Identifier: Apache-2.0
"""What a run is ordered with: command line arguments turned into one checked Order."""

from __future__ import annotations

import argparse
import shlex
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..core.argument_parser import Parser
from ..core.errors import ConfigError
from ..core.options import override
from ..paper import readings
from ..perception.sensory_vector import SensorParams
from ..planning.planner_factory import DEFAULT_METHOD, params_for_method
from ..planning.planner_params import Method
from ..scenarios.run_config import NODES, Driver, RunConfig
from ..scenarios.scenario_files import load_scenario
from ..swarm.bat_swarm import Algorithm
from .set_option import add_set_argument, with_robot_settings, with_settings

RECORDER = "recorder"
# Where discovery stays on this machine, 32 processes find each other and later ones may not (as
# measured with Fast DDS). A robot is two; recorder, world_sim, launcher and one onlooker are four.
MOST_ROBOTS = 14
PROCESS_GB = 0.05  # without what they share
TIMEOUT_S = 600.0

_DESCRIPTION = """\
Run one episode: a robot crosses a world of moving obstacles to its goal. Leaves a directory
with the bag, result.json, a picture and, from several processes, their logs.
"""
_EPILOG = """\
exit code: 0 goal reached without collision; 1 anything else, with the reason in one line;
130 Ctrl-C (what was recorded until then is whole).

examples:
  {prog} case1 --seed 1
  {prog} my_world.yaml --algorithm ba --set planner.step_length_m=0.08
  {prog} case2 --real-time --speed 2 --planner-args='--log-level debug'
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRequest:
    """One run to be made; out is None for a new directory below ./runs."""

    config: RunConfig
    out: Path | None = None
    timeout_s: float = TIMEOUT_S
    picture: bool = True
    view: bool = False
    node_args: dict[str, list[str]]


def read_request(args: list[str], prog: str) -> RunRequest:
    """Turn a command line into an Order; ConfigError for whatever cannot be accepted."""
    parser = Parser(prog=prog, description=_DESCRIPTION, epilog=_EPILOG.format(prog=prog))
    add_world_arguments(parser)
    driver = parser.add_argument_group("driver")
    driver.add_argument(
        "--driver",
        choices=[member.value for member in Driver],
        help="who turns the loop; the decisions are the same (default: multi-process, of "
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
        help=f"give up after so much wall time (default: {TIMEOUT_S:g}, or what the scenario's "
        "time limit takes in real time if that is more)",
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
        "--view", action="store_true", help="open the run in Rerun's viewer when it is over"
    )
    return _order(parser.parse(args))


def add_world_arguments(parser: argparse.ArgumentParser) -> None:
    """What decides how an episode goes, whoever turns the loop."""
    parser.add_argument(
        "scenario",
        nargs="?",
        default="case1",
        metavar="SCENARIO",
        help="a name that `mfba scenarios` lists, or a .yaml file (default: %(default)s)",
    )
    parser.add_argument("--seed", type=int, default=0, help="of all randomness (default: 0)")
    parser.add_argument(
        "--algorithm", choices=[a.value for a in Algorithm], help="mfba (default) or plain ba"
    )
    parser.add_argument(
        "--reading",
        metavar="NAME",
        help="how the paper's path planning is read: "
        f"{', '.join(readings.PLANNERS)} (default: {readings.DEFAULT_METHOD})",
    )
    parser.add_argument(
        "--planner",
        choices=[method.value for method in Method],
        help="who decides: Algorithm 1, or our planner that predicts, with its own step and swarm "
        f"(default: {DEFAULT_METHOD.value}; "
        f"{Method.PAPER.value} with --algorithm, --reading or --swarm)",
    )
    parser.add_argument(
        "--swarm",
        metavar="NAME",
        help=f"how the paper's eq. 3-10 are read: {', '.join(readings.SWARMS)}",
    )
    add_set_argument(parser)


def read_config(found: argparse.Namespace, **more: Any) -> RunConfig:
    """The RunConfig that add_world_arguments' values describe; later ones override earlier."""
    planner = readings.planner(found.reading or readings.DEFAULT_METHOD)
    if found.swarm:
        planner = replace(planner, bat=readings.swarm(found.swarm))
    if found.algorithm:
        planner = override(planner, {"bat.algorithm": found.algorithm})
    algorithm_1 = any((found.algorithm, found.reading, found.swarm))
    planner = params_for_method(found.planner, planner, algorithm_1=algorithm_1)
    scenario = load_scenario(found.scenario)
    robot, others = with_robot_settings(scenario.robot, found.settings)
    planner, sensor = with_settings(planner, SensorParams(), others)
    return RunConfig(
        scenario=replace(scenario, robot=robot),
        planner=planner,
        sensor=sensor,
        seed=found.seed,
        **more,
    )


def _order(found: argparse.Namespace) -> RunRequest:
    driver = Driver(found.driver or _usual_driver(found.scenario))
    real_time = found.real_time or found.speed is not None
    if real_time and driver is Driver.CORE:
        raise ConfigError("--real-time: the core driver has no clock; choose another --driver")
    speed = {} if found.speed is None else {"speed_factor": found.speed}
    config = read_config(found, driver=driver, real_time=real_time, **speed)
    robots = len(config.scenario.robots)
    if robots and driver is Driver.CORE:
        raise ConfigError(
            f"--driver core: of {robots} robots it leaves no directory; use `mfba sim`, or "
            "another --driver"
        )
    if robots > MOST_ROBOTS and driver is Driver.MULTI_PROCESS:
        raise ConfigError(
            f"--driver multi-process: {robots} robots would be {2 * robots + 2} processes of "
            f"{PROCESS_GB:g} GB, more than find each other; give --driver in-process, or "
            f"{MOST_ROBOTS} robots at most"
        )
    if robots and real_time:
        raise ConfigError(
            f"--real-time: {robots} robots run in lockstep here; leave it out, or use "
            "`ros2 launch mfba_planner simulate.launch.py` to watch them"
        )
    node_args = {
        node: _split(f"--{node.replace('_', '-')}-args", getattr(found, f"{node}_args"))
        for node in (*NODES, RECORDER)
    }
    given = [node for node, args in node_args.items() if args]
    if given and driver is not Driver.MULTI_PROCESS:
        raise ConfigError(
            f"--{given[0].replace('_', '-')}-args: the {driver.value} driver starts no processes; "
            "use --set, or --driver multi-process"
        )
    if found.view:
        from ..report.rerun_viewer import require_viewer

        require_viewer()
    return RunRequest(
        config=config,
        view=found.view,
        out=found.out,
        timeout_s=_timeout_s(found.timeout, config),
        picture=not found.no_picture,
        node_args=node_args,
    )


def _usual_driver(scenario: str) -> Driver:
    """Every robot has two nodes: a fleet would need twice as many processes as robots."""
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
        raise ConfigError(f"--timeout={given:g}: out of range; give seconds above 0")
    return given
