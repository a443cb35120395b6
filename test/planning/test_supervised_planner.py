# SPDX-License-Identifier: Apache-2.0
"""Supervision of any planner: no progress ends by name in bounded time; predictive recovers."""

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import groupby

import numpy as np
import pytest

from mfba_planner.core.geometry import Pose2D, distance
from mfba_planner.core.option_specs import override
from mfba_planner.core.planner_types import Circle, Decision, Mode, Observation, Scan
from mfba_planner.perception.sensory_vector import SensorParams, sense_circles
from mfba_planner.perception.static_map import StaticMap
from mfba_planner.planning.planner_factory import make_planner
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.planning.recovery import Phase
from mfba_planner.planning.supervised_planner import HasSurroundings, SupervisedPlanner
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.run_episode import simulate

GOAL = (9.0, 0.0)
QUICK = {
    "progress.time_allowance_s": 4.0,
    "progress.detour_allowance_s": 30.0,
    "recovery.wait_s": 1.0,
    "recovery.attempts": 2,
}
WALL = tuple(
    Circle(center_m=(2.0, 0.4 * k), radius_m=0.6) for k in range(-30, 31)
)  # far too long to drive round
RING = tuple(
    Circle(center_m=(0.7 * math.cos(a), 0.7 * math.sin(a)), radius_m=0.6)
    for a in (math.radians(30 * k) for k in range(12))
)
METHODS = pytest.mark.parametrize("method", list(Method), ids=lambda m: m.value)


def params(method: Method, **options: float | bool) -> PlannerParams:
    chosen = PlannerParams(method=method, speed_mps=0.8)
    if method is Method.PREDICTIVE:
        chosen = preset(chosen)
    return override(chosen, {**QUICK, **options})


class Trip:
    """An omnidirectional robot that follows the decisions among circles at rest."""

    def __init__(self, chosen: PlannerParams, circles: tuple[Circle, ...]) -> None:
        self.planner: SupervisedPlanner = make_planner(chosen, SensorParams(), seed=1)
        self.circles, self.goal = circles, GOAL
        self.pose, self.stamp_ns = Pose2D(0.0, 0.0), 10**9
        self.decisions: list[Decision] = []
        self.phases: list[Phase] = []

    def tick(self) -> Decision:
        known = [(c.center_m, c.radius_m) for c in self.circles]
        near = [c for c in self.circles if distance(c.center_m, self.pose.position) < 2.0]
        obs = Observation(
            stamp_ns=self.stamp_ns, now_ns=self.stamp_ns, pose=self.pose, goal=self.goal,
            ranges_m=sense_circles(self.pose.position, known, SensorParams()),
            circles=tuple(near),
        )  # fmt: skip
        decision = self.planner.plan(obs)
        tick_ns = self.planner.params.tick_ns
        vx, vy = decision.velocity
        self.stamp_ns += tick_ns
        self.pose = Pose2D(self.pose.x + vx * tick_ns * 1e-9, self.pose.y + vy * tick_ns * 1e-9)
        self.decisions.append(decision)
        self.phases.append(self.planner.phase)
        return decision

    def drive(self, seconds: float, until: Callable[[], bool] = lambda: False) -> float:
        """Drive for that time, or until a condition holds; the simulated seconds it took."""
        start_ns = self.stamp_ns
        while not until() and self.stamp_ns - start_ns < seconds * 1e9:
            self.tick()
        return (self.stamp_ns - start_ns) * 1e-9

    def gave_up(self) -> bool:
        return self.planner.phase is Phase.GIVEN_UP


@METHODS
@pytest.mark.parametrize("enabled", [False, True])
def test_to_and_fro_before_a_wall_ends_by_name_in_bounded_time(
    method: Method, enabled: bool
) -> None:
    trip = Trip(params(method, **{"recovery.enabled": enabled}), WALL)
    took_s = trip.drive(120.0, trip.gave_up)
    assert trip.gave_up()
    assert took_s < 30.0 + 3 * (4.0 + 1.0 + 1.0 + 1.0), "detour, tries, waits, back off"
    sequence = [phase.value for phase, _ in groupby(trip.phases)]
    again = ["wait", "back_off", "replan"]
    assert sequence == ["free", *again, "free", *again, "free", "wait", "given_up"]
    for decision, phase in zip(trip.decisions, trip.phases):
        if phase is not Phase.FREE:
            assert decision.mode is Mode.BLOCKED
            if not (enabled and phase is Phase.BACK_OFF):
                assert decision.velocity == (0.0, 0.0)
    first = next(d for d, p in zip(trip.decisions, trip.phases) if p is Phase.WAIT)
    assert first.reason.startswith("no progress: 0.")
    assert first.reason.endswith("; waiting for 0.0 s")
    last = trip.decisions[-1].reason
    assert last.startswith("gave up after 2 attempts, no progress: 0.")
    assert last.endswith("; send a goal to go on")
    trip.drive(10.0)
    assert trip.gave_up()
    assert trip.decisions[-1].velocity == (0.0, 0.0)
    trip.goal = (-9.0, 0.0)
    trip.drive(20.0, lambda: trip.decisions[-1].mode is Mode.ARRIVED)
    assert trip.decisions[-1].mode is Mode.ARRIVED
    assert trip.planner.phase is Phase.FREE


