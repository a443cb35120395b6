# SPDX-License-Identifier: Apache-2.0
"""On the real graph: a lidar that sees less far than the robot stops, or nothing near it."""

import math
from typing import Any

from real_time_robot import BEAMS, DRIVES, FREE, STOPS, TRACKING, RealTimeRobot, scan_of, stamp
from ros_graph import Graph

from mfba_planner.recording.from_messages import decision

OK, WARN, ERROR = b"\x00", b"\x01", b"\x02"
PLANNER = {**TRACKING, "speed_mps": 0.8, "step_length_m": 0.08}


def decide(robot: RealTimeRobot, ranges: Any = FREE, **lidar: Any) -> str:
    robot.send_odom(stamp())
    return robot.send_scan(scan_of(stamp(), ranges, **lidar))


def driving(robot: RealTimeRobot) -> Any:
    newest = [s for m in robot.diagnostics for s in m.status if s.name == "planner: driving"]
    return newest[-1]


def test_a_lidar_that_sees_less_far_than_the_robot_stops(graph: Graph) -> None:
    robot = RealTimeRobot(graph, planner=PLANNER)
    decide(robot)
    assert decide(robot) == DRIVES
    assert decide(robot, range_max=0.35) == STOPS
    reason = (
        "refused input: speed_mps=0.8: the robot stops within 0.08 m, but sees only 0.05 m ahead: "
        "the lidar's range of 0.35 m less robot_radius_m=0.3; lower step_length_m to 0.05, or "
        "give a lidar of 0.38 m"
    )
    assert (driving(robot).level, driving(robot).message) == (ERROR, reason)
    assert decide(robot, range_max=0.38) == DRIVES


def test_a_lidar_that_does_not_see_what_is_about_to_touch(graph: Graph) -> None:
    robot = RealTimeRobot(graph, planner=PLANNER)
    decide(robot)
    assert decide(robot, range_min=0.5) == DRIVES
    for node in ("planner", "virtual_sensor"):
        inputs = robot.inputs(node)
        assert inputs.level == WARN
        assert inputs.message.endswith(
            "are sound, but the lidar's range_min=0.5 m is beyond robot_radius_m=0.3: it does "
            "not tell where something between the two is; set robot_radius_m to 0.5, or use a "
            "lidar that sees nearer"
        )
    # Something is nearer ahead than the lidar can tell. The goal is ahead as well.
    ahead = tuple(-math.inf if abs(k - BEAMS // 2) < 5 else math.inf for k in range(BEAMS))
    for _ in range(3):
        decide(robot, ahead, range_min=0.5)
        vx, vy = decision(robot.decisions[-1], ()).velocity
        assert vx <= 0.2 * abs(vy), "along the tangent of what it touches, or away"
    decide(robot)
    assert robot.inputs("planner").level == robot.inputs("virtual_sensor").level == OK
