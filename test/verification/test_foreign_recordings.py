# SPDX-License-Identifier: Apache-2.0
"""What real recordings do to topics, frames, stamps and clocks, and what is decided on them."""

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from foreign_bags import (
    SECOND,
    START_NS,
    Recorded,
    goal,
    made,
    odom,
    scan,
    steps,
    transform,
    wall,
    write,
)

from mfba_planner.core.errors import BagError
from mfba_planner.core.lidar_extrinsics import LidarExtrinsics
from mfba_planner.perception.no_return import NoReturn
from mfba_planner.verification.recorded_topics import of_robot
from mfba_planner.verification.redecide import RedecideParams, RedecideResult, redecide_recording

ROBOT = RedecideParams(robot_radius_m=0.3)
MOUNT = transform(START_NS)
GOAL = goal(START_NS, 5.0, 0.0)
Maker = Callable[[int], Recorded]


def on_wall(stamp: int) -> Recorded:
    return scan(stamp, wall(90))


def decided(path: Path, messages: list[Recorded], **changes: Any) -> RedecideResult:
    return redecide_recording(write(path / "bag", messages), replace(ROBOT, **changes))


def refusal(path: Path, messages: list[Recorded], **changes: Any) -> str:
    with pytest.raises(BagError) as caught:
        decided(path, messages, **changes)
    return str(caught.value).removeprefix(str(path / "bag: "))


def test_a_goal_in_another_frame_is_refused(tmp_path: Path) -> None:
    in_map = goal(START_NS, 5.0, 0.0, frame="map")
    text = refusal(tmp_path, [MOUNT, in_map, *steps(odom, on_wall)])
    assert text == (
        "no goal_pose can be used: goal_pose is in frame 'map', not 'odom', and no tf gives the "
        "one in the other; give one with --goal X Y, in metres in 'odom'"
    )


def goals_of(found: RedecideResult) -> list[tuple[float, float] | None]:
    """The goals that were decided for, in mm, each once."""
    goals = [
        tick.goal and (round(tick.goal[0], 3), round(tick.goal[1], 3)) for tick in found.decided
    ]
    return list(dict.fromkeys(goals))


def map_to_odom(stamp: int) -> Recorded:
    """The odometry began 10 m ahead of the map's origin, turned to the left."""
    return transform(stamp, "map", "odom", x=10.0, yaw=math.pi / 2, topic="/tf")


def test_a_goal_in_another_frame_is_transformed_by_tf(tmp_path: Path) -> None:
    in_map = goal(START_NS, 5.0, 0.0, frame="map")
    first, *others = steps(map_to_odom)
    messages = [MOUNT, in_map, *others, *steps(odom, on_wall)]
    found = decided(tmp_path, messages)
    # It waits for the first transform: that of the second tick.
    assert goals_of(found) == [None, (0.0, 5.0)]
    assert found.decided[1].goal is not None
    assert found.notes == ()
    (tmp_path / "slash").mkdir()
    slash = goal(START_NS, 5.0, 0.0, frame="/map")
    all_of_it = decided(tmp_path / "slash", [MOUNT, slash, first, *messages[2:]])
    assert goals_of(all_of_it) == [(0.0, 5.0)]


def test_the_newest_goal_counts_while_tf_is_missing(tmp_path: Path) -> None:
    goals = [
        goal(START_NS, 5.0, 0.0, frame="map"),
        goal(START_NS + 1, 8.0, 0.0, frame="map"),
        goal(START_NS + 10 * SECOND, 2.0, 3.0),
    ]
    late = map_to_odom(START_NS + 2 * SECOND)
    found = decided(tmp_path, [MOUNT, *goals, late, *steps(odom, on_wall, count=120)])
    assert goals_of(found) == [None, (0.0, 2.0), (2.0, 3.0)]
    assert found.notes == (
        "1 goals are refused: goal_pose is in frame 'map', not 'odom', and no tf gives the one in "
        "the other",
    )


def test_a_static_transform_counts_from_the_start(tmp_path: Path) -> None:
    in_map = goal(START_NS, 5.0, 0.0, frame="map")
    static = transform(START_NS + SECOND, "map", "odom", x=1.0)
    found = decided(tmp_path, [MOUNT, static, in_map, *steps(odom, on_wall)])
    assert goals_of(found) == [(4.0, 0.0)]


