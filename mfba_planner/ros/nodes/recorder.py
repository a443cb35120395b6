# SPDX-License-Identifier: Apache-2.0
"""recorder: writes every topic of the graph, and what explains the run, into an MCAP bag."""

from __future__ import annotations

import json
import time
from functools import partial
from pathlib import Path
from typing import Any

from geometry_msgs.msg import TwistStamped
from rclpy.executors import Executor
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock as ClockMsg

from ...core.errors import ConfigError
from ...core.outputs import new_run_directory
from ...recording.bag_writer import BagWriter
from ...recording.configuration import attach_configuration
from ...recording.from_messages import stamp_ns
from ...recording.message_definitions import definition_of
from ...recording.qos_profiles import OfferedQos
from ..endpoints.robot_namespace import everywhere
from ..interface import parameters, topics
from ..interface.qos_conversion import offered
from ..interface.serialized_message import has_header, header_stamp_ns, type_name
from ..node_parameters import RecorderSettings, names
from ..runtime.drain import drain
from ..runtime.node_runtime import GraphNode, spin_node
from ..runtime.parameter_client import Found, ParameterClient
from ..runtime.polled_subscriptions import Deliver, PolledSubscriptions, SerializedMessage

EMPTY_PERIOD_S = 0.02  # far below what a crash may cost, and a hundred times a message's cost


class Recorder(GraphNode):
    """The bag writer; raw bytes in, raw bytes out."""

    def __init__(self, **kwargs: Any) -> None:
        """Raise ConfigError or OutputError for what cannot be accepted or written."""
        super().__init__(topics.RECORDER, **kwargs)
        self.settings = s = parameters.declare(self, RecorderSettings(), read_only=True)
        self._facts = _facts(s.run)
        self._log_time_ns = self._tick_before_ns = 0
        self._held: list[tuple[str, bytes]] = []
        self._explained = False
        self._types: dict[str, tuple[str, OfferedQos]] = {}
        self.directory = Path(s.output) if s.output else new_run_directory()
        self.writer = BagWriter(self.directory)
        self._polled = PolledSubscriptions()
        for topic, called in everywhere(names(s.namespaces)):
            self._record(topic, called)
        self.every(EMPTY_PERIOD_S, self._polled.empty)
        self.every(0.25, self._flush)
        self._parameter_client = ParameterClient(self, names(s.nodes), self.explain)
        self.advertise_ready(names(s.wait_for))
        self.get_logger().info(f"recording to {self.directory}")

    def _record(self, topic: topics.Topic, called: str) -> None:
        stamped = topic is topics.CMD_VEL and self.settings.enable_stamped_cmd_vel
        kind = TwistStamped if stamped else topic.type
        name = self.resolve_topic_name(called)
        self._types[name] = (type_name(kind), offered(topic.qos))
        definition_of(type_name(kind))  # found now, so that no first message waits for it
        is_of_tick = topic.every_tick and has_header(kind)
        deliver: Deliver = partial(self._on_message, name, is_of_tick)
        if topic is topics.CLOCK and self.settings.sim_time:
            deliver = self._on_clock
        # In simulated time world_sim writes what every tick brings, and nobody else.
        from_anyone = not (topic.every_tick and self.settings.sim_time)
        profiles = topics.recording_qos(topic, from_anyone=from_anyone)
        self.subscribe_polled(self._polled, kind, called, deliver, profiles)

    def _on_clock(self, message: SerializedMessage) -> None:
        self._tick_before_ns = self._log_time_ns
        self._log_time_ns = stamp_ns(deserialize_message(message.data, ClockMsg).clock)
        for name, data in [*self._held, ("/clock", message.data)]:
            self._write(name, data, self._log_time_ns)
        self._held.clear()

    def _on_message(self, name: str, is_of_tick: bool, message: SerializedMessage) -> None:
        log_time_ns = self._log_time_ns
        if not self.settings.sim_time:
            log_time_ns = message.received_ns or time.time_ns()  # not all middleware says
        elif not log_time_ns:
            self._held.append((name, message.data))  # latched before the first tick
            return
        elif is_of_tick and header_stamp_ns(message.data) == self._tick_before_ns:
            log_time_ns = self._tick_before_ns or log_time_ns  # said while the world moved on
        self._write(name, message.data, log_time_ns)

    def _write(self, name: str, data: bytes, log_time_ns: int) -> None:
        if name in self._types:  # its writer came late
            self._announce(name)
        self.writer.write(name, data, log_time_ns, log_time_ns)

    def _announce(self, name: str) -> None:
        self.writer.add_topic(name, *self._types.pop(name))

    def _flush(self) -> None:
        self.writer.flush_if_due(time.monotonic_ns())

    def explain(self, found: Found) -> None:
        """Put the nodes' parameters and the facts of the run into the bag, once."""
        if not self._explained:
            self._explained = True
            for name in [name for name in self._types if self.count_publishers(name)]:
                self._announce(name)
            attach_configuration(self.writer, {"nodes": found, "run": self._facts})
            self.writer.flush()

    def missing(self) -> str:
        """Until the parameters of all nodes are in the bag, whose are missing."""
        absent = ", ".join(self._parameter_client.absent)
        return f"parameters of {absent} not read yet" if absent else ""

    def drain(self, executor: Executor) -> None:
        """Record what is under way."""
        drain(executor, self._count)

    def _count(self) -> int:
        self._polled.empty()
        return self.writer.message_count

    def close(self) -> None:
        """Write what has come or is held and finish the bag."""
        for _ in range(2):  # what was sent during the first round waits for the second
            self._polled.empty()
        now_ns = time.time_ns()  # of a clock that never came
        for name, held in self._held:
            self._write(name, held, now_ns)
        self.explain(self._parameter_client.found)
        self.writer.close()


def _facts(text: str) -> dict[str, Any]:
    try:
        facts = json.loads(text)
    except ValueError:
        facts = None
    if not isinstance(facts, dict):
        raise ConfigError(f"parameter run={text!r}: not JSON of an object; give '{{}}' or more")
    return facts


def main(args: list[str]) -> int:
    """Entry point."""
    return spin_node(Recorder, args)
