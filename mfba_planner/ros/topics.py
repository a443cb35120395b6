# SPDX-License-Identifier: Apache-2.0
"""The graph on one page: every topic's name, type, writers, readers and QoS."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseArray, PoseStamped, PoseWithCovarianceStamped, Twist
from nav_msgs.msg import Odometry, Path
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_msgs.msg import UInt8MultiArray
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Topic:
    """One row of the graph's table; every_tick topics carry one message per tick."""

    name: str
    type: Any
    writers: tuple[str, ...] = ()
    readers: tuple[str, ...] = ()
    qos: QoSProfile
    every_tick: bool = False


CLOCK = Topic(
    name="/clock", type=Clock, writers=(WORLD_SIM,), readers=(), qos=TICK_QOS, every_tick=True
)
ODOM = Topic(
    name="odom",
    type=Odometry,
    writers=(WORLD_SIM,),
    readers=(VIRTUAL_SENSOR, PLANNER),
    qos=TICK_QOS,
    every_tick=True,
)
OBSTACLES = Topic(
    name="obstacles",
    type=PoseArray,
    writers=(WORLD_SIM,),
    readers=(VIRTUAL_SENSOR,),
    qos=TICK_QOS,
    every_tick=True,
)
SCAN = Topic(name="scan", type=LaserScan, readers=(VIRTUAL_SENSOR,), qos=TICK_QOS)
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
    name="goal_pose", type=PoseStamped, writers=(WORLD_SIM,), readers=(PLANNER,), qos=LATCHED_QOS
)
GOAL_STEP = Topic(
    name="goal_step", type=PoseStamped, writers=(PLANNER,), qos=TICK_QOS, every_tick=True
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
OUTCOME = Topic(
    # "running", then how it ended (core.episode.Outcome) and after how many ticks
    name="outcome",
    type=DiagnosticStatus,
    writers=(WORLD_SIM,),
    qos=LATCHED_QOS,
)
INITIALPOSE = Topic(
    name="initialpose", type=PoseWithCovarianceStamped, readers=(WORLD_SIM,), qos=VIEW_QOS
)
MARKERS = Topic(name="markers", type=MarkerArray, writers=(WORLD_SIM, PLANNER), qos=VIEW_QOS)

GRAPH: tuple[Topic, ...] = (
    CLOCK,
    ODOM,
    OBSTACLES,
    SCAN,
    SECTORS,
    SENSORY_VECTOR,
    GOAL_POSE,
    GOAL_STEP,
    PLAN,
    TRAIL,
    CMD_VEL,
    DECISION,
    OUTCOME,
    INITIALPOSE,
    MARKERS,
)

try:  # not among the PyPI wheels; published and recorded where it is installed
    from tf2_msgs.msg import TFMessage
except ImportError:
    TF: Topic | None = None
else:
    TF = Topic(name="/tf", type=TFMessage, writers=(WORLD_SIM,), qos=TICK_QOS, every_tick=True)
    GRAPH += (TF,)


def expected_readers(topic: Topic, nodes: set[str]) -> int:
    """How many of the named nodes read a topic; the recorder reads every one."""
    return len(nodes.intersection(topic.readers)) + (RECORDER in nodes)


def reading_qos(topic: Topic) -> list[QoSProfile]:
    """What readers ask for: a latched topic also takes writers that are not (RViz is not).

    A latched message then comes twice.
    """
    latched = topic.qos.durability is DurabilityPolicy.TRANSIENT_LOCAL
    return [topic.qos, VIEW_QOS] if latched else [topic.qos]


def recording_qos(topic: Topic) -> list[QoSProfile]:
    """What a reader asks for that must not lose a message."""
    return [_reliable(5000, qos.durability) for qos in reading_qos(topic)]
