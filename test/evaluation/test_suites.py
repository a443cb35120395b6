# SPDX-License-Identifier: Apache-2.0
"""Suites: reproducible worlds, valid scenarios, difficulty."""

import math
import pickle
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import distance
from mfba_planner.evaluation.suites import suite, suite_names
from mfba_planner.evaluation.suites.adversarial_worlds import FAMILIES, adversarial_obstacles
from mfba_planner.evaluation.suites.random_crowds import CrowdParams, Motion, crowd
from mfba_planner.evaluation.suites.survivability import first_contact_s, survivability
from mfba_planner.evaluation.suites.task_geometry import Trip
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.scenarios.scenario_json import scenario_to_json
from mfba_planner.simulation.constant_velocity_segments import uniform_segments
from mfba_planner.simulation.contact import step_clearances
from mfba_planner.simulation.obstacle_motion import Obstacle, Turn, Walls, center_at
from mfba_planner.simulation.scenario import Scenario

# centre, speed and heading of the first obstacle of random-10, world 0
GOLDEN = (7.269229725556283, 2.5850024987816624, 0.2851093287992198, -3.0053334499216913)
GENERATED = [name for name in suite_names() if name != "paper"]


def refusal(call: object) -> str:
    assert callable(call)
    with pytest.raises(ConfigError) as caught:
        call()
    message = str(caught.value)
    assert "\n" not in message
    return message


def task(*obstacles: Obstacle, walls: Walls | None = None) -> Scenario:
    return Scenario(
        name="x", start_m=(0.0, 0.0), goal_m=(12.0, 12.0), obstacles=obstacles, walls=walls
    )


# --- names ------------------------------------------------------------------------------------


def test_the_suites_of_the_benchmark_exist() -> None:
    assert suite_names() == [
        "paper",
        "random-3",
        "random-10",
        "random-20",
        "random-30",
        "dense",
        "adversarial",
        "turning",
        "fast-10",
        "fast-20",
        "dynabarn-like",
        "pedestrians",
        "rooms",
        "barn-like",
        "crowd",
    ]
    assert len({suite(name).number for name in suite_names()}) == len(suite_names())


def test_numbers_of_published_suites_do_not_change() -> None:
    """They are in the seeds of the worlds; the name is not."""
    assert {suite(name).number for name in ("dense", "adversarial", "turning")} == {101, 102, 103}
    assert [suite(name).number for name in ("rooms", "barn-like", "crowd")] == [106, 107, 108]
    assert [suite(f"random-{n}").number for n in (3, 10, 20, 30)] == [3, 10, 20, 30]


def test_an_unknown_suite_is_refused_with_the_nearest_name() -> None:
    assert refusal(lambda: suite("random-31")) == (
        "'random-31': no such suite; did you mean 'random-3'?"
    ) or "random-30" in refusal(lambda: suite("random-31"))
    assert refusal(lambda: suite("adversary")) == (
        "'adversary': no such suite; did you mean 'adversarial'?"
    )
    assert "known: adversarial, barn-like, crowd, dense," in refusal(lambda: suite("zzz"))


def test_numbers_that_make_no_sense_are_refused() -> None:
    entry = suite("random-3")
    assert refusal(lambda: entry.world(-1)) == "k=-1: negative; worlds are counted from 0"
    assert "seed=-1: negative" in refusal(lambda: suite("random-3", seed=-1))
    for speed in (0.0, -0.8, math.nan, math.inf):
        assert "no speed; give a number above 0" in refusal(lambda s=speed: entry.world(0, s))


# --- reproducibility --------------------------------------------------------------------------


@pytest.mark.parametrize("name", suite_names())
def test_world_k_does_not_depend_on_what_was_made_before(name: str) -> None:
    forwards = [suite(name).world(k) for k in range(6)]
    entry = suite(name)
    backwards = [entry.world(k) for k in reversed(range(6))]
    assert forwards == backwards[::-1]


@pytest.mark.parametrize("name", GENERATED)
def test_worlds_differ_in_k_and_seed(name: str) -> None:
    worlds = [suite(name, seed=seed).world(k) for seed in (0, 1) for k in range(5)]
    assert len({(world.obstacles, world.segments_m) for world in worlds}) == 10


@pytest.mark.parametrize("name", suite_names())
def test_suites_can_be_pickled(name: str) -> None:
    entry = suite(name, seed=3)
    again = pickle.loads(pickle.dumps(entry))
    assert (again.name, again.seed) == (entry.name, 3)
    assert again.world(4) == entry.world(4)


def test_suites_do_not_share_their_obstacles() -> None:
    three, ten = suite("random-3").world(0), suite("random-10").world(0)
    assert not set(three.obstacles) & set(ten.obstacles)