def test_goals_in_several_frames(tmp_path: Path) -> None:
    in_map = goal(START_NS, 9.0, 9.0, frame="map")
    found = decided(tmp_path, [MOUNT, in_map, GOAL, *steps(odom, on_wall)])
    assert {tick.goal for tick in found.decided} == {(5.0, 0.0)}
    assert found.notes == (
        "1 goals are refused: goal_pose is in frame 'map', not 'odom', and no tf gives the one in "
        "the other",
    )


def test_odometry_in_map_takes_goals_in_map(tmp_path: Path) -> None:
    def in_map(t: int) -> Recorded:
        return odom(t, frame="map")

    goals = [goal(START_NS, 5.0, 0.0, frame="map")]
    found = decided(tmp_path, [MOUNT, *goals, *steps(in_map, on_wall)])
    assert len(found.decided) == 20
    assert "not 'map', and no tf gives the one in the other; give one with --goal" in refusal(
        tmp_path / "b", [MOUNT, GOAL, *steps(in_map, on_wall)]
    )


def test_frames_that_are_required_refuse_others_as_in_the_nodes(tmp_path: Path) -> None:
    messages = [MOUNT, GOAL, *steps(odom, on_wall)]
    found = decided(tmp_path, messages, odom_frame="odom", scan_frame="laser")
    assert not found.nothing
    for name, changes in (("odom", {"odom_frame": "map"}), ("scan", {"scan_frame": "base_scan"})):
        (tmp_path / name).mkdir()
        other = decided(tmp_path / name, messages, goal=(5.0, 0.0), **changes)
        assert f"because: refused input: {name} is in frame" in other.nothing


def test_odometry_without_child_frame(tmp_path: Path) -> None:
    backwards = transform(START_NS, yaw=math.pi)
    messages = [backwards, GOAL, *steps(lambda t: odom(t, child=""), lambda t: scan(t, wall(0)))]
    assert refusal(tmp_path, messages) == (
        "frame 'laser': the odometry has no child_frame_id, so the lidar's pose on the robot "
        "is not known; give --scan-x, --scan-y, --scan-yaw, --scan-flipped"
    )
    (tmp_path / "given").mkdir()
    given = decided(tmp_path / "given", messages, extrinsics=LidarExtrinsics(yaw_rad=math.pi))
    named = [backwards, GOAL, *steps(odom, lambda t: scan(t, wall(0)))]
    (tmp_path / "named").mkdir()
    assert decided(tmp_path / "named", named).digest == given.digest
    (tmp_path / "base").mkdir()
    assert decided(tmp_path / "base", messages, base_frame="base_link").digest == given.digest


@pytest.mark.parametrize("with_static", [False, True])
def test_a_lidar_whose_pose_is_in_tf_only(with_static: bool, tmp_path: Path) -> None:
    """As of a robot_state_publisher that sends all of it again and again."""
    static = transform(START_NS, "base_link", "mast", x=0.1)
    parent = "mast" if with_static else "base_link"
    mount: dict[str, Any] = {"x": 0.1, "yaw": 1.0, "roll": math.pi}

    def on_tf(stamp: int) -> Recorded:
        return transform(stamp, parent, "laser", topic="/tf", **mount)

    found = decided(tmp_path, [static, GOAL, *steps(on_tf, odom, on_wall)])
    assert found.notes == (
        f"/tf: laser is at ({0.2 if with_static else 0.1}, 0) m in base_link, turned by 1 rad, "
        "upside down",
    )
    (tmp_path / "static").mkdir()
    same = transform(START_NS, "mast" if with_static else "base_link", "laser", **mount)
    by_static = decided(tmp_path / "static", [static, same, GOAL, *steps(odom, on_wall)])
    assert found.digest == by_static.digest


def test_the_sectors_of_our_sensor_are_no_second_lidar(tmp_path: Path) -> None:
    trip = [MOUNT, GOAL, *steps(odom, on_wall)]
    sectors = steps(lambda t: scan(t, [0.5] * 12, topic="/sectors"))
    vector = Recorded("/sensory_vector", START_NS, made("std_msgs/msg/String", data=""))
    assert "2 topics of sensor_msgs/msg/LaserScan" in refusal(tmp_path, [*trip, *sectors])
    names = ("alone", "ours", "wanted")
    for name in names:
        (tmp_path / name).mkdir()
    alone = decided(tmp_path / "alone", trip)
    ours = [*trip, *sectors, vector]
    assert decided(tmp_path / "ours", ours).digest == alone.digest
    assert decided(tmp_path / "wanted", ours, scan="/sectors").digest != alone.digest


