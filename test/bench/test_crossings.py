# SPDX-License-Identifier: Apache-2.0
"""Crossings among people: what a recording becomes, and how contacts are told apart."""

import importlib
import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from project import ROOT

from mfba_planner.core.geometry import Point, Pose2D
from mfba_planner.core.planner_types import NANO, Decision, Mode
from mfba_planner.core.robot_base import Drive
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.simulation.episode import Episode, Outcome
from mfba_planner.simulation.obstacle_motion import Obstacle, center_at
from mfba_planner.simulation.scenario import Scenario

PARAMS = PlannerParams(speed_mps=1.0, step_length_m=0.1)


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> dict[str, ModuleType]:
    monkeypatch.syspath_prepend(str(ROOT / "bench"))
    names = ("crossings", "pedestrians", "passer_by")
    return {name: importlib.import_module(name) for name in names}


def episode(robot: list[Point], person: Obstacle, outcome: Outcome) -> Episode:
    """A robot of 0.3 m at these positions, 0.1 s apart, and one person."""
    ticks = tuple(
        Decision(
            stamp_ns=k * 100_000_000,
            mode=Mode.PATH_GENERATION,
            reason="",
            pose=Pose2D(*now),
            goal=(50.0, 0.0),
            ranges_m=(),
            vs=(),
            vg=(),
            gap=0,
            waypoint=after,
            velocity=((after[0] - now[0]) * 10.0, (after[1] - now[1]) * 10.0),
        )
        for k, (now, after) in enumerate(pairwise([*robot, robot[-1]]))
    )
    scenario = Scenario(
        name="x", start_m=robot[0], goal_m=(50.0, 0.0), obstacles=(person,), time_limit_s=60.0
    )
    return Episode(
        scenario=scenario, sensor=SensorParams(), planner=PARAMS, seed=0, driver="core",
        ticks=ticks, outcome=outcome,
    )  # fmt: skip


DRIVES = [(0.1 * k, 0.0) for k in range(30)]
STANDS = [(0.0, 0.0)] * 30


@pytest.mark.parametrize(
    ("robot", "person", "ending"),
    [
        (DRIVES, Obstacle(center_m=(2.0, 0.0), radius_m=0.3), "BY_ROBOT"),
        (DRIVES, Obstacle(center_m=(1.0, 3.0), radius_m=0.3, speed_mps=2.0,
                          heading_rad=-0.5 * math.pi), "BY_ROBOT"),
        (DRIVES, Obstacle(center_m=(-1.5, 0.0), radius_m=0.3, speed_mps=2.0), "BEHIND"),
        (STANDS, Obstacle(center_m=(2.0, 0.0), radius_m=0.3, speed_mps=1.0,
                          heading_rad=math.pi), "STANDING"),
        (DRIVES, Obstacle(center_m=(1.0, 5.0), radius_m=0.3), "CLEAR"),
        (STANDS, Obstacle(center_m=(1.0, 5.0), radius_m=0.3), "LATE"),
    ],
)  # fmt: skip
def test_the_first_contact_says_how_a_crossing_ended(
    bench: dict[str, ModuleType], robot: list[Point], person: Obstacle, ending: str
) -> None:
    outcome = Outcome.TIME_LIMIT if ending == "LATE" else Outcome.GOAL_REACHED
    assert bench["crossings"].ending(episode(robot, person, outcome)).name == ending