@METHODS
def test_with_0_it_drives_on_for_ever(method: Method) -> None:
    trip = Trip(params(method, **{"progress.time_allowance_s": 0.0}), WALL)
    trip.drive(60.0)
    assert set(trip.phases) == {Phase.FREE}


@METHODS
def test_a_robot_that_waits_blocked_is_left_to_its_recovery(method: Method) -> None:
    """Without recovery.enabled it waits for ever, at rest, as Algorithm 1 does."""
    trip = Trip(params(method), RING)
    trip.drive(30.0)
    assert {d.mode for d in trip.decisions} == {Mode.BLOCKED}
    assert {d.velocity for d in trip.decisions} == {(0.0, 0.0)}
    trip.circles = ()
    assert trip.tick().velocity != (0.0, 0.0)


def test_enclosed_predictive_recovers_and_gives_up_as_algorithm_1_does() -> None:
    sequences = {}
    for method in Method:
        trip = Trip(params(method, **{"recovery.enabled": True}), RING)
        trip.drive(30.0, trip.gave_up)
        sequences[method] = [phase.value for phase, _ in groupby(trip.phases)]
        assert (
            min(distance(d.pose.position, c.center_m) for d in trip.decisions for c in RING) > 0.6
        )
    assert sequences[Method.PAPER][-1] == "given_up"
    assert sequences[Method.PREDICTIVE] == sequences[Method.PAPER]
    assert ", enclosed by 12 obstacles at rest, the nearest 0.1" in trip.decisions[-1].reason


def test_without_sectors_it_backs_off_by_the_circles() -> None:
    """A ring with more room on one side, and no sectors in the observation."""
    trip = Trip(params(Method.PREDICTIVE, **{"recovery.enabled": True}), RING)
    wider = [
        replace(c, center_m=(1.3 * c.center_m[0], c.center_m[1])) if c.center_m[0] < -0.1 else c
        for c in RING
    ]
    obs = Observation(
        stamp_ns=10**9, now_ns=10**9, pose=trip.pose, goal=GOAL, ranges_m=(), circles=tuple(wider)
    )
    moved = []
    for tick in range(20):
        stamp = 10**9 + tick * 10**8
        decision = trip.planner.plan(replace(obs, stamp_ns=stamp, now_ns=stamp))
        if trip.planner.phase is Phase.BACK_OFF:
            moved.append(decision.velocity)
    assert moved
    assert all(x < 0.0 for x, _ in moved)


def test_it_does_not_back_off_to_where_no_beam_has_covered() -> None:
    """A lidar of 270 degrees that looks to +x, and sectors that are free behind."""
    chosen = params(Method.PREDICTIVE, **{"recovery.enabled": True})
    angles = np.radians(np.arange(-135.0, 135.5))
    scan = Scan(
        ranges_m=np.where(np.abs(angles) < 1.0, 0.5, np.inf), angle_min_rad=float(angles[0]),
        angle_increment_rad=math.radians(1.0), range_min_m=0.1, range_max_m=3.5,
    )  # fmt: skip
    planner = make_planner(chosen)
    obs = Observation(
        stamp_ns=10**9, now_ns=10**9, pose=Pose2D(0.0, 0.0), goal=GOAL, scan=scan,
        ranges_m=(0.2, math.inf, *[math.inf] * 8, math.inf, 0.2),
    )  # fmt: skip
    planner.plan(obs)
    assert isinstance(planner.inner, HasSurroundings)
    ranges = planner.inner.surroundings((0.0, 0.0))
    # From 75 degrees on, its body would sweep what is not covered.
    assert {i + 1 for i, r in enumerate(ranges) if r == 0.0} == {3, 4, 5, 6, 7, 8, 9, 10}
    assert ranges[0] == pytest.approx(0.2, abs=0.05)


def test_without_sectors_the_speed_limit_knows_the_circles() -> None:
    limited = params(Method.PREDICTIVE, **{"speed_limit.slow_within_m": 0.8})
    behind = Circle(center_m=(-1.0, 0.0), radius_m=0.6)
    obs = Observation(
        stamp_ns=10**9, now_ns=10**9, pose=Pose2D(0.0, 0.0), goal=GOAL, ranges_m=(),
        circles=(behind,),
    )  # fmt: skip
    decision = make_planner(limited).plan(obs)
    assert math.hypot(*decision.velocity) == pytest.approx(0.5 * 0.8)
    assert decision.reason.endswith("50 % speed so near")


@METHODS
@pytest.mark.parametrize("case", ["case1", "case2"])
def test_the_case_studies_are_decided_as_without_it(case: str, method: Method) -> None:
    chosen = PlannerParams(method=method)
    if method is Method.PREDICTIVE:
        chosen = preset(chosen)
    off = override(chosen, {"progress.time_allowance_s": 0.0})
    found = {
        digest(simulate(load_scenario(case), planner=p, sensor=SensorParams(), seed=2).ticks)
        for p in (chosen, off)
    }
    assert len(found) == 1


def test_the_local_map_is_that_of_the_wrapped_planner_and_new_after_a_reset() -> None:
    assert make_planner(PlannerParams()).local_map is None
    planner = make_planner(PlannerParams(method=Method.PREDICTIVE))
    first = planner.local_map
    assert isinstance(first, StaticMap)
    assert planner.local_map is first
    planner.reset()
    assert planner.local_map is not first
