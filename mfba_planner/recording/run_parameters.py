# SPDX-License-Identifier: Apache-2.0
"""Read the setup of a run from a bag's configuration: scenario, parameters, seed, by robot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, TypeVar

from ..core.errors import BagError, ConfigError, InputError
from ..core.geometry import Pose2D
from ..core.option_specs import flatten, override
from ..core.planner_types import Decision
from ..perception.no_return import NoReturn
from ..perception.sensory_vector import SensorParams
from ..planning.planner_params import PlannerParams
from ..scenarios.scenario_files import load_scenario
from ..simulation.episode import Episode, Outcome
from ..simulation.fleet import scenarios_with_others
from ..simulation.scenario import Scenario
from ..simulation.triggers import after_triggers
from ..simulation.world import World
from .bag_reader import BagReader
from .configuration_attachment import read_configuration
from .fleet_topics import NO_NAMESPACE
from .true_poses import recorded_moments

T = TypeVar("T")

# Options that older bags lack; their defaults are the behaviour of that time, ...
NEWER_OPTIONS = (
    "method",
    "jump_m",
    "perception",
    "known_map",
    "optimizer",
    "robot_radius_m",
    "speed_limit.",
    "recovery.",
    "progress.",
)
# ... but for this one, which was off.
BEHAVIOUR_THEN = {"progress.time_allowance_s": 0.0}


class Setup(NamedTuple):
    """The setup of one robot; in a fleet's scenario the others stand at their starts.

    Of obstacles that wait for a trigger the scenario is that of the recorded run.
    """

    scenario: Scenario
    sensor: SensorParams
    planner: PlannerParams
    seed: int
    driver: str
    lockstep: bool
    odom_frame: str = ""  # required frame of the inputs; "": any
    scan_frame: str = ""  # required frame of the scans; "": any
    scan_no_return: NoReturn = NoReturn.INF

    def episode(self, ticks: tuple[Decision, ...], truth: Mapping[int, Pose2D] = {}) -> Episode:
        """The Episode of these decisions, at least one; `truth` is the true pose by stamp."""
        true_poses = tuple(truth.get(tick.stamp_ns, tick.pose) for tick in ticks) if truth else ()
        last_pose = true_poses[-1] if true_poses else ticks[-1].pose
        return Episode(
            scenario=self.scenario,
            sensor=self.sensor,
            planner=self.planner,
            seed=self.seed,
            driver=self.driver,
            ticks=ticks,
            outcome=_outcome(self.scenario, self.planner, ticks[-1].stamp_ns, last_pose),
            truth=true_poses,
        )


class Setups(NamedTuple):
    """The scenario as configured, its seed, and a Setup by robot in the scenario's sequence."""

    scenario: Scenario
    seed: int
    by_robot: dict[str, Setup]


def read_setups(reader: BagReader) -> Setups:
    """Read and check the setups in a bag's configuration. Raises BagError."""
    configuration = read_configuration(reader)
    nodes = configuration.get("nodes", {})
    try:
        world = nodes["world_sim"]
        scenario = load_scenario(world["scenario_json"])
        names = scenario.robot_names
        starts = [[Pose2D(*member.start_m)] for member in scenario.robots]
        run = after_triggers(scenario, recorded_moments(reader, names, world["tick_ns"]))
        worlds = scenarios_with_others(run, starts, world["tick_ns"]) if names else [run]
        setups = {}
        for name, robot_scenario in zip(names or (NO_NAMESPACE,), worlds):
            prefix = f"{name}/" if name else ""
            planner, sensor = (nodes[prefix + node] for node in ("planner", "virtual_sensor"))
            setups[name] = Setup(
                scenario=robot_scenario,
                sensor=_node_options(SensorParams(), sensor),
                planner=_node_options(PlannerParams(), planner),
                seed=planner["seed"],
                driver=configuration["run"].get("driver", "by hand"),
                lockstep=bool(planner["lockstep"]),
                odom_frame=planner.get("odom_frame", ""),
                scan_frame=sensor.get("scan_frame", ""),
                scan_no_return=NoReturn(sensor.get("scan_no_return", NoReturn.INF.value)),
            )
        single = setups.get(NO_NAMESPACE)
        return Setups(scenario, single.seed if single else world["seed"], setups)
    except (ConfigError, InputError) as error:
        raise BagError(f"{reader.path}: {error}") from None
    except KeyError as error:
        raise BagError(
            f"{reader.path}: its configuration lacks {error}; record with `mfba run`"
        ) from None


def read_setup(reader: BagReader) -> Setup:
    """The Setup of a bag of one robot; BagError for a fleet's bag."""
    setups = read_setups(reader).by_robot
    if NO_NAMESPACE not in setups:
        raise BagError(
            f"{reader.path}: holds {len(setups)} robots, but this reads a bag of one; use "
            "mfba_planner.recording.read_episode.read_recording"
        )
    return setups[NO_NAMESPACE]


def _node_options(defaults: T, values: dict[str, Any]) -> T:
    """The options of one dataclass, from all parameters of a node."""
    names = flatten(defaults)
    then = {name: value for name, value in BEHAVIOUR_THEN.items() if name in names}
    recorded = {
        name: values[name]
        for name in names
        if name in values or not name.startswith(NEWER_OPTIONS)
    }
    return override(defaults, then | recorded)


def _outcome(
    scenario: Scenario, params: PlannerParams, last_ns: int, last_pose: Pose2D
) -> Outcome:
    """The outcome of the run by the rules of the simulated world."""
    world = World(scenario, params.tick_ns, params.goal_tolerance_m)
    world.tick, world.pose = last_ns // params.tick_ns - 1, last_pose
    return world.outcome() or Outcome.INTERRUPTED
