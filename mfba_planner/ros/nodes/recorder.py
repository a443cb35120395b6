# SPDX-License-Identifier: Apache-2.0
"""recorder: writes every topic of the graph and the run's configuration into an MCAP bag."""

from __future__ import annotations

import time
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any

from geometry_msgs.msg import TwistStamped
from rclpy.executors import Executor
from rclpy.serialization import deserialize_message
from std_msgs.msg import String

from ...core.output_files import new_run_directory
from ...recording.bag_qos import OfferedQos
from ...recording.bag_writer import BagWriter
from ...recording.configuration_attachment import PARAMETERS, attach_configuration
from ...recording.message_definitions import definition_of
from ..endpoints.robot_namespace import graph_topics
from ..endpoints.simulated_log_times import SimulatedLogTimes, Timed
from ..endpoints.tick_counts import are_unequal
from ..interface import parameters, topics
from ..interface.qos_conversion import offered
from ..interface.serialized_message import has_header, header_stamp_ns, type_name
from ..node_settings import RecorderSettings, names
from ..runtime.base_node import GraphNode
from ..runtime.drain_subscriptions import drain
from ..runtime.parameter_client import NodeParameters, ParameterClient, with_full_names
from ..runtime.polled_subscriptions import Deliver, PolledSubscriptions, SerializedMessage
from ..runtime.spin_node import spin_node

POLL_PERIOD_S = 0.02  # a crash loses no more, and polling costs a hundredth of it


class Recorder(GraphNode):
    """Writes serialized messages into the bag without decoding them."""

    def __init__(self, **kwargs: Any) -> None:
        """Raise ConfigError or OutputError for what cannot be accepted or written."""
        super().__init__(topics.RECORDER, **kwargs)
        self.settings = s = parameters.declare(self, RecorderSettings(), read_only=True)
        self._facts = s.facts()
        self._log_times = SimulatedLogTimes()
        self._attached = False
        self._types: dict[str, tuple[str, OfferedQos]] = {}
        self.directory = Path(s.output) if s.output else new_run_directory()
        self.writer = BagWriter(self.directory)
        self._polled = PolledSubscriptions()
        for topic, name in graph_topics(names(s.namespaces)):
            self._record(topic, name)
        self.create_wall_timer(POLL_PERIOD_S, self._polled.poll)
        self.create_wall_timer(0.25, self._flush)
        self._parameter_client = ParameterClient(self, names(s.nodes), self.attach_parameters)
        self.advertise_ready(names(s.wait_for))
        self.get_logger().info(f"recording to {self.directory}")

    def _record(self, topic: topics.Topic, relative_name: str) -> None:
        stamped = topic is topics.CMD_VEL and self.settings.enable_stamped_cmd_vel
        message_type = TwistStamped if stamped else topic.type
        name = self.resolve_topic_name(relative_name)
        self._types[name] = (type_name(message_type), offered(topic.qos))
        definition_of(type_name(message_type))  # loaded now, so that no first message waits for it
        is_of_tick = (topic.every_tick or topic.some_ticks) and has_header(message_type)
        deliver: Deliver = partial(self._on_message, name, is_of_tick)
        if topic is topics.CLOCK and self.settings.sim_time:
            deliver = self._on_clock
        elif topic in topics.PARAMETERS.values():
            deliver = partial(self._on_parameters, name, relative_name)
        # In simulated time only nodes of ours publish the topics of every tick.
        foreign_writers = not (topic.every_tick and self.settings.sim_time)
        profiles = topics.recording_qos(topic, foreign_writers=foreign_writers)
        self.subscribe_polled(self._polled, message_type, relative_name, deliver, profiles)

    def _on_clock(self, message: SerializedMessage) -> None:
        self._write_all(self._log_times.add_clock("/clock", message))

    def _on_message(self, name: str, is_of_tick: bool, message: SerializedMessage) -> None:
        if self.settings.sim_time:
            stamp_ns = header_stamp_ns(message.data) if is_of_tick else 0
            self._write_all(self._log_times.add(name, message, stamp_ns))
        else:  # not all middleware sets the time of reception
            self._write(name, message.data, message.received_ns or time.time_ns())

    def _on_parameters(self, name: str, relative_name: str, message: SerializedMessage) -> None:
        node = relative_name.removesuffix(PARAMETERS)
        self._parameter_client.published(node, deserialize_message(message.data, String).data)
        self._on_message(name, False, message)

    def _write_all(self, messages: Iterable[Timed]) -> None:
        for message in messages:
            self._write(*message)

    def _write(self, name: str, data: bytes, log_time_ns: int) -> None:
        if name in self._types:  # it had no publisher when the parameters were attached
            self._add_topic(name)
        self.writer.write(name, data, log_time_ns, log_time_ns)

    def _add_topic(self, name: str) -> None:
        self.writer.add_topic(name, *self._types.pop(name))

    def _flush(self) -> None:
        self.writer.flush_if_due(time.monotonic_ns())

    def attach_parameters(self, values: NodeParameters) -> None:
        """Write the nodes' parameters and the run's facts into the bag, once."""
        if not self._attached:
            self._attached = True
            for name in [name for name in self._types if self.count_publishers(name)]:
                self._add_topic(name)
            found = with_full_names(values, self.get_namespace())
            attach_configuration(self.writer, {"nodes": found, "run": self._facts})
            self.writer.flush()

    def missing(self) -> str:
        """The nodes whose parameters are not in the bag yet."""
        pending = self._parameter_client.pending
        return f"parameters of {', '.join(pending)} not read yet" if pending else ""

    def drain(self, executor: Executor) -> None:
        """Record what was sent already."""
        drain(executor, self._count, self._is_behind)

    def _is_behind(self) -> bool:
        """Whether messages of a tick are missing; in real time some may have been dropped."""
        robots = names(self.settings.namespaces)
        counts = self.writer.counts
        return self.settings.sim_time and are_unequal(counts, robots, self.resolve_topic_name)

    def _count(self) -> int:
        self._polled.poll()
        return self.writer.message_count

    def close(self) -> None:
        """Write what was received or is held and finish the bag."""
        for _ in range(2):  # what was sent during the first poll waits for the second
            self._polled.poll()
        self._write_all(self._log_times.take_held())
        self.attach_parameters(self._parameter_client.values)
        self.writer.close()


def main(args: list[str]) -> int:
    """Entry point."""
    return spin_node(Recorder, args)
