# SPDX-License-Identifier: Apache-2.0
"""recorder: writes every topic of the graph, and what explains the run, into an MCAP bag."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from geometry_msgs.msg import TwistStamped
from rclpy.clock import Clock, ClockType
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.parameter import parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock as ClockMsg

from ..core.errors import ConfigError
from ..messages import stamp_ns
from ..outputs import new_run_directory
from ..recording.configuration import attach_configuration
from ..recording.qos import OfferedQos
from ..recording.schemas import definition_of
from ..recording.writer import BagWriter
from . import params, topics
from .qos import offered
from .runtime import GraphNode, spin_node
from .settings import RecorderSettings, names


class Recorder(GraphNode):
    """The bag writer; raw bytes in, raw bytes out."""

    def __init__(self, **kwargs: Any) -> None:
        """Raise ConfigError or OutputError for what cannot be accepted or written."""
        super().__init__(topics.RECORDER, **kwargs)
        self.settings = s = params.declare(self, RecorderSettings(), read_only=True)
        try:
            self._facts = json.loads(s.run)
        except ValueError:
            raise ConfigError(f"parameter run={s.run!r}: not JSON; give an object") from None
        self._found: dict[str, dict[str, Any]] = {}
        self._askers: dict[str, AsyncParameterClient] = {}
        self._asked: set[str] = set()
        self._log_time_ns = 0
        self._latched: dict[str, bytes] = {}
        self._held: list[tuple[str, bytes]] = []
        self._explained = False
        self._types: dict[str, tuple[str, OfferedQos]] = {}
        self.directory = Path(s.output) if s.output else new_run_directory()
        self.writer = BagWriter(self.directory)
        for topic in topics.GRAPH:
            self._record(topic)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(0.25, self._flush, clock=steady)
        self._wanted = names(s.nodes)
        if self._wanted:
            self._collector = self.create_timer(0.05, self._collect, clock=steady)
        self.offer_ready(names(s.wait_for))
        self.get_logger().info(f"recording to {self.directory}")

    def _record(self, topic: topics.Topic) -> None:
        stamped = topic is topics.CMD_VEL and self.settings.enable_stamped_cmd_vel
        kind = TwistStamped if stamped else topic.type
        name = self.resolve_topic_name(topic.name)
        self._types[name] = (_type_name(kind), offered(topic.qos))
        definition_of(_type_name(kind))  # found now, so that no first message waits for it
        callback: Callable[[bytes], None] = partial(self._on_message, name)
        if topic is topics.CLOCK and self.settings.sim_time:
            callback = self._on_clock
        profiles = topics.recording_qos(topic)
        if len(profiles) > 1:
            callback = partial(self._on_latched, name)
        for qos in profiles:
            self.create_subscription(
                kind,
                topic.name,
                callback,
                qos,
                event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
                raw=True,
            )

    def _on_latched(self, name: str, data: bytes) -> None:
        if self._latched.get(name) != data:  # it comes twice
            self._latched[name] = data
            self._on_message(name, data)

    def _on_clock(self, data: bytes) -> None:
        self._log_time_ns = stamp_ns(deserialize_message(data, ClockMsg).clock)
        for name, held in self._held:
            self._write(name, held)
        self._held.clear()
        self._write("/clock", data)

    def _on_message(self, name: str, data: bytes) -> None:
        if not self.settings.sim_time:
            self._log_time_ns = time.time_ns()
        elif not self._log_time_ns:
            self._held.append((name, data))  # latched before the first tick
            return
        self._write(name, data)

    def _write(self, name: str, data: bytes) -> None:
        if name in self._types:  # its writer came late
            self._announce(name)
        self.writer.write(name, data, self._log_time_ns, self._log_time_ns)

    def _announce(self, name: str) -> None:
        self.writer.add_topic(name, *self._types.pop(name))

    def _flush(self) -> None:
        self.writer.flush_if_due(time.monotonic_ns())

    def _collect(self) -> None:
        """Ask every node once for all its parameters."""
        for node in self._wanted - self._asked:
            client = self._askers.setdefault(node, AsyncParameterClient(self, node))
            if client.services_are_ready():
                self._asked.add(node)
                client.list_parameters(callback=partial(self._on_listed, node))
        if self._wanted <= self._found.keys():
            self._collector.cancel()
            self.explain(self._found)

    def _on_listed(self, node: str, future: Any) -> None:
        listed = list(future.result().result.names)
        self._askers[node].get_parameters(
            listed, callback=partial(self._on_parameters, node, listed)
        )

    def _on_parameters(self, node: str, listed: list[str], future: Any) -> None:
        values = map(parameter_value_to_python, future.result().values)
        self._found[node] = {k: params.plain(v) for k, v in zip(listed, values)}

    def explain(self, found: dict[str, dict[str, Any]]) -> None:
        """Put the nodes' parameters and the facts of the run into the bag, once."""
        if not self._explained:
            self._explained = True
            for name in [name for name in self._types if self.count_publishers(name)]:
                self._announce(name)
            attach_configuration(self.writer, {"nodes": found, "run": self._facts})
            self.writer.flush()

    def missing(self) -> str:
        """Until the parameters of all nodes are in the bag, whose are missing."""
        absent = sorted(self._wanted - self._found.keys())
        return f"parameters of {', '.join(absent)} not read yet" if absent else ""

    def close(self) -> None:
        """Write what is held and finish the bag."""
        if hasattr(self, "writer"):
            for name, held in self._held:
                self._log_time_ns = self._log_time_ns or time.time_ns()
                self._write(name, held)
            self.explain(self._found)
            self.writer.close()


def _type_name(kind: Any) -> str:
    return f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}"


def main(args: list[str]) -> int:
    """Entry point."""
    return spin_node(Recorder, args)
