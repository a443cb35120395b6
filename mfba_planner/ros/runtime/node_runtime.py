# SPDX-License-Identifier: Apache-2.0
"""How every node lives and dies: init, spin, and a clean end on SIGINT and SIGTERM."""

from __future__ import annotations

import signal
from collections import Counter
from collections.abc import Callable, Collection
from typing import Any

import rclpy
from rclpy.clock import Clock, ClockType, JumpHandle, JumpThreshold
from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions
from rclpy.subscription import Subscription
from rclpy.timer import Timer
from std_srvs.srv import Trigger

from ...core.errors import FrameError, StampError
from ..interface import parameters
from ..interface.topics import Topic, expected_readers, reading_qos
from .polled_subscriptions import Deliver, DuplicateFilter, PolledSubscriptions

SPIN_S = 0.1  # longest time until a signal is noticed


class StopFlag:
    """Set by SIGINT and SIGTERM; nothing is raised, so no write is ever torn apart."""

    def __init__(self) -> None:
        """Take over both signals (main thread only)."""
        self.is_set = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._on_signal)

    def _on_signal(self, *_: object) -> None:
        self.is_set = True


def make_executor(context: rclpy.Context | None = None) -> Executor:
    """The executor all nodes use; MultiThreadedExecutor is far slower and drops messages."""
    return SingleThreadedExecutor(context=context)


def spin_node(make_node: Callable[[], GraphNode], args: list[str]) -> int:
    """Run one node until it is told to stop; return 0. MfbaErrors of the node pass through."""
    stop = StopFlag()
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    node: GraphNode | None = None
    executor = make_executor()
    try:
        node = make_node()
        executor.add_node(node)
        while not stop.is_set and not node.finished:
            node.turn(executor)
        node.drain(executor)
        return 0
    finally:
        try:
            if node is not None:
                node.close()
        finally:
            # Left to the garbage collector, it may find its own guard condition gone, and says so.
            executor.shutdown()
            if node is not None:
                node.destroy_node()
            rclpy.try_shutdown()


