# SPDX-License-Identifier: Apache-2.0
"""The setup of one robot's run: scenario, parameters and seed, and the Episode made of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, TypeVar

from ..core.geometry import Pose2D, distance
from ..core.option_specs import flatten, override
from ..core.planner_types import Decision
from ..perception.no_return import NoReturn
from ..perception.sensory_vector import SensorParams
from ..planning.planner_params import PlannerParams
from ..simulation.episode import Episode, Outcome
from ..simulation.scenario import Scenario
from ..simulation.world import World

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
    is_simulated: bool = True  # false: the world is not known, the scenario only the trip
    start_ns: int | None = None  # stamp at time 0; None: see Episode

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
            outcome=self._outcome(ticks[-1].stamp_ns, last_pose),
            truth=true_poses,
            start_ns=self.start_ns,
        )

    def _outcome(self, last_ns: int, last_pose: Pose2D) -> Outcome:
        """The outcome of the run by the rules of the simulated world, or by the goal alone."""
        scenario, params = self.scenario, self.planner
        if not self.is_simulated:
            is_there = distance(last_pose.position, scenario.goal_m) <= params.goal_tolerance_m
            return Outcome.GOAL_REACHED if is_there else Outcome.INTERRUPTED
        world = World(scenario, params.tick_ns, params.goal_tolerance_m)
        world.tick, world.pose = last_ns // params.tick_ns - 1, last_pose
        return world.outcome() or Outcome.INTERRUPTED


def node_options(defaults: T, values: Mapping[str, Any]) -> T:
    """The options of one dataclass, from all parameters of a node."""
    names = flatten(defaults)
    then = {name: value for name, value in BEHAVIOUR_THEN.items() if name in names}
    recorded = {
        name: values[name]
        for name in names
        if name in values or not name.startswith(NEWER_OPTIONS)
    }
    return override(defaults, then | recorded)
