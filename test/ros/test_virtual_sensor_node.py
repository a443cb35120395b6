# SPDX-License-Identifier: Apache-2.0
"""virtual_sensor: the core's sectors for any world or scan, NaN sectors for refused inputs."""

import math
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import PoseArray
from nav_msgs.msg import Odometry
from rclpy.qos import qos_profile_sensor_data
from ros_graph import Graph
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.planner_types import Scan
from mfba_planner.perception.scan_to_sectors import sense_scan
from mfba_planner.perception.sensory_vector import SensorParams, sense_circles, sensory_vector
from mfba_planner.recording.from_messages import stamp_ns
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.to_messages import obstacles_msg, odometry_msg, time_msg
from mfba_planner.ros.nodes.virtual_sensor import VirtualSensor

RADII = [0.3, 0.5, 0.2, 0.7, 1.0]
ROBOT_RADIUS_M = 0.3
INF = math.inf


def odom(stamp: int, x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> Odometry:
    return odometry_msg(Pose2D(x, y, yaw), (0.0, 0.0), stamp, "odom", "base_link")


def obstacles(stamp: int, *centers: tuple[float, float]) -> PoseArray:
    return obstacles_msg(centers, stamp, "odom")


def scan(stamp: int, ranges: Any = (1.0,) * 360, **changes: Any) -> LaserScan:
    values = {
        "angle_min": 0.0,
        "angle_increment": 2.0 * math.pi / max(len(ranges), 1),
        "range_min": 0.1,
        "range_max": 10.0,
    }
    header = Header(stamp=time_msg(stamp), frame_id="base_scan")
    return LaserScan(header=header, ranges=ranges, **{**values, **changes})


class Sensor:
    """A virtual sensor, publishers of its inputs and lists of its outputs."""

    def __init__(self, graph: Graph, parameters: dict[str, Any]) -> None:
        self.graph = graph
        self.odom = graph.writer(topics.ODOM)
        self.obstacles = graph.writer(topics.OBSTACLES)
        self.scan = graph.writer(topics.SCAN)
        self.sectors = graph.collect(topics.SECTORS)
        self.vectors = graph.collect(topics.SENSORY_VECTOR)
        self.node = graph.start(VirtualSensor, parameters)

    def measure_all(self, *messages: Any) -> list[LaserScan]:
        """Publish the messages one after another; return the sectors that follow."""
        count = len(self.sectors)
        writers = {Odometry: self.odom, PoseArray: self.obstacles, LaserScan: self.scan}
        for message in messages:
            writers[type(message)].publish(message)
        self.graph.settle()
        return self.sectors[count:]

    def measure(self, *messages: Any) -> LaserScan:
        (only,) = self.measure_all(*messages)
        return only


def ranges_of(message: LaserScan) -> tuple[float, ...]:
    return tuple(message.ranges)


def is_blind(message: LaserScan) -> bool:
    return len(message.ranges) >= 3 and all(map(math.isnan, message.ranges))


def test_sectors_are_the_cores_for_many_worlds(graph: Graph) -> None:
    sensor = Sensor(graph, {"obstacle_radii_m": RADII, "robot_radius_m": ROBOT_RADIUS_M})
    rng = np.random.default_rng(2)
    vectors = set()
    for stamp in range(1, 121):
        x, y, *rest = rng.uniform(-3.0, 3.0, 12).tolist()
        centers = list(zip(rest[::2], rest[1::2]))
        messages = [odom(stamp, x, y, yaw=stamp), obstacles(stamp, *centers)]
        sectors = sensor.measure(*(messages if stamp % 2 else reversed(messages)))
        circles = [(c, r + ROBOT_RADIUS_M) for c, r in zip(centers, RADII)]
        expected = sense_circles((x, y), circles, SensorParams())
        assert ranges_of(sectors) == expected
        assert stamp_ns(sectors.header.stamp) == stamp
        assert sectors.header.frame_id == "odom"
        vs = sensory_vector(expected)
        assert tuple(sectors.intensities) == vs
        assert tuple(sensor.vectors[-1].data) == vs
        vectors.add(vs)
    assert len(sensor.vectors) == 120
    assert len(vectors) > 50, "the worlds were too much alike"


def test_one_radius_holds_for_all_obstacles(graph: Graph) -> None:
    sensor = Sensor(graph, {"obstacle_radii_m": [0.5], "robot_radius_m": 0.1})
    sectors = sensor.measure(odom(1), obstacles(1, (1.0, 0.0), (0.0, 1.0)))
    expected = sense_circles((0.0, 0.0), [((1.0, 0.0), 0.6), ((0.0, 1.0), 0.6)], SensorParams())
    assert ranges_of(sectors) == expected


def test_no_obstacle_is_all_free(graph: Graph) -> None:
    sensor = Sensor(graph, {})
    assert ranges_of(sensor.measure(odom(1), obstacles(1))) == (INF,) * 12
    assert tuple(sensor.vectors[0].data) == (0,) * 12


def test_radii_that_do_not_fit_make_it_blind(graph: Graph) -> None:
    sensor = Sensor(graph, {"obstacle_radii_m": [0.3, 0.4]})
    assert is_blind(sensor.measure(odom(1), obstacles(1, (1.0, 0.0))))
    assert is_blind(sensor.measure(odom(2), obstacles(2)))
    assert not is_blind(sensor.measure(odom(3), obstacles(3, (1.0, 0.0), (2.0, 0.0))))
    assert sensor.node._refused_inputs.count == 2


@pytest.mark.parametrize("bad", [math.nan, INF, -INF])
def test_a_bad_number_blinds_it_for_one_tick(graph: Graph, bad: float) -> None:
    sensor = Sensor(graph, {})
    given = [
        (odom(1, bad), obstacles(1)),
        (odom(2, 0.0, bad), obstacles(2)),
        (odom(3), obstacles(3, (1.0, 0.0), (bad, 0.0))),
        (obstacles(4, (0.0, bad)), odom(4)),
    ]
    for pair in given:
        assert is_blind(sensor.measure(*pair))
    assert not sensor.vectors, "without sectors there is no sensory vector"
    assert ranges_of(sensor.measure(odom(5), obstacles(5))) == (INF,) * 12
    assert sensor.node._refused_inputs.count == 4


def test_each_pair_is_measured_when_it_is_complete(graph: Graph) -> None:
    sensor = Sensor(graph, {})
    assert not sensor.measure_all(odom(1), odom(2), odom(3))
    assert [stamp_ns(m.header.stamp) for m in sensor.measure_all(obstacles(2), obstacles(3))] == [
        2,
        3,
    ]
    assert not sensor.measure_all(obstacles(1)), "backwards"
    assert not sensor.measure_all(odom(1))
    assert sensor.node._refused_inputs.count == 2


def test_a_repeated_tick_is_measured_again(graph: Graph) -> None:
    """A planner that was restarted gets its sectors though the sensor was not."""
    sensor = Sensor(graph, {})
    first = sensor.measure(odom(1), obstacles(1, (1.0, 0.0)))
    assert sensor.measure(obstacles(1, (1.0, 0.0)), odom(1)) == first


LOCKSTEP_SCAN = {"source": "scan", "lockstep": True}
REAL_SCAN = {"source": "scan"}


def core_scan(message: LaserScan, yaw: float) -> tuple[float, ...]:
    """The core's sectors of a scan; LaserScan holds single precision."""
    sent = Scan(
        ranges_m=np.array(message.ranges),
        angle_min_rad=message.angle_min,
        angle_increment_rad=message.angle_increment,
        range_min_m=message.range_min,
        range_max_m=message.range_max,
    )
    return sense_scan(sent, yaw, ROBOT_RADIUS_M, SensorParams())


@pytest.mark.parametrize("scan_yaw", [0.0, 1.0, -math.pi / 2])
def test_sectors_of_any_scan_are_the_cores(graph: Graph, scan_yaw: float) -> None:
    sensor = Sensor(graph, {**LOCKSTEP_SCAN, "scan_yaw": scan_yaw})
    rng = np.random.default_rng(3)
    for stamp in range(1, 41):
        beams = int(rng.integers(1, 400))
        values = rng.uniform(0.0, 6.0, beams)
        odd = rng.random(beams)
        values[odd < 0.3], values[odd < 0.1], values[odd < 0.05] = INF, math.nan, -INF
        values[0] = INF  # one beam at least is usable
        message = scan(stamp, values.astype(np.float32).tolist())
        yaw = float(rng.uniform(-3.0, 3.0))
        sectors = sensor.measure(odom(stamp, 5.0, 5.0, yaw), message)
        assert ranges_of(sectors) == pytest.approx(core_scan(message, yaw + scan_yaw), rel=1e-5)
        assert stamp_ns(sectors.header.stamp) == stamp


def test_the_sectors_stay_aligned_with_odom_when_the_robot_turns(graph: Graph) -> None:
    """A return straight ahead of a robot that looks north (yaw 90) lies in sectors 3 and 4."""
    sensor = Sensor(graph, LOCKSTEP_SCAN)
    ahead = [0.9] + [INF] * 359
    sectors = sensor.measure(odom(1, yaw=math.pi / 2), scan(1, ahead))
    assert [i for i, r in enumerate(sectors.ranges, start=1) if r < INF] == [3, 4]
    turned = Sensor(graph, {**LOCKSTEP_SCAN, "scan_yaw": math.pi / 2})
    graph.stop(sensor.node)
    sectors = turned.measure(odom(2), scan(2, ahead))
    assert [i for i, r in enumerate(sectors.ranges, start=1) if r < INF] == [3, 4]


def test_a_scan_in_another_frame_blinds_and_both_frames_are_named(graph: Graph) -> None:
    sensor = Sensor(graph, {**LOCKSTEP_SCAN, "scan_frame": "base_scan"})
    other = scan(1)
    other.header.frame_id = "rear"
    assert all(map(math.isnan, sensor.measure(odom(1), other).ranges))
    assert sensor.node._refused_inputs.by_kind == {"scan: frame": 1}
    assert sensor.node._refused_inputs.last == (
        "scan is in frame 'rear', not 'base_scan'; transform it, or set scan_frame"
    )
    assert not any(map(math.isnan, sensor.measure(odom(2), scan(2)).ranges))


def test_lockstep_joins_scan_and_odom_by_stamp(graph: Graph) -> None:
    sensor = Sensor(graph, LOCKSTEP_SCAN)
    assert not sensor.measure_all(odom(1, yaw=1.0), scan(2))
    assert stamp_ns(sensor.measure(odom(2)).header.stamp) == 2


def test_in_real_time_each_scan_is_measured_with_the_newest_odom(graph: Graph) -> None:
    sensor = Sensor(graph, REAL_SCAN)
    ahead = [0.9] + [INF] * 359
    assert is_blind(sensor.measure(scan(7, ahead))), "no odom yet"
    assert not sensor.measure_all(odom(3, yaw=math.pi / 2))
    for stamp in (8, 9):
        sectors = sensor.measure(scan(stamp, ahead))
        assert [i for i, r in enumerate(sectors.ranges, start=1) if r < INF] == [3, 4]
        assert stamp_ns(sectors.header.stamp) == stamp
    sensor.measure_all(odom(4, math.nan))
    assert is_blind(sensor.measure(scan(10, ahead)))


def test_a_best_effort_lidar_is_received_and_a_reliable_one_only_once(graph: Graph) -> None:
    sensor = Sensor(graph, REAL_SCAN)
    sensor.measure_all(odom(1))
    reliable = sensor.scan
    sensor.scan = graph.writer(topics.SCAN, qos=qos_profile_sensor_data)
    assert len(sensor.measure_all(scan(2))) == 1
    sensor.scan = reliable
    assert len(sensor.measure_all(scan(3))) == len(sensor.measure_all(scan(4))) == 1


@pytest.mark.parametrize(
    "message",
    [
        scan(1, [math.nan] * 360),
        scan(1, []),
        scan(1, [0.01] * 360),
        scan(1, angle_min=math.nan),
        scan(1, angle_increment=INF),
        scan(1, range_max=0.1),
    ],
    ids=["all-nan", "empty", "too-near", "angle-nan", "increment-inf", "no-range"],
)
def test_an_unusable_scan_blinds_it(graph: Graph, message: LaserScan) -> None:
    sensor = Sensor(graph, LOCKSTEP_SCAN)
    assert is_blind(sensor.measure(odom(1), message))
    assert not sensor.vectors
    assert sensor.node._refused_inputs.count == 1
    assert not is_blind(sensor.measure(odom(2), scan(2)))


def test_a_scan_without_returns_is_free(graph: Graph) -> None:
    sensor = Sensor(graph, LOCKSTEP_SCAN)
    assert ranges_of(sensor.measure(odom(1), scan(1, [INF] * 360))) == (INF,) * 12


def test_its_range_and_sectors_can_be_set_while_it_runs(graph: Graph) -> None:
    sensor = Sensor(graph, {"robot_radius_m": 0.3, "obstacle_radii_m": [0.3]})
    world = obstacles(1, (2.0, 0.0))
    assert ranges_of(sensor.measure(odom(1), world)) == (INF,) * 12
    assert graph.set_parameter("virtual_sensor", "sensing_range_m", 1.5) == ""
    assert graph.set_parameter("virtual_sensor", "sectors", 8) == ""
    world.header.stamp = time_msg(2)
    sectors = sensor.measure(odom(2), world)
    expected = SensorParams(sensing_range_m=1.5, sectors=8)
    assert ranges_of(sectors) == sense_circles((0.0, 0.0), [((2.0, 0.0), 0.6)], expected)
    assert min(sectors.ranges) < INF


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("sensing_range_m", 0.0, "Parameter sensing_range_m out of range Min: 0.01, Max: 1000.0"),
        ("sensing_range_m", math.nan, "out of range"),
        ("sensing_range_m", "far", "Wrong parameter type, expected 'Type.DOUBLE' got"),
        ("sectors", 2, "Parameter sectors out of range. Min: 3, Max: 3600, value: 2"),
        ("robot_radius_m", 0.5, "Trying to set a read-only parameter: robot_radius_m."),
        ("obstacle_radii_m", [0.5], "Trying to set a read-only parameter: obstacle_radii_m."),
        ("source", "scan", "Trying to set a read-only parameter: source."),
    ],
)
def test_what_cannot_be_set_is_refused_with_the_reason(
    graph: Graph, name: str, value: Any, reason: str
) -> None:
    sensor = Sensor(graph, {})
    before = sensor.node.sensor
    assert reason in graph.set_parameter("virtual_sensor", name, value)
    assert sensor.node.sensor is before


