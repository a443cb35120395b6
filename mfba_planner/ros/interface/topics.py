# SPDX-License-Identifier: Apache-2.0
"""The graph on one page: every topic's name, type, writers, readers and QoS."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseArray, PoseStamped, PoseWithCovarianceStamped, Twist
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String, UInt8MultiArray
from visualization_msgs.msg import MarkerArray

WORLD_SIM = "world_sim"
VIRTUAL_SENSOR = "virtual_sensor"
PLANNER = "planner"
RECORDER = "recorder"


def _reliable(depth: int, durability: DurabilityPolicy) -> QoSProfile:
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=durability,
    )


# Deep enough that a reader may fall behind by a thousand ticks before anything is lost.
TICK_QOS = _reliable(1000, DurabilityPolicy.VOLATILE)
LATCHED_QOS = _reliable(1, DurabilityPolicy.TRANSIENT_LOCAL)
VIEW_QOS = _reliable(10, DurabilityPolicy.VOLATILE)
SENSOR_QOS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Topic:
    """A topic of the graph; those with every_tick carry one message per tick.

    With some_ticks the stamp is that of a tick, but not every tick has a message. least_qos is
    what foreign writers may offer, where that is less than qos.
    """

    name: str
    type: Any
    writers: tuple[str, ...] = ()
    readers: tuple[str, ...] = ()
    qos: QoSProfile
    least_qos: QoSProfile | None = None
    every_tick: bool = False
    some_ticks: bool = False


CLOCK = Topic(
    name="/clock", type=Clock, writers=(WORLD_SIM,), readers=(), qos=TICK_QOS, every_tick=True
)
ODOM = Topic(
    name="odom",
    type=Odometry,
    writers=(WORLD_SIM,),
    readers=(VIRTUAL_SENSOR, PLANNER),
    qos=TICK_QOS,
    least_qos=SENSOR_QOS,
    every_tick=True,
)
GROUND_TRUTH = Topic(
    # the true pose, where odometry is noisy
    name="ground_truth",
    type=Odometry,
    writers=(WORLD_SIM,),
    qos=TICK_QOS,
)
OBSTACLES = Topic(
    name="obstacles",
    type=PoseArray,
    writers=(WORLD_SIM,),
    readers=(VIRTUAL_SENSOR,),
    qos=TICK_QOS,
    every_tick=True,
)
SCAN = Topic(
    name="scan",
    type=LaserScan,
    writers=(WORLD_SIM,),  # where the simulated robot has a lidar
    readers=(VIRTUAL_SENSOR,),
    qos=TICK_QOS,
    least_qos=SENSOR_QOS,  # most lidars
)
SECTORS = Topic(
    name="sectors",
    type=LaserScan,
    writers=(VIRTUAL_SENSOR,),
    readers=(PLANNER,),
    qos=TICK_QOS,
    every_tick=True,
)
SENSORY_VECTOR = Topic(
    name="sensory_vector",
    type=UInt8MultiArray,
    writers=(VIRTUAL_SENSOR,),
    qos=TICK_QOS,
    every_tick=True,
)
GOAL_POSE = Topic(
    name="goal_pose",
    type=PoseStamped,
    writers=(WORLD_SIM,),
    readers=(PLANNER,),
    qos=LATCHED_QOS,
    least_qos=VIEW_QOS,  # RViz
)
GOAL_STEP = Topic(
    name="goal_step",
    type=PoseStamped,
    writers=(PLANNER,),
    readers=(WORLD_SIM,),  # its stamp is that of the cmd_vel sent after it
    qos=TICK_QOS,
    every_tick=True,
)
PLAN = Topic(name="plan", type=Path, writers=(PLANNER,), qos=TICK_QOS, every_tick=True)
TRAIL = Topic(name="trail", type=Path, writers=(WORLD_SIM,), qos=VIEW_QOS)
CMD_VEL = Topic(
    name="cmd_vel",
    type=Twist,  # TwistStamped with enable_stamped_cmd_vel
    writers=(PLANNER,),
    readers=(WORLD_SIM,),
    qos=TICK_QOS,
    every_tick=True,
)
DECISION = Topic(
    name="planner/decision",
    type=DiagnosticArray,
    writers=(PLANNER,),
    qos=TICK_QOS,
    every_tick=True,
)
MAP = Topic(
    # known before the drive, as Nav2's map_server publishes it
    name="map",
    type=OccupancyGrid,
    writers=(WORLD_SIM,),
    readers=(PLANNER,),
    qos=LATCHED_QOS,
)
LOCAL_MAP = Topic(
    # what stands, where the planner keeps a map; latched, as Nav2's map and costmaps
    name="local_map",
    type=OccupancyGrid,
    writers=(PLANNER,),
    qos=LATCHED_QOS,
    some_ticks=True,
)
OUTCOME = Topic(
    # "running", then how it ended (simulation.episode.Outcome) and after how many ticks
    name="outcome",
    type=DiagnosticStatus,
    writers=(WORLD_SIM,),
    qos=LATCHED_QOS,
)
# What a recorder of any kind needs to decide again: the nodes' parameters as JSON, latched.
PARAMETERS = {
    node: Topic(name=f"{node}/parameters", type=String, writers=(node,), qos=LATCHED_QOS)
    for node in (WORLD_SIM, VIRTUAL_SENSOR, PLANNER)
}
INITIALPOSE = Topic(
    name="initialpose", type=PoseWithCovarianceStamped, readers=(WORLD_SIM,), qos=VIEW_QOS
)
WAYPOINTS = Topic(name="waypoints", type=Path, readers=(PLANNER,), qos=VIEW_QOS)
DIAGNOSTICS = Topic(
    name="/diagnostics",
    type=DiagnosticArray,
    writers=(WORLD_SIM, VIRTUAL_SENSOR, PLANNER),
    qos=VIEW_QOS,
)
MARKERS = Topic(name="markers", type=MarkerArray, writers=(WORLD_SIM, PLANNER), qos=VIEW_QOS)

GRAPH: tuple[Topic, ...] = (
    CLOCK,
    ODOM,
    GROUND_TRUTH,
    OBSTACLES,
    SCAN,
    SECTORS,
    SENSORY_VECTOR,
    GOAL_POSE,
    WAYPOINTS,
    GOAL_STEP,
    PLAN,
    TRAIL,
    CMD_VEL,
    DECISION,
    MAP,
    LOCAL_MAP,
    OUTCOME,
    INITIALPOSE,
    MARKERS,
    DIAGNOSTICS,
    *PARAMETERS.values(),
)


def transform_topics() -> tuple[Topic, ...]:
    """/tf and /tf_static where tf2_msgs is installed: it is not among the PyPI wheels."""
    try:
        from tf2_msgs.msg import TFMessage
    except ImportError:
        return ()
    static_qos = _reliable(100, DurabilityPolicy.TRANSIENT_LOCAL)  # of many publishers
    writers = (WORLD_SIM,)
    return (
        Topic(name="/tf", type=TFMessage, writers=writers, qos=TICK_QOS, every_tick=True),
        Topic(name="/tf_static", type=TFMessage, writers=writers, qos=static_qos),
    )


TRANSFORMS = transform_topics()
GRAPH += TRANSFORMS


def expected_readers(topic: Topic, nodes: set[str]) -> set[str]:
    """Which of the named nodes read a topic; the recorder reads all topics."""
    return nodes.intersection((*topic.readers, RECORDER))


def reading_qos(topic: Topic, *, foreign_writers: bool = True) -> list[QoSProfile]:
    """The QoS that readers request; with foreign writers also the least that these may offer.

    A message may then be received twice: see polled_subscriptions.DuplicateFilter.
    """
    if topic.least_qos is None or not foreign_writers:
        return [topic.qos]
    return [topic.qos, topic.least_qos]


def recording_qos(topic: Topic, *, foreign_writers: bool = True) -> list[QoSProfile]:
    """The QoS of a reader that must not lose a message."""
    return with_depth(reading_qos(topic, foreign_writers=foreign_writers), 5000)


def with_depth(profiles: list[QoSProfile], depth: int) -> list[QoSProfile]:
    """The same QoS, but the last `depth` messages are kept."""
    return [
        QoSProfile(
            history=HistoryPolicy.KEEP_LAST,
            depth=depth,
            reliability=qos.reliability,
            durability=qos.durability,
        )
        for qos in profiles
    ]