def robot(name: str, goal_x: float, at_deg: int, yaw: float = 0.0) -> list[Recorded]:
    """A robot whose topics are all below its name; frames have no prefix."""
    return [
        transform(START_NS, yaw=yaw, topic=f"/{name}/tf_static"),
        goal(START_NS, goal_x, 0.0, topic=f"/{name}/goal_pose"),
        *steps(
            lambda t: odom(t, topic=f"/{name}/odom"),
            lambda t: scan(t, wall(at_deg), topic=f"/{name}/scan"),
        ),
    ]


def test_two_robots_in_namespaces_are_not_mixed(tmp_path: Path) -> None:
    both = [*robot("left", 5.0, 90), *robot("right", -5.0, 0, yaw=math.pi)]
    assert refusal(tmp_path, both) == (
        "2 topics of sensor_msgs/msg/LaserScan, /left/scan, /right/scan; name one with --scan, "
        "or the lidars of one robot, separated by commas"
    )
    for name, own in (("left", both[: len(both) // 2]), ("right", both[len(both) // 2 :])):
        (tmp_path / name).mkdir()
        (tmp_path / f"only_{name}").mkdir()
        one = decided(tmp_path / name, both, scan=f"/{name}/scan")
        alone = decided(tmp_path / f"only_{name}", own)
        assert one.digest == alone.digest
    assert one.decided[0].goal == (-5.0, 0.0)


def test_the_other_robot_s_topics_are_never_taken(tmp_path: Path) -> None:
    both = [*robot("left", 5.0, 90), *robot("right", -5.0, 0)]
    without = [m for m in both if m.topic != "/left/goal_pose"]
    assert refusal(tmp_path, without, scan="/left/scan") == (
        "no goal_pose was recorded for this robot; give one with --goal X Y, or one of "
        "/right/goal_pose with --goal-topic"
    )
    (tmp_path / "named").mkdir()
    named = decided(tmp_path / "named", without, scan="/left/scan", goal_topic="/right/goal_pose")
    assert named.decided[0].goal == (-5.0, 0.0)
    without = [m for m in both if m.topic != "/left/odom"]
    text = refusal(tmp_path / "odom", without, scan="/left/scan")
    assert text.endswith(
        "/right/odom is not in the namespace of /left/scan; if it belongs to that robot, name it "
        "with --odom /right/odom"
    )
    without = [m for m in both if m.topic != "/left/tf_static"]
    assert "no /tf_static" in refusal(tmp_path / "tf", without, scan="/left/scan")


@pytest.mark.parametrize(
    ("topics", "scan_topic", "odom_topic", "chosen"),
    [
        (["/goal_pose"], "/scan", "/odom", ["/goal_pose"]),
        (["/goal_pose"], "/front/scan", "/odometry/filtered", ["/goal_pose"]),
        (["/goal_pose", "/r1/goal_pose"], "/r1/front/scan", "/r1/odom", ["/r1/goal_pose"]),
        (["/goal_pose", "/r2/goal_pose"], "/r1/scan", "/r1/odom", ["/goal_pose"]),
        (["/r2/goal_pose"], "/r1/scan", "/r1/odom", []),
        (["/r2/goal_pose"], "/scan", "/odom", []),
        (["/r1/planner/goal_pose"], "/r1/scan", "/r1/odom", ["/r1/planner/goal_pose"]),
        (["/robot/goal_pose"], "/front/scan", "/robot/odom", ["/robot/goal_pose"]),
        (["goal_pose"], "scan", "odom", ["goal_pose"]),
    ],
)
def test_topics_of_one_robot(
    topics: list[str], scan_topic: str, odom_topic: str, chosen: list[str]
) -> None:
    assert of_robot(topics, "goal_pose", (scan_topic, odom_topic)) == chosen


def test_topics_without_messages_count_as_not_recorded(tmp_path: Path) -> None:
    kind = "sensor_msgs/msg/LaserScan"
    messages = [MOUNT, GOAL, *steps(odom, on_wall)]
    path = write(tmp_path / "bag", messages, empty=[("/rear/scan", kind), ("/sectors", kind)])
    assert len(redecide_recording(path, ROBOT).decided) == 20
    with pytest.raises(BagError, match="--scan /rear/scan: has no message; give one of /scan"):
        redecide_recording(path, replace(ROBOT, scan="/rear/scan"))
    empty = write(tmp_path / "empty", [MOUNT, GOAL, *steps(odom)], empty=[("/scan", kind)])
    with pytest.raises(BagError, match=f"no message of type {kind}"):
        redecide_recording(empty, ROBOT)


@pytest.mark.parametrize(("ahead_s", "what"), [(3.0, "3 s ahead of"), (-0.9, "0.9 s behind")])
def test_clocks_that_differ_are_named(ahead_s: float, what: str, tmp_path: Path) -> None:
    shift = round(ahead_s * SECOND)
    found = decided(
        tmp_path,
        [MOUNT, GOAL, *steps(odom, lambda t: scan(t + shift, wall(90), time_ns=t + 1))],
    )
    assert found.notes[0] == (
        f"the stamps of /scan are {what} those of /odom received at the same time: their clocks "
        "differ (synchronise them, and record again)"
    )
    assert bool(found.nothing) == (ahead_s > 1.0)
    if found.nothing:
        assert found.nothing == ("no scan could be used, 20 of 20 because: input is 3.000 s old")


def test_odometry_sent_twice_is_left_out_once(tmp_path: Path) -> None:
    messages = [MOUNT, GOAL, *steps(odom, lambda t: odom(t, time_ns=t + 2), on_wall)]
    found = decided(tmp_path, messages)
    assert (len(found.decided), found.faults) == (20, ())
    assert found.notes == ("20 messages of /odom that repeat a stamp: left out",)


def test_scans_without_stamps_are_faults(tmp_path: Path) -> None:
    found = decided(
        tmp_path, [MOUNT, GOAL, *steps(odom, lambda t: scan(0, wall(90), time_ns=t + 1))]
    )
    assert len(found.faults) == 19


def zero_quaternion(stamp: int) -> Recorded:
    found = odom(stamp)
    found.message.pose.pose.orientation.w = 0.0
    return found


@pytest.mark.parametrize(
    ("makers", "no_return", "reason"),
    [
        ((zero_quaternion, on_wall), NoReturn.INF, "odom orientation has norm 0"),
        ((odom, lambda t: scan(t, [0.0] * 360)), NoReturn.INF, "without one usable range"),
        ((odom, lambda t: scan(t, [3.6] * 360)), NoReturn.INF, "without one usable range"),
        ((odom, lambda t: scan(t, [0.0] * 360)), NoReturn.ZERO, ""),
        ((odom, lambda t: scan(t, [0.0] * 300 + [2.0] * 60)), NoReturn.INF, ""),
        ((odom, lambda t: scan(t, [0.0] * 300 + [2.0] * 60, range_min=0.0)), NoReturn.INF, ""),
    ],
)
def test_what_no_decision_can_be_made_on_is_named(
    makers: tuple[Maker, Maker], no_return: NoReturn, reason: str, tmp_path: Path
) -> None:
    found = decided(tmp_path, [MOUNT, GOAL, *steps(*makers)], scan_no_return=no_return)
    assert len(found.decided) == 20
    if reason:
        assert re.search(f"no scan could be used, 20 of 20 because: .*{reason}", found.nothing)
    else:
        assert not found.nothing


def test_of_two_odometries_one_must_be_named(tmp_path: Path) -> None:
    messages = [
        MOUNT, GOAL, *steps(odom, lambda t: odom(t, topic="/odometry/filtered"), on_wall),
    ]  # fmt: skip
    assert refusal(tmp_path, messages) == (
        "2 topics of nav_msgs/msg/Odometry, /odom, /odometry/filtered; name one with --odom"
    )


def test_odometry_that_changes_its_frame_is_refused_from_there_on(tmp_path: Path) -> None:
    def changing(t: int) -> Recorded:
        return odom(t, frame="odom" if t < START_NS + SECOND else "map")

    found = decided(tmp_path, [MOUNT, GOAL, *steps(changing, on_wall)])
    reasons = {tick.reason for tick in found.decided[9:]}
    assert len(reasons) == 1
    assert "odom is in frame 'map', not 'odom'" in reasons.pop()