@pytest.mark.parametrize(
    ("parameters", "line"),
    [
        ({"source": "sonar"}, r"^source='sonar': unknown; choose one of obstacles, scan"),
        ({"sectors": 2}, r"^sectors=2: out of range; give a value in \[3, 3600\]"),
        (
            {"obstacle_radii_m": [0.3, -0.1]},
            r"^parameter obstacle_radii_m=\[0.3, -0.1\]: give fin",
        ),
        ({"obstacle_radii_m": [math.nan]}, r"^parameter obstacle_radii_m=\[nan\]: give finite"),
        ({"obstacle_radii_m": 0.3}, r"^parameter obstacle_radii_m=0.3: wrong type; give \[0.3"),
        ({"obstacle_radii_m": [1, 2]}, r"^parameter obstacle_radii_m=\[1, 2\]: wrong type"),
        ({"robot_radius_m": INF}, r"^robot_radius_m=inf"),
    ],
)
def test_bad_parameters_are_refused_at_start(
    graph: Graph, parameters: dict[str, Any], line: str
) -> None:
    with pytest.raises(ConfigError, match=line):
        graph.start(VirtualSensor, parameters)


def test_it_starts_afresh_when_time_is_set_back(graph: Graph) -> None:
    sensor = Sensor(graph, {"use_sim_time": True})
    clock = graph.writer(topics.CLOCK)

    def set_time(stamp: int) -> None:
        clock.publish(Clock(clock=time_msg(stamp)))
        graph.until(lambda: sensor.node.get_clock().now().nanoseconds == stamp)

    set_time(10**9)
    sensor.measure(odom(10**9), obstacles(10**9))
    assert not sensor.measure_all(odom(5), obstacles(5))
    set_time(5)
    assert len(sensor.measure_all(odom(5), obstacles(5))) == 1
