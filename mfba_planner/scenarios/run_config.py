# SPDX-License-Identifier: Apache-2.0
"""RunConfig, the configuration of one run; parameters of each node, recorded run facts."""

from __future__ import annotations

import json
import platform
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any

import numpy as np

from .. import __version__
from ..core.errors import ConfigError
from ..core.geometry import Pose2D
from ..core.option_specs import Scalar, check, flatten, option
from ..core.planner_types import NANO
from ..optimizers.registry import require_optimizer
from ..perception.sensory_vector import SensorParams
from ..planning.planner_params import PerceptionInput, PlannerParams
from ..planning.stopping_distance import too_fast_for_lidar, too_fast_for_sectors
from ..simulation.fleet import robot_seed, scenarios_with_others
from ..simulation.robot_model import DEFAULT_BEAMS
from ..simulation.scenario import Scenario
from ..simulation.scenario_map import scenario_grid
from ..simulation.triggered_motion import may_be_absent
from .scenario_json import scenario_to_json, segments_text

Parameters = dict[str, dict[str, Any]]

READY_TIMEOUT_S = 30.0  # for node discovery, on a busy machine too
NODES = ("world_sim", "virtual_sensor", "planner")
OF_ROBOT = NODES[1:]  # nodes that each robot of a fleet has


class Driver(Enum):
    """How the nodes are run; the decisions are the same."""

    CORE = "core"
    IN_PROCESS = "in-process"
    MULTI_PROCESS = "multi-process"