class GraphNode(Node):
    """A node of the graph: publishers made from topics.py, and the service ~/ready."""

    def __init__(self, name: str, **kwargs: Any) -> None:
        """Pass rclpy's keyword arguments on (context, parameter_overrides, ...)."""
        super().__init__(name, **kwargs)
        self.finished = False
        self._writers: list[tuple[Topic, Publisher]] = []
        self._peers: set[str] = set()
        self._jumps: list[JumpHandle] = []
        self._readers: list[Subscription] = []

    def advertise(self, topic: Topic, message_type: Any = None) -> Publisher:
        """Create the publisher of a topic of topics.py.

        Without rclpy's QoS events: each is one more thing to wait for at every turn of the
        executor, and a reader with the wrong QoS is warned on its own side.
        """
        publisher = self.create_publisher(
            message_type or topic.type,
            topic.name,
            topic.qos,
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
        )
        self._writers.append((topic, publisher))
        return publisher

    def listen(
        self,
        topic: Topic,
        callback: Callable[..., None],
        kind: Any = None,
        *,
        from_anyone: bool = True,
    ) -> None:
        """Create the subscription of a topic of topics.py; two of them where others write too."""
        profiles = reading_qos(topic, from_anyone=from_anyone)
        self.subscribe(kind or topic.type, topic.name, callback, profiles)

    def subscribe(
        self,
        kind: Any,
        name: str,
        callback: Callable[..., None],
        profiles: list[QoSProfile],
    ) -> None:
        """Subscribe with each QoS profile; a message that fits more than one comes once.

        With one profile, a callback of two arguments is given rclpy's MessageInfo as well.
        """
        several = len(profiles) > 1
        # With several, a writer that does not fit the one fits the other: no warning then.
        events = SubscriptionEventCallbacks(use_default_callbacks=not several)
        call: Any = _once(callback) if several else callback
        for qos in profiles:
            self._readers.append(
                self.create_subscription(kind, name, call, qos, event_callbacks=events)
            )

    def subscribe_polled(
        self,
        polled: PolledSubscriptions,
        kind: Any,
        name: str,
        deliver: Deliver,
        profiles: list[QoSProfile],
    ) -> None:
        """Subscribe with each QoS profile to serialized messages, which no executor waits for."""
        silent = SubscriptionEventCallbacks(use_default_callbacks=False)
        subscriptions = [
            self.create_subscription(
                kind,
                name,
                lambda _: None,
                qos,
                callback_group=polled.group,
                event_callbacks=silent,
                raw=True,
            )
            for qos in profiles
        ]
        polled.add(subscriptions, deliver)

    def unsubscribe(self, keep: Collection[Topic] = ()) -> None:
        """Destroy what advertise and listen have created, but the publishers of these topics."""
        while self._readers:
            self.destroy_subscription(self._readers.pop())
        for topic, publisher in self._writers:
            if topic not in keep:
                self.destroy_publisher(publisher)
        self._writers = [(topic, made) for topic, made in self._writers if topic in keep]

    def every(self, period_s: float, callback: Callable[[], None]) -> Timer:
        """Call back every period_s of real time, whatever the node's clock does."""
        return self.create_timer(period_s, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def on_time_set_back(self, callback: Callable[[], None]) -> None:
        """Call back whenever the node's clock (with use_sim_time: /clock) is set back."""
        threshold = JumpThreshold(
            min_forward=None, min_backward=Duration(nanoseconds=-1), on_clock_change=False
        )
        # rclpy itself does not keep the handle alive.
        self._jumps.append(
            self.get_clock().create_jump_callback(threshold, post_callback=lambda _: callback())
        )

    def advertise_ready(self, peers: set[str]) -> None:
        """Offer ~/ready: true once every peer's subscription to our topics is matched.

        The last thing a node does to get going: what it was told in vain is named here.
        """
        parameters.warn_of_unknown(self)
        self._peers = peers
        self.create_service(Trigger, "~/ready", self._on_ready)

    def missing(self) -> str:
        """What is still missing before a first message would reach everybody; empty: nothing."""
        for topic, publisher in self._writers:
            expected = expected_readers(topic, self._peers - {self.get_name()})
            if not expected:
                continue
            known = self.get_subscriptions_info_by_topic(publisher.topic_name)
            found = [info.node_name for info in known if info.node_name in expected]
            absent = expected.difference(found)
            if absent or publisher.get_subscription_count() < len(found):
                return f"{topic.name} waits for {', '.join(sorted(absent or expected))}"
        return ""

    def _on_ready(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.message = self.missing()
        response.success = not response.message
        return response

    def drain(self, executor: Executor) -> None:
        """Take in what has been sent already; called once after a signal, before close."""

    def turn(self, executor: Executor) -> None:
        """One turn of the process's loop, SPIN_S long at most."""
        executor.spin_once(timeout_sec=SPIN_S)

    def close(self) -> None:
        """Release what must not be lost; called once, before the node is destroyed."""

    def destroy_node(self) -> None:
        """Let go of the clock, then of the node."""
        while self._jumps:
            self._jumps.pop().unregister()
        super().destroy_node()


def _once(callback: Callable[[Any], None]) -> Callable[[Any, Any], None]:
    """Hand each message on once, though two subscriptions bring it."""
    once = DuplicateFilter()

    def call(message: Any, info: Any) -> None:
        if once.is_new(info):
            callback(message)

    return call


_KINDS = {FrameError: "frame", StampError: "stamp"}


class Refusals:
    """Counts the inputs a node refused, and says so once a second at most."""

    def __init__(self, node: Node) -> None:
        """Start at 0."""
        self.by_kind: Counter[str] = Counter()
        self.last = ""
        self._node = node

    @property
    def count(self) -> int:
        """How many were refused."""
        return self.by_kind.total()

    def add(self, error: Exception, source: str = "input") -> None:
        """Count one refused input of a source, by what is wrong with it."""
        kind = next((name for of, name in _KINDS.items() if isinstance(error, of)), "value")
        self.by_kind[f"{source}: {kind}"] += 1
        self.last = str(error)
        self._node.get_logger().warning(
            f"refused ({self.count} so far): {error}", throttle_duration_sec=1.0
        )