def test_a_published_world_does_not_change() -> None:
    first = suite("random-10").world(0).obstacles[0]
    again = (*first.center_m, first.speed_mps, first.heading_rad)
    assert again == pytest.approx(GOLDEN, abs=1e-12)


def test_the_paper_suite_repeats_both_case_studies() -> None:
    paper = suite("paper")
    assert [paper.world(k).name for k in range(4)] == ["case1", "case2"] * 2
    assert paper.world(5) == load_scenario("case2")
    assert [paper.world_number(k) for k in range(4)] == [0, 1, 0, 1]
    assert suite("dense").world_number(7) == 7


@pytest.mark.parametrize("name", suite_names())
def test_every_world_is_an_ordinary_scenario(name: str) -> None:
    for k in range(5):
        world = suite(name).world(k)
        assert load_scenario(scenario_to_json(world)) == world


# --- contents ---------------------------------------------------------------------------------


@pytest.mark.no_cover
@pytest.mark.parametrize("name", GENERATED)
def test_start_and_goal_are_free(name: str) -> None:
    for k in range(10 if name == "crowd" else 40):
        world = suite(name).world(k)
        for obstacle in world.obstacles:
            free = world.enlarged_radius(obstacle)
            assert distance(obstacle.center_m, world.start_m) >= free
            assert distance(obstacle.center_m, world.goal_m) >= free


@pytest.mark.parametrize("n", [3, 10, 20, 30])
def test_random_worlds_are_those_of_the_readings(n: int) -> None:
    obstacles = [o for k in range(60) for o in suite(f"random-{n}").world(k).obstacles]
    assert len(obstacles) == 60 * n
    assert {o.radius_m for o in obstacles} == {0.3}
    speeds = [o.speed_mps for o in obstacles]
    assert 0.1 <= min(speeds) < 0.12 < 0.28 < max(speeds) <= 0.3
    quadrants = {math.floor(o.heading_rad / (math.pi / 2.0)) for o in obstacles}
    assert quadrants == {-2, -1, 0, 1}
    walls = suite(f"random-{n}").world(0).walls
    assert walls == Walls(lower_m=(0.0, 0.0), upper_m=(12.0, 12.0))


def test_kinds_of_crowds() -> None:
    def drawn(**changes: object) -> tuple[Obstacle, ...]:
        params = CrowdParams(obstacles=50, **changes)  # type: ignore[arg-type]
        return crowd(params, np.random.Generator(np.random.PCG64(1)))

    assert {o.speed_mps for o in drawn(motion=Motion.STATIC)} == {0.0}
    assert {o.turns for o in drawn()} == {()}
    assert sum(o.speed_mps == 0.0 for o in drawn(static_share=0.5)) in range(10, 41)
    radii = [o.radius_m for o in drawn(radius_min_m=0.1, radius_max_m=0.5)]
    assert 0.1 <= min(radii) < 0.2 < 0.4 < max(radii) <= 0.5
    for obstacle in drawn(motion=Motion.PIECEWISE, turn_every_s=4.0, turns_until_s=50.0):
        times = [0.0, *(turn.at_s for turn in obstacle.turns)]
        assert all(2.0 <= b - a <= 6.0 for a, b in pairwise(times))
        assert 44.0 <= times[-1] < 50.0
        assert all(0.1 <= turn.speed_mps <= 0.3 for turn in obstacle.turns)


def test_invalid_crowds_are_refused() -> None:
    assert refusal(lambda: CrowdParams(speed_min_mps=0.5)) == (
        "speed_min_mps=0.5: above speed_max_mps=0.3; give the smaller one first"
    )
    assert "obstacles=-1: out of range" in refusal(lambda: CrowdParams(obstacles=-1))
    assert CrowdParams(obstacles=36).density == 0.25


# --- adversarial worlds -----------------------------------------------------------------------


def test_adversarial_families_alternate() -> None:
    names = [suite("adversarial").world(k).name for k in range(6)]
    assert names == [
        "adversarial-0-pincers",
        "adversarial-1-streams",
        "adversarial-2-chasers",
        "adversarial-3-corridor",
        "adversarial-4-closing-gap",
        "adversarial-5-pincers",
    ]


@pytest.mark.parametrize("speed", [0.4, 0.8, 1.6])
@pytest.mark.parametrize("family", FAMILIES)
def test_adversarial_obstacles_hit_the_straight_trip_but_are_slower(
    family: str, speed: float
) -> None:
    trip = Trip(speed_mps=speed)
    struck = 0
    for seed in range(30):
        obstacles = adversarial_obstacles(family, trip, np.random.Generator(np.random.PCG64(seed)))
        world = task(*obstacles)
        assert all(o.top_speed_mps <= 0.6 * speed for o in obstacles)
        gaps = step_clearances(world, 0.0, trip.time_s, trip.at(0.0), trip.at(trip.time_s))
        struck += min(gaps) < 0.0
    assert struck >= 15, "fewer than half of the worlds hit the straight trip"