@dataclass(frozen=True, slots=True, kw_only=True)
class RunConfig:
    """All that determines a run."""

    scenario: Scenario
    planner: PlannerParams = field(default_factory=PlannerParams)
    sensor: SensorParams = field(default_factory=SensorParams)
    seed: int = option(0, "seed of all randomness", minimum=0, maximum=2**63 - 1)
    driver: Driver = option(Driver.MULTI_PROCESS, "how the nodes are run")
    real_time: bool = option(False, "tick on a wall timer; false: lockstep")
    speed_factor: float = option(
        1.0, "simulated seconds per wall second in real time", minimum=0.01, maximum=1000.0
    )

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range, or options that contradict each other.

        An input timeout shorter than a tick; a robot that cannot stop within what it sees. Also
        for an optimiser that is unknown or not installed.
        """
        check(self)
        require_optimizer(self.planner.optimizer)
        fault = _too_fast(self.scenario, self.planner, self.sensor)
        if fault:
            raise ConfigError(fault)
        if self.planner.known_map:
            _check_known_map(self.scenario, self.planner)
        tick_s, timeout_s = self.planner.tick_ns * NANO, self.planner.input_timeout_s
        if self.real_time and timeout_s <= tick_s:
            raise ConfigError(
                f"planner.input_timeout_s={timeout_s:g}: a tick takes {tick_s:g} s, so in real "
                "time the robot would stop before each tick; give more, or a shorter step_length_m"
            )


def _too_fast(scenario: Scenario, planner: PlannerParams, sensor: SensorParams) -> str:
    params, lidar = scenario.planner_params(planner), scenario.robot.lidar
    if lidar.beams and params.reads_scan:
        return too_fast_for_lidar(params, lidar.range_max_m, lidar.extrinsics.offset_m)
    return too_fast_for_sectors(params, sensor.sensing_range_m)


def _check_known_map(scenario: Scenario, planner: PlannerParams) -> None:
    if not planner.reads_known_map:
        raise ConfigError(
            "known_map=true: only predictive with a scan uses a map; leave it out, or give "
            "method=predictive and perception=auto"
        )
    scenario_grid(scenario)


def with_perception(scenario: Scenario, planner: PlannerParams) -> tuple[Scenario, PlannerParams]:
    """Scenario and planner of a run, the planner's perception no longer auto.

    A robot without a lidar gets the default one if its planner reads scans.
    """
    if not planner.reads_scan:
        return scenario, planner
    robot = scenario.robot
    if not robot.lidar.beams:
        robot = replace(robot, lidar=replace(robot.lidar, beams=DEFAULT_BEAMS))
    return replace(scenario, robot=robot), replace(planner, perception=PerceptionInput.SCAN)


def run_facts(config: RunConfig) -> dict[str, Scalar]:
    """Facts recorded with a run besides parameters: driver, real time or lockstep, versions."""
    return {
        "driver": config.driver.value,
        "real_time": config.real_time,
        "mfba_planner": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


def _radii(scenario: Scenario) -> list[float]:
    """Radii for virtual_sensor: of each obstacle, or one for all where some are absent at times.

    Raises ConfigError for different radii then: the obstacles topic does not say which are there.
    """
    radii = [obstacle.radius_m for obstacle in scenario.obstacles]
    if not any(map(may_be_absent, scenario.obstacles)):
        return radii
    if len(set(radii)) > 1 and not scenario.robot.lidar.beams:
        raise ConfigError(
            f"scenario {scenario.name!r}: obstacles of different radii, some absent at times, "
            "need a robot with a lidar in ROS 2; set robot.lidar.beams, or one radius for all"
        )
    return radii[:1]


def node_parameters(config: RunConfig, peers: tuple[str, ...]) -> Parameters:
    """Parameters of each node: {node: {parameter: value}}.

    peers names the nodes that must be discovered before the first tick.
    """
    lockstep = not config.real_time
    # In slow motion timeouts are longer; never shorter than on a real robot.
    timeout_s = min(config.planner.input_timeout_s / min(config.speed_factor, 1.0), 3600.0)
    # Lockstep is rarely watched, and markers cost more than the decisions.
    common = {"lockstep": lockstep, "wait_for": ",".join(peers)}
    # In real time, inputs are dated by the world's clock. Faster, a delay of the machine would be
    # many times as long by that clock, so arrival times count; in lockstep nothing reads a clock.
    dated = {"use_sim_time": True} if not lockstep and config.speed_factor <= 1.0 else {}
    viewed = common | {"view_period_s": 5.0 if lockstep else 0.2}
    robot = config.scenario.robot
    # Never by tf: the first scan comes before it.
    extrinsics = {**robot.lidar.extrinsics.parameters, "scan_extrinsics": "parameters"}
    reading = common | dated | {"odom_source": "topic"}
    radii = _radii(config.scenario)
    segments = config.scenario.segments_m if not robot.lidar.beams else ()
    return {
        "world_sim": viewed
        | {
            "scenario": scenario_to_json(config.scenario),
            "speed_factor": config.speed_factor,
            "tick_ns": config.planner.tick_ns,
            "goal_tolerance_m": config.planner.goal_tolerance_m,
            "publish_map": config.planner.known_map,
            "start_paused": True,
            "seed": config.seed,
        },
        "virtual_sensor": reading
        | flatten(config.sensor)
        | {
            "robot_radius_m": config.scenario.robot_radius_m,
            **({"obstacle_radii_m": radii} if radii else {}),
            **({"segments_m": segments_text(segments)} if segments else {}),
            **({"source": "scan", **extrinsics} if robot.lidar.beams else {}),
        },
        "planner": viewed
        | reading
        | flatten(config.scenario.planner_params(config.planner))
        | {"seed": config.seed, **extrinsics}
        | ({} if lockstep else {"input_timeout_s": timeout_s}),
    }


def graph_parameters(config: RunConfig, peers: tuple[str, ...]) -> Parameters:
    """node_parameters(); for a fleet also NAME/planner and NAME/virtual_sensor of each robot."""
    scenario = config.scenario
    if not scenario.robots:
        return node_parameters(config, peers)
    parameters = {"world_sim": node_parameters(config, peers)["world_sim"]}
    starts = [[Pose2D(*member.start_m)] for member in scenario.robots]
    worlds = scenarios_with_others(scenario, starts, config.planner.tick_ns)
    for number, (member, world) in enumerate(zip(scenario.robots, worlds)):
        robot_config = replace(config, scenario=world, seed=robot_seed(config.seed, number))
        own = node_parameters(robot_config, peers)
        parameters |= {f"{member.name}/{name}": own[name] for name in OF_ROBOT}
    return parameters


def recorder_parameters(
    config: RunConfig, output: str, nodes: Iterable[str] = ()
) -> dict[str, Any]:
    """Parameters of the recorder; it records the parameters of the nodes named."""
    return {
        "output": output,
        "nodes": ",".join(nodes),
        "namespaces": ",".join(config.scenario.robot_names),
        "sim_time": True,
        "run": json.dumps(run_facts(config)),
    }