def test_an_obstacle_follows_its_samples_and_goes_on_straight(
    bench: dict[str, ModuleType],
) -> None:
    times, points = [-1.0, 0.5, 1.0, 3.0], [(0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (3.0, 1.0)]
    obstacle = bench["crossings"].obstacle_along(times, points, 0.25)
    assert obstacle.center_m == pytest.approx((2.0, 0.0))
    for t, p in zip(times[1:], points[1:]):
        assert center_at(obstacle, t) == pytest.approx(p)
    assert center_at(obstacle, 0.75) == pytest.approx((3.0, 0.5))
    assert center_at(obstacle, 9.0) == pytest.approx((3.0, 1.0)), "who stood last stands"


def recording(directory: Path) -> Path:
    """Thirty people who cross 12 m in both directions, one every 2 s; sampled every 0.4 s."""
    rows = ["t_s,person,x_m,y_m"]
    for person in range(30):
        begin, sign = 2.0 * person, 1.0 if person % 2 else -1.0
        lane = 1.0 + (person * 37 % 100) / 10.0
        for k in range(25):
            t = 0.4 * k
            rows.append(f"{begin + t:.3f},{person},{6.0 + sign * (1.25 * t - 6.0):.3f},{lane}")
    path = directory / "walkers.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


def test_a_crossing_has_the_people_of_its_moment(
    bench: dict[str, ModuleType], tmp_path: Path
) -> None:
    pedestrians = bench["pedestrians"]
    tracks = pedestrians.read_recording(recording(tmp_path))
    assert len(tracks) == 30
    drawn = [pedestrians.crossing("w", tracks, 1.0, k, 0, 0.3) for k in range(6)]
    again = pedestrians.crossing("w", tracks, 1.0, 3, 0, 0.3)
    assert again == drawn[3]
    assert len({(s.start_m, s.goal_m) for s in drawn}) == 6
    for scenario in drawn:
        trip_s = math.dist(scenario.start_m, scenario.goal_m)
        least = min(
            math.dist(center, np.array(scenario.start_m) + t / trip_s * (
                np.array(scenario.goal_m) - scenario.start_m))
            for t in np.arange(0.0, trip_s, 0.1)
            for center in scenario.centers(t)
        )  # fmt: skip
        assert least <= 1.0, "nobody is in the robot's way"
        assert min(math.dist(c, scenario.start_m) for c in scenario.centers(0.0)) >= 0.6 + 0.4
        # All walk along x, at 1.25 m/s, in a lane of the recording.
        for obstacle in scenario.obstacles:
            assert obstacle.speed_mps == pytest.approx(1.25, abs=0.01)
            assert abs(math.sin(obstacle.heading_rad)) < 1e-6


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("a,b\n1,2\n", "no column t_s; give t_s, person, x_m, y_m"),
        ("t_s,person,x_m,y_m\n0,1,zero,0\n", "line 2: value='zero': not a number"),
        ("t_s,person,x_m,y_m\n0,1,nan,0\n", "line 2: value=nan: not finite"),
        (
            "t_s,person,x_m,y_m\n0,1,0,0\n0,1,1,0\n",
            "person 1: time 0 s after 0 s; sort",
        ),
        ("t_s,person,x_m,y_m\n0,1,0,0\n", "no person with two samples"),
    ],
)
def test_what_is_no_recording_is_refused_in_one_line(
    bench: dict[str, ModuleType],
    text: str,
    reason: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(text)
    assert bench["pedestrians"].main([str(path)]) == 1
    err = capsys.readouterr().err
    assert reason in err
    assert err.count("\n") == 1
    assert bench["pedestrians"].main([str(tmp_path / "absent.csv")]) == 1
    assert "absent.csv: cannot be read" in capsys.readouterr().err


def test_crossings_are_counted_by_kind_for_each_robot(
    bench: dict[str, ModuleType], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = [str(recording(tmp_path)), "--crossings", "3", "--planner", "straight"]
    arguments += ["--planner", "predictive", "--perception", "lidar", "--fov", "360"]
    assert bench["pedestrians"].main(arguments) == 0
    straight, predictive = capsys.readouterr().out.splitlines()
    assert straight.startswith("walkers: straight, lidar, 360 beams of 10 m, 360 deg, 1 m/s: ")
    assert predictive.startswith("walkers: predictive, lidar, ")
    clear = [int(line.split("m/s: ")[1].split()[0]) for line in (straight, predictive)]
    assert clear[0] < clear[1] == 3


@pytest.mark.parametrize("speed_mps", [0.2, 1.0, 2.5])
def test_a_passer_by_comes_from_every_side_and_meets_a_straight_driver(
    bench: dict[str, ModuleType], speed_mps: float
) -> None:
    crossings, passer_by = bench["crossings"], bench["passer_by"]
    scenarios = [passer_by.passing(speed_mps, 1.0, k, 24, 0) for k in range(24)]
    headings = sorted(s.obstacles[0].heading_rad for s in scenarios)
    assert headings == pytest.approx([2.0 * math.pi * k / 24 for k in range(24)])
    starts = [math.dist(s.start_m, s.obstacles[0].center_m) for s in scenarios]
    assert min(starts) >= 1.5 - 1e-9
    straight = crossings.Robot(planner="straight")
    met = sum(crossings.judge((s, straight, 0)) is not crossings.Ending.CLEAR for s in scenarios)
    assert met >= 21, "and yet he passes from behind at the robot's own speed"
    tracking = replace(straight, planner="predictive", range_m=3.5)
    passed = [crossings.judge((s, tracking, 0)) for s in scenarios[::4]]
    assert passed == [crossings.Ending.CLEAR] * 6


@pytest.mark.parametrize(("speed_mps", "number"), [(2.0, 59), (2.5, 32), (2.5, 59)])
def test_a_differential_base_turns_aside_before_it_is_overtaken(
    bench: dict[str, ModuleType], speed_mps: float, number: int
) -> None:
    crossings, passer_by = bench["crossings"], bench["passer_by"]
    robot = crossings.Robot(perception="lidar-differential", range_m=3.5)
    scenario = passer_by.passing(speed_mps, 1.0, number, 60, 0)
    found = crossings.cross(scenario, robot, number)
    assert found.planner.drive is Drive.DIFFERENTIAL, "the planner knows its robot"
    assert crossings.ending(found) is crossings.Ending.CLEAR


def test_a_robot_is_given_a_base_for_its_speed(bench: dict[str, ModuleType]) -> None:
    crossings, passer_by = bench["crossings"], bench["passer_by"]
    robot = crossings.Robot(perception="lidar-differential", speed_mps=1.2)
    found = crossings.cross(passer_by.passing(0.2, 1.2, 15, 60, 0), robot, 0)
    driven = [
        math.dist(a.pose.position, b.pose.position) / (found.planner.tick_ns * NANO)
        for a, b in crossings.steps_driven(found)
    ]
    assert max(driven) == pytest.approx(1.2)


def test_a_view_of_270_degrees_does_not_cover_what_comes_from_behind(
    bench: dict[str, ModuleType],
) -> None:
    crossings, passer_by = bench["crossings"], bench["passer_by"]
    behind: Any = passer_by.passing(2.0, 1.0, 0, 60, 0)
    all_round = crossings.Robot(range_m=10.0)
    front = replace(all_round, fov_rad=math.radians(270.0))
    assert crossings.ending(crossings.cross(behind, all_round, 0)) is crossings.Ending.CLEAR
    run = crossings.cross(behind, front, 0)
    assert run.scenario.robot.lidar.fov_rad == pytest.approx(4.712, abs=1e-3)
    assert crossings.ending(run) is crossings.Ending.BEHIND