def test_chasers_come_nearer_to_the_trip() -> None:
    trip = Trip(speed_mps=0.8)
    world = suite("adversarial").world(2, 0.8)
    for obstacle in world.obstacles:
        nearest = min(
            distance(center_at(obstacle, t), trip.at(t)) for t in np.arange(0.0, 21.0, 0.1)
        )
        assert nearest < distance(obstacle.center_m, trip.at(0.0))
        assert len(obstacle.turns) >= 10


# --- difficulty -------------------------------------------------------------------------------


def test_an_empty_world_is_survived() -> None:
    found = survivability(task(), 0.8)
    assert (found.share, found.positions) == (1.0, 100)
    assert found.mean_time_s == pytest.approx(12.0 * math.sqrt(2.0) / 0.8)


def test_survival_by_hand() -> None:
    # sweeps the rows of positions within 0.6 m of y = 6: 5.4 (on the edge, by rounding) and 6.6
    sweeper = Obstacle(center_m=(-1.0, 6.1), radius_m=0.3, speed_mps=10.0)
    found = survivability(task(sweeper), 0.8)
    assert found.share == pytest.approx(0.9)
    assert found.positions == 100


def test_positions_inside_an_obstacle_do_not_count() -> None:
    post = Obstacle(center_m=(6.6, 6.6), radius_m=0.3)
    found = survivability(task(post), 0.8)
    assert (found.share, found.positions) == (1.0, 99)
    full = Obstacle(center_m=(6.0, 6.0), radius_m=8.0)
    assert survivability(task(full), 0.8).positions < 10


MOTIONS = st.builds(
    Obstacle,
    center_m=st.tuples(st.floats(1.0, 11.0), st.floats(1.0, 11.0)),
    radius_m=st.floats(0.05, 0.9),
    speed_mps=st.floats(0.0, 3.0),
    heading_rad=st.floats(-4.0, 4.0),
    turns=st.lists(
        st.tuples(st.floats(0.1, 19.0), st.floats(0.0, 3.0), st.floats(-4.0, 4.0)),
        max_size=4,
        unique_by=lambda row: row[0],
    ).map(
        lambda rows: tuple(Turn(at_s=t, speed_mps=v, heading_rad=h) for t, v, h in sorted(rows))
    ),
)


@settings(max_examples=60)
@given(MOTIONS, st.tuples(st.floats(0.0, 12.0), st.floats(0.0, 12.0)), st.booleans())
def test_first_contact_is_where_the_gap_ends(
    obstacle: Obstacle, position: tuple[float, float], closed: bool
) -> None:
    assume(distance(obstacle.center_m, position) > obstacle.radius_m + 0.3)
    walls = Walls(lower_m=(0.0, 0.0), upper_m=(12.0, 12.0)) if closed else None
    world = Scenario(
        name="x", start_m=(99.0, 99.0), goal_m=(98.0, 99.0), obstacles=(obstacle,), walls=walls
    )
    (first,) = first_contact_s(uniform_segments(world, 20.0), np.array([position]))
    until = min(float(first), 20.0)
    (before,) = step_clearances(world, 0.0, until, position, position)
    assert before >= -1e-6
    if first < 20.0:
        (at,) = step_clearances(world, until, until, position, position)
        assert at <= 1e-6


def test_a_fast_suite_has_its_own_speed_and_obstacles_as_fast_as_it_and_faster() -> None:
    obstacles = [o for k in range(40) for o in suite("fast-20").world(k).obstacles]
    speeds = [o.speed_mps for o in obstacles]
    assert len(obstacles) == 40 * 20
    assert 0.5 <= min(speeds) < 0.55 < 1.95 < max(speeds) <= 2.0
    assert [suite(name).speed_mps for name in ("random-10", "fast-10", "pedestrians")] == [
        0.8, 1.0, 1.0,
    ]  # fmt: skip
    adversarial = suite("adversarial")
    assert adversarial.world(0) == adversarial.world(0, 0.8) != adversarial.world(0, 1.0)


@pytest.mark.parametrize("name", ["random-10", "turning", "fast-10", "dynabarn-like"])
def test_survival_falls_with_the_crowd(name: str) -> None:
    shares = [survivability(suite(name).world(k), 0.8).share for k in range(30)]
    few = [survivability(suite("random-3").world(k), 0.8).share for k in range(30)]
    assert np.mean(shares) < np.mean(few) < 1.0
