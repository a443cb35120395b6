# SPDX-License-Identifier: Apache-2.0
"""Obstacles that wait for a trigger: motion, contact and lidar before and after it; fleets."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import Point, Pose2D, distance
from mfba_planner.core.planner_types import NANO
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.evaluation.oracle import solve
from mfba_planner.evaluation.oracle.solution import Certificate
from mfba_planner.evaluation.suites.scenario_suite import read_scenario_files
from mfba_planner.evaluation.sweep.run_sweep import sweep
from mfba_planner.evaluation.sweep.summary import planner_summaries
from mfba_planner.evaluation.sweep.sweep_spec import SweepSpec, default_setting
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.peers.straight_line import Straight
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.scenarios.scenario_files import load_scenario, parse_scenario
from mfba_planner.scenarios.scenario_json import as_written, scenario_to_dict, scenario_to_json
from mfba_planner.scenarios.yaml_schema import checked
from mfba_planner.simulation.batched_motion import Motion
from mfba_planner.simulation.contact import clearance
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.fleet import run_fleet
from mfba_planner.simulation.obstacle_motion import Obstacle, Turn, Walls, pieces, velocity_at
from mfba_planner.simulation.robot_model import Lidar, Noise, Robot
from mfba_planner.simulation.run_episode import run
from mfba_planner.simulation.scenario import FleetRobot, Kidnapping, Scenario
from mfba_planner.simulation.triggered_motion import (
    is_waiting,
    may_be_absent,
    triggered,
    with_trigger,
)
from mfba_planner.simulation.triggers import after_triggers, before_triggers
from mfba_planner.simulation.world import World

WALLS = Walls(lower_m=(1.0, 1.0), upper_m=(8.0, 6.0))
PARAMS = PlannerParams()
HEAD = "name: waits\nstart_m: [0, 0]\ngoal_m: [9, 0]\nobstacles:\n"


def scenario(*obstacles: Obstacle, **more: object) -> Scenario:
    return Scenario(
        name="waits", start_m=(0.0, 0.0), goal_m=(9.0, 0.0), obstacles=obstacles,
        **more,  # type: ignore[arg-type]
    )  # fmt: skip


def straight(world: Scenario, seed: int = 0) -> Episode:
    """A robot that ignores obstacles."""
    return run(world, planner=PARAMS, path_planner=Straight(PARAMS, SensorParams(), 0), seed=seed)


def trigger_times(episode: Episode) -> list[float | None]:
    return [o.trigger.at_s if o.trigger else None for o in episode.scenario.obstacles]


# Coordinates in tenths, times in hundredths: far from every tie of rounding.
tenths = st.integers(20, 55).map(lambda n: n / 10)
points = st.tuples(tenths, tenths)
speeds = st.integers(1, 20).map(lambda n: n / 10)
headings = st.integers(0, 62).map(lambda n: n / 10)
times = st.integers(1, 400).map(lambda n: n / 100)


@st.composite
def motions(draw: st.DrawFn) -> Obstacle:
    """Straight, with a turn, or recorded (which may loop or stay); some vanish."""
    kind = draw(st.sampled_from(["straight", "turn", "recorded", "loop", "stays"]))
    center = draw(points)
    vanishes = draw(st.none() | times)
    if kind in ("straight", "turn"):
        turns = (Turn(at_s=draw(times), speed_mps=draw(speeds), heading_rad=draw(headings)),)
        return Obstacle(
            center_m=center, radius_m=0.3, speed_mps=draw(speeds), heading_rad=draw(headings),
            turns=turns if kind == "turn" else (), vanishes_s=vanishes,
        )  # fmt: skip
    stamps = sorted(draw(st.sets(st.integers(0, 40), min_size=2, max_size=5)))
    knots = [(n / 10, *draw(points)) for n in stamps]
    knots[0] = (knots[0][0], *center)
    assume(len({knot[1:] for knot in knots}) > 1)  # at rest for ever is refused
    return Obstacle(
        center_m=center, radius_m=0.3, trajectory=tuple(knots), loop=kind == "loop",
        stays=kind == "stays", vanishes_s=vanishes,
    )  # fmt: skip


def expected(
    motion: Obstacle, stands: bool, at_s: float, t_s: float, walls: Walls | None
) -> Point | None:
    """Where the obstacle has to be, by formulas of its own; None: absent."""
    u = t_s - at_s
    if u < 0.0:
        return motion.center_m if stands else None
    if motion.vanishes_s is not None and u > motion.vanishes_s:
        return None
    knots = motion.trajectory
    if not knots:
        x, y = motion.center_m
        stretches = [(0.0, motion.speed_mps, motion.heading_rad)]
        stretches += [(turn.at_s, turn.speed_mps, turn.heading_rad) for turn in motion.turns]
        for k, (begin, speed, heading) in enumerate(stretches):
            end = min(u, stretches[k + 1][0]) if k + 1 < len(stretches) else u
            if end > begin:
                x = bounced(x, speed * math.cos(heading), end - begin, walls, 0)
                y = bounced(y, speed * math.sin(heading), end - begin, walls, 1)
        return (x, y)
    first, last = knots[0][0], knots[-1][0]
    if u < first:
        return knots[0][1:] if stands or motion.stays else None
    if u > last and not (motion.loop or motion.stays):
        return None
    if motion.loop:
        u = first + math.fmod(u - first, last - first)
    return (
        float(np.interp(u, [k[0] for k in knots], [k[1] for k in knots])),
        float(np.interp(u, [k[0] for k in knots], [k[2] for k in knots])),
    )


def bounced(x: float, v: float, span_s: float, walls: Walls | None, axis: int) -> float:
    """Reflected at one wall after the other."""
    x += v * span_s
    if walls is not None:
        low, high = walls.lower_m[axis] + 0.3, walls.upper_m[axis] - 0.3
        while not low <= x <= high:
            x = 2.0 * (low if x < low else high) - x
    return x


def ties(motion: Obstacle, at_s: float) -> list[float]:
    """Times at which rounding decides between two sides of a jump."""
    knots = motion.trajectory
    found = [at_s, *(at_s + k[0] for k in knots)]
    found += [] if motion.vanishes_s is None else [at_s + motion.vanishes_s]
    if motion.loop:
        found += [at_s + knots[0][0] + n * (knots[-1][0] - knots[0][0]) for n in range(200)]
    return found


@given(
    motion=motions(),
    stands=st.booleans(),
    at_s=st.just(0.0) | times,
    asked=st.lists(st.integers(0, 1200).map(lambda n: n / 97), min_size=3, max_size=9),
    walled=st.booleans(),
)
def test_before_it_stands_or_is_absent_and_moves_as_ever_from_the_trigger_on(
    motion: Obstacle, stands: bool, at_s: float, asked: list[float], walled: bool
) -> None:
    walls = WALLS if walled else None
    one = with_trigger(motion, 1.0, absent_before=not stands)
    assert one.trigger is not None
    waits = scenario(one, walls=walls)
    started = scenario(triggered(one.trigger, at_s), walls=walls)
    asked = sorted({t for t in asked if all(abs(t - tie) > 1e-6 for tie in ties(motion, at_s))})
    assume(asked)
    for world, begin in ((started, at_s), (waits, math.inf)):
        batched = Motion(world).centers(np.array(asked))
        for k, t in enumerate(asked):
            center = world.centers(t)[0]
            assert np.array_equal(batched[:, k, 0], center, equal_nan=True)
            wanted = expected(motion, stands, begin, t, walls)
            held = pieces(world.obstacles[0], t, t, walls)
            if wanted is None:
                assert math.isnan(center[0])
                assert not held
                assert may_be_absent(one)
                continue
            assert center == pytest.approx(wanted, abs=1e-7)
            assert held[0][2] == pytest.approx(wanted, abs=1e-7)
            later = expected(motion, stands, begin, t + 1e-7, walls)
            if later is not None and motion.trajectory:
                moved = [(b - a) / 1e-7 for a, b in zip(wanted, later)]
                assert velocity_at(world.obstacles[0], t, walls) == pytest.approx(moved, abs=1e-3)


@given(motion=motions(), stands=st.booleans(), at_s=times, y=tenths)
def test_the_gap_of_a_step_is_the_least_of_dense_samples(
    motion: Obstacle, stands: bool, at_s: float, y: float
) -> None:
    one = with_trigger(motion, 1.0, absent_before=not stands)
    assert one.trigger is not None
    world = scenario(triggered(one.trigger, at_s))
    times_s, positions = (
        np.arange(21) * 0.37,
        np.array([np.linspace(1.0, 6.0, 21), np.full(21, y)]),
    )
    steps = Motion(world).steps(times_s, positions)
    for k in range(20):
        (x0, x1), (t0, t1) = positions[0, k : k + 2].tolist(), times_s[k : k + 2].tolist()
        exact = clearance(world, world.obstacles[0], t0, t1, (x0, y), (x1, y))
        assert steps.gap_m[k, 0] == pytest.approx(exact, abs=1e-9)
        sampled = math.inf
        for share in np.linspace(0.0, 1.0, 101).tolist():
            center = expected(motion, stands, at_s, t0 + share * (t1 - t0), None)
            if center is not None:
                sampled = min(sampled, distance(center, (x0 + share * (x1 - x0), y)) - 0.6)
        if not math.isinf(sampled) and not math.isinf(exact):
            assert exact <= sampled + 1e-6
            assert sampled <= exact + 0.15 + (1.0 if motion.loop else 0.0)


CROSSES = Obstacle(center_m=(5.0, 2.0), radius_m=0.3, speed_mps=1.0, heading_rad=-math.pi / 2)


def first_within(episode: Episode, point: Point, within_m: float) -> float | None:
    """The time of the first tick within the distance."""
    poses = episode.truth or [tick.pose for tick in episode.ticks]
    for number, pose in enumerate(poses):
        if math.hypot(pose.x - point[0], pose.y - point[1]) <= within_m:
            return number * PARAMS.tick_ns * NANO
    return None


@pytest.mark.parametrize("noise", [Noise(), Noise(odom_m=0.3, odom_latency_s=0.5)])
def test_it_starts_at_the_first_tick_with_the_robot_within(noise: Noise) -> None:
    near, at_point, never = (
        with_trigger(CROSSES, 2.5),
        with_trigger(CROSSES, 0.7, (7.0, 0.5), absent_before=True),
        with_trigger(CROSSES, 1.9),
    )
    ended: list[Scenario] = []
    world = scenario(near, at_point, never, robot=Robot(noise=noise))
    episode = run(
        world, planner=PARAMS, path_planner=Straight(PARAMS, SensorParams(), 0), seed=3,
        go_on=lambda now: not ended.append(now.scenario),  # type: ignore[func-returns-value]
    )  # fmt: skip
    wanted = [
        first_within(episode, (5.0, 2.0), 2.5), first_within(episode, (7.0, 0.5), 0.7),
        first_within(episode, (5.0, 2.0), 1.9),
    ]  # fmt: skip
    assert trigger_times(episode) == wanted
    assert wanted[0] is not None
    assert wanted[1] is not None
    assert ended[-1] == episode.scenario
    assert before_triggers(episode.scenario) == world
    assert (
        run(
            episode.scenario,
            planner=PARAMS,
            path_planner=Straight(PARAMS, SensorParams(), 0),
            seed=3,
        )
        == episode
    )


def test_contact_is_that_of_the_motion_after_the_trigger() -> None:
    def gap(obstacle: Obstacle) -> float:
        return evaluate(straight(scenario(obstacle))).min_clearance_m

    plain = straight(scenario(with_trigger(CROSSES, 2.5)))
    (at_s,) = trigger_times(plain)
    assert at_s is not None
    speed = PARAMS.speed_mps
    moments = np.linspace(0.0, 9.0 / speed, 200_001)
    y = 2.0 - np.maximum(0.0, moments - at_s)
    by_hand = float(np.hypot(speed * moments - 5.0, y).min()) - 0.6
    assert gap(with_trigger(CROSSES, 2.5)) == pytest.approx(by_hand, abs=1e-3)
    assert gap(with_trigger(CROSSES, 1.9)) == pytest.approx(1.4, abs=1e-3)  # it never starts
    appears = with_trigger(replace(CROSSES, center_m=(5.0, 0.0)), 0.5, absent_before=True)
    assert evaluate(straight(scenario(appears))).collisions == 1
    absent = with_trigger(replace(CROSSES, center_m=(5.0, 0.0)), 1.0, (5.0, 8.0),
                          absent_before=True)  # fmt: skip
    assert evaluate(straight(scenario(absent))).min_clearance_m == math.inf


def test_the_lidar_measures_it_where_it_is() -> None:
    robot = Robot(lidar=Lidar(beams=360, range_max_m=9.0))
    for x, begin in ((0.0, 0.0), (-0.4, 0.5), (-0.6, 0.5)):
        task = scenario(with_trigger(CROSSES, 1.0, (1.0, 0.0)), robot=robot)
        world = World(replace(task, start_m=(x, 0.0)), 10**8, 0.02)
        for tick in range(20):
            if tick:
                world.follow(Pose2D(x if tick < 5 else 0.0, 0.0))
            scan = world.read().scan
            assert scan is not None
            y = 2.0 - max(0.0, tick * 0.1 - begin)
            here = world.pose.position
            assert min(scan.ranges_m) == pytest.approx(distance(here, (5.0, y)) - 0.3, abs=4e-3)
            assert velocity_at(world.scenario.obstacles[0], world.time_s) == pytest.approx(
                (0.0, 0.0) if tick * 0.1 < begin else (0.0, -1.0), abs=1e-12
            )
            assert world.velocity(0) == velocity_at(world.scenario.obstacles[0], world.time_s)


def test_a_world_begins_with_all_triggers_unreached() -> None:
    done = straight(scenario(with_trigger(CROSSES, 2.5))).scenario
    assert not is_waiting(done.obstacles[0])
    assert is_waiting(World(done, PARAMS.tick_ns, 0.02).scenario.obstacles[0])
    moments = [(0.0, [(0.0, 0.0)]), (1.5, [(0.0, 0.0), (5.0, 0.0)]), (2.0, [(5.0, 2.0)])]
    found = after_triggers(before_triggers(done), moments).obstacles[0].trigger
    assert found is not None
    assert found.at_s == 1.5
    assert after_triggers(done, moments) is done  # what has started is left as it is


def test_a_kidnapped_robot_reaches_a_trigger_where_it_is_put() -> None:
    kidnapping = Kidnapping(at_s=2.0, to_m=(5.0, 2.0))  # upon the obstacle: allowed, as it may be
    world = scenario(with_trigger(CROSSES, 1.0), kidnappings=(kidnapping,))
    (at_s,) = trigger_times(straight(world))
    assert at_s == first_within(straight(world), (5.0, 2.0), 1.0)
    assert at_s is not None
    assert 2.0 <= at_s < 2.0 + PARAMS.tick_ns * NANO


def fleet() -> Scenario:
    """Robot b reaches the trigger, and after it a."""
    robots = (
        FleetRobot(name="a", start_m=(0.0, 0.0), goal_m=(9.0, 0.0)),
        FleetRobot(name="b", start_m=(6.0, -3.0), goal_m=(6.0, 0.0)),
    )
    return scenario(with_trigger(CROSSES, 2.5), robots=robots)


def test_any_robot_of_a_fleet_reaches_a_trigger_for_all() -> None:
    a, b = run_fleet(
        fleet(), planner=PARAMS, path_planner=lambda _: Straight(PARAMS, SensorParams(), 0)
    )
    (first, *_), (same, *_) = trigger_times(a), trigger_times(b)
    wanted = first_within(b, (5.0, 2.0), 2.5)
    assert first == same == wanted
    assert wanted is not None
    alone = first_within(a, (5.0, 2.0), 2.5)
    assert alone is not None
    assert wanted < alone


def test_a_trigger_comes_back_from_its_text_and_is_that_of_the_file() -> None:
    text = HEAD + (
        "  - {center_m: [5, 2], radius_m: 0.3, speed_mps: 1, trigger: {within_m: 2}}\n"
        "  - {radius_m: 0.3, trajectory: [[0, 3, 4], [1.5, 3, 2]], loop: true, trigger:\n"
        "     {within_m: 1, point_m: [2, 0], absent_before: true}, vanishes_s: 9, appears_s: 1}\n"
    )
    world = parse_scenario(text, "waits.yaml")
    one, two = (o.trigger for o in world.obstacles)
    assert one is not None
    assert two is not None
    assert (one.within_m, one.point_m, one.absent_before) == (2.0, (5.0, 2.0), False)
    assert (two.within_m, two.point_m, two.absent_before) == (1.0, (2.0, 0.0), True)
    assert (two.motion.appears_s, two.motion.vanishes_s, two.motion.loop) == (1.0, 9.0, True)
    plain = json.loads(scenario_to_json(world))
    assert plain["obstacles"][0]["trigger"] == {"within_m": 2.0, "point_m": [5.0, 2.0]}
    assert load_scenario(json.dumps(plain)) == as_written(plain) == checked(plain) == world
    done = after_triggers(world, [(3.0, [(5.0, 2.0), (2.0, 0.0)])])
    assert done != world
    assert scenario_to_dict(done) == plain  # the file is of the task, not of a run
    without = scenario_to_dict(scenario(CROSSES))["obstacles"][0]
    assert "trigger" not in without


@pytest.mark.parametrize(
    ("obstacle", "reason"),
    [
        ("speed_mps: 1, trigger: {}", "obstacles.1.trigger.within_m: missing"),
        ("speed_mps: 1, trigger: {within_m: 0}", "within_m=0: refused; give a number greater"),
        ("speed_mps: 1, trigger: {within_m: .inf}", "within_m=inf: refused; give a"),
        ("speed_mps: 1, trigger: {within_m: 1, point_m: [1]}", "point_m.2: missing"),
        ("speed_mps: 1, trigger: {within_m: 1, point_m: 3}", "point_m=3: refused; give two numb"),
        ("speed_mps: 1, trigger: {within_m: 1, absent_before: 7}", "absent_before=7: refused; gi"),
        ("speed_mps: 1, trigger: 2", "trigger=2: refused; give a mapping"),
        ("speed_mps: 1, trigger: {within: 1}", "unknown key; did you mean 'within_m'?"),
        ("speed_mps: 1, triger: {within_m: 1}", "unknown key; did you mean 'trigger'?"),
        ("trigger: {within_m: 1}", "obstacle 1 trigger: nothing to start; give the obstacle a mo"),
        (
            "speed_mps: 1, appears_s: 2, trigger: {within_m: 1}",
            "obstacle 1 appears_s=2: with a trigger it stands there before; leave appears_s out",
        ),
        (
            "trajectory: [[0, 3, 3], [1.0e-9, 4, 4]], trigger: {within_m: 1}",
            "t=0 and t=1e-09 are less than 1e-06 s apart; with a trigger, leave one of them out",
        ),
        ("loop: true, speed_mps: 1, trigger: {within_m: 1}", "loop: without a trajectory"),
    ],
)
def test_the_door_says_what_is_wrong(obstacle: str, reason: str) -> None:
    center = "" if "trajectory:" in obstacle else "center_m: [3, 3], "
    text = f"{HEAD}  - {{radius_m: 0.3, {center}{obstacle}}}\n"
    with pytest.raises(ConfigError) as refused:
        parse_scenario(text, "waits.yaml")
    assert reason in str(refused.value)
    assert "\n" not in str(refused.value)


def test_the_robot_starts_free_of_what_stands_and_of_what_appears_at_once() -> None:
    over = replace(CROSSES, center_m=(0.2, 0.0))
    for one in (with_trigger(over, 9.0), with_trigger(over, 9.0, absent_before=True)):
        with pytest.raises(ConfigError, match=r"starts 0\.4 m inside obstacle 1"):
            scenario(one)
    scenario(with_trigger(over, 1.0, (5.0, 0.0), absent_before=True))  # it appears later
    stands_outside = replace(CROSSES, center_m=(0.0, 5.0))
    with pytest.raises(ConfigError, match="not inside the walls"):
        scenario(with_trigger(stands_outside, 1.0), walls=WALLS)


def test_the_oracle_does_not_decide_and_a_sweep_goes_on(tmp_path: Path) -> None:
    solution = solve(scenario(CROSSES, with_trigger(CROSSES, 2.5)), 1.0)
    assert solution.certificate is Certificate.UNDECIDED
    assert solution.reason == "obstacle 2 waits for a trigger: its motion depends on the path"
    folder = tmp_path / "worlds"
    folder.mkdir()
    waits = "  - {center_m: [5, 2], radius_m: 0.3, speed_mps: 1, trigger: {within_m: 2.5}}\n"
    (folder / "a.yaml").write_text(HEAD + waits, encoding="utf-8")
    plain = HEAD.replace("waits", "plain") + "  - {center_m: [5, 2], radius_m: 0.3}\n"
    (folder / "b.yaml").write_text(plain, encoding="utf-8")
    scenarios, left_out = read_scenario_files([str(folder)])
    assert left_out == []
    spec = SweepSpec(
        suite=scenarios.name, planners=("straight", "paper"), worlds=2,
        setting=default_setting(scenarios.name, scenarios),
    )  # fmt: skip
    rows = sweep(spec).rows
    waiting = [row for row in rows if row["world"] == 0]
    plain_ones = [row for row in rows if row["world"] == 1]
    assert {row["planner"] for row in waiting} == {"straight", "paper"}
    for found, certificate, is_left_out in (
        (waiting, "undecided", True),
        (plain_ones, "feasible", False),
    ):
        assert {row["certificate"] for row in found} == {certificate}
        for name in ("survivability", "optimum_m", "spl"):
            assert {row[name] is None for row in found} == {is_left_out}
    alone = evaluate(straight(scenarios.suite().world(0))).min_clearance_m
    assert {r["min_clearance_m"] for r in waiting if r["planner"] == "straight"} == {alone}
    assert [str(line) for line in planner_summaries(rows, [])]
