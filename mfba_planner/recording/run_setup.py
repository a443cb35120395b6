# SPDX-License-Identifier: Apache-2.0
"""What a bag's configuration says about the run, of each robot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, TypeVar

from ..core.errors import BagError, ConfigError, InputError
from ..core.geometry import Pose2D
from ..core.options import flatten, override
from ..core.types import Decision
from ..perception.sensory_vector import SensorParams
from ..planning.planner_params import PlannerParams
from ..scenarios.scenario_files import load_scenario
from ..simulation.episode import Episode, Outcome
from ..simulation.fleet import scenarios_with_others
from ..simulation.scenario import Scenario
from ..simulation.world import World
from .bag_reader import BagReader
from .configuration import read_configuration
from .robot_topics import NO_NAMESPACE

T = TypeVar("T")

# Options younger than the oldest bags: what they default to is what was done then.
LATER = ("method", "jump_m", "scan_radius_m", "speed_limit.", "recovery.")


class Setup(NamedTuple):
    """What is said about one robot; of a fleet, the others stand at their starts."""

    scenario: Scenario
    sensor: SensorParams
    planner: PlannerParams
    seed: int
    driver: str
    lockstep: bool
    odom_frame: str = ""  # that its inputs must be in; "": any
    scan_frame: str = ""  # and its sensor's scans

    def episode(self, ticks: tuple[Decision, ...], truth: Mapping[int, Pose2D] = {}) -> Episode:
        """The Episode of these decisions, at least one; truth is where the robot was, by stamp."""
        true = tuple(truth.get(tick.stamp_ns, tick.pose) for tick in ticks) if truth else ()
        last = true[-1] if true else ticks[-1].pose
        return Episode(
            scenario=self.scenario,
            sensor=self.sensor,
            planner=self.planner,
            seed=self.seed,
            driver=self.driver,
            ticks=ticks,
            outcome=_outcome(self.scenario, self.planner, ticks[-1].stamp_ns, last),
            truth=true,
        )


class Setups(NamedTuple):
    """What was run: the scenario as it was given, its seed, and a Setup by robot, in its order."""

    scenario: Scenario
    seed: int
    by_robot: dict[str, Setup]


def read_setups(reader: BagReader) -> Setups:
    """The configuration a bag carries, checked. Raises BagError."""
    configuration = read_configuration(reader)
    nodes = configuration.get("nodes", {})
    try:
        world = nodes["world_sim"]
        scenario = load_scenario(world["scenario_json"])
        names = scenario.robot_names
        starts = [[Pose2D(*member.start_m)] for member in scenario.robots]
        worlds = scenarios_with_others(scenario, starts, world["tick_ns"]) if names else [scenario]
        found = {}
        for name, seen in zip(names or (NO_NAMESPACE,), worlds):
            above = f"{name}/" if name else ""
            planner, sensor = (nodes[above + node] for node in ("planner", "virtual_sensor"))
            found[name] = Setup(
                scenario=seen,
                sensor=_only(SensorParams(), sensor),
                planner=_only(PlannerParams(), planner),
                seed=planner["seed"],
                driver=configuration["run"].get("driver", "by hand"),
                lockstep=bool(planner["lockstep"]),
                odom_frame=planner.get("odom_frame", ""),
                scan_frame=sensor.get("scan_frame", ""),
            )
        alone = found.get(NO_NAMESPACE)
        return Setups(scenario, alone.seed if alone else world["seed"], found)
    except (ConfigError, InputError) as error:
        raise BagError(f"{reader.path}: {error}") from None
    except KeyError as error:
        raise BagError(
            f"{reader.path}: its configuration lacks {error}; record with `mfba run`"
        ) from None


def read_setup(reader: BagReader) -> Setup:
    """read_setups() of a robot that is alone; BagError for a fleet's bag."""
    found = read_setups(reader).by_robot
    if NO_NAMESPACE not in found:
        raise BagError(
            f"{reader.path}: holds {len(found)} robots, and a bag of one is read here; use "
            "mfba_planner.recording.read_episode.read_recording"
        )
    return found[NO_NAMESPACE]


def _only(defaults: T, values: dict[str, Any]) -> T:
    """The options of one dataclass out of all parameters of a node."""
    told = [name for name in flatten(defaults) if name in values or not name.startswith(LATER)]
    return override(defaults, {name: values[name] for name in told})


def _outcome(scenario: Scenario, params: PlannerParams, last_ns: int, last: Pose2D) -> Outcome:
    """How the run ended, judged as the simulated world judges it."""
    world = World(scenario, params.tick_ns, params.goal_tolerance_m)
    world.tick, world.pose = last_ns // params.tick_ns - 1, last
    return world.outcome() or Outcome.INTERRUPTED
