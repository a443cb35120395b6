# SPDX-License-Identifier: Apache-2.0
"""GraphNode, the base class of all nodes: publishers and subscriptions by topic, and ~/ready."""

from __future__ import annotations

import inspect
import json
import sys
import time
from collections.abc import Callable, Collection
from typing import Any

from rclpy.clock import Clock, ClockType, JumpHandle, JumpThreshold
from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.exceptions import InvalidParameterTypeException
from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from rclpy.timer import Timer
from std_srvs.srv import Trigger

from ...core.errors import ConfigError
from ...core.ros_arguments import split_ros_args
from ..interface import parameters
from ..interface.tick_decoders import decoder
from ..interface.topics import PARAMETERS, Topic, expected_readers, reading_qos, with_depth
from .connection_check import type_mismatch
from .given_parameters import check_given_parameters
from .polled_subscriptions import Deliver, DuplicateFilter, PolledSubscriptions

SPIN_S = 0.1  # longest time until a signal is noticed
READERS_TIMEOUT_S = 1.0  # longest wait for what was published to arrive


class GraphNode(Node):
    """A node of the graph: publishers made from topics.py, and the service ~/ready."""

    def __init__(self, name: str, **kwargs: Any) -> None:
        """Pass rclpy's keyword arguments on (context, parameter_overrides, ...).

        Raises ConfigError for parameters of the command line that cannot be used.
        """
        try:
            super().__init__(name, **kwargs)
        except InvalidParameterTypeException:  # of rclpy's own parameter
            raise ConfigError("use_sim_time: wrong type; give true or false") from None
        if kwargs.get("context") is None:  # the program's own node
            check_given_parameters(self, split_ros_args(sys.argv[1:])[1])
        self._leave_qos_events()
        self.finished = False
        self._kind = name
        self._advertised: list[tuple[Topic, Publisher]] = []
        self._subscribed: list[Subscription] = []
        self._peers: set[str] = set()
        self._jump_handles: list[JumpHandle] = []

    def _leave_qos_events(self) -> None:
        """Remove the QoS events of rclpy's own topics, for which the executor would wait."""
        endpoints: list[Any] = [*self.publishers, *self.subscriptions]
        for endpoint in endpoints:
            while endpoint.event_handlers:
                handler = endpoint.event_handlers.pop()
                self.remove_waitable(handler)
                handler.destroy()

    def advertise(self, topic: Topic, message_type: Any = None) -> Publisher:
        """Create the publisher of a topic of topics.py.

        Without rclpy's QoS events: the executor would wait for each of them at every spin.
        """
        publisher = self.create_publisher(
            message_type or topic.type,
            topic.name,
            topic.qos,
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
        )
        self._advertised.append((topic, publisher))
        return publisher

    def subscribe(
        self,
        topic: Topic,
        callback: Callable[..., None],
        message_type: Any = None,
        *,
        foreign_writers: bool = True,
    ) -> None:
        """Subscribe to a topic of topics.py; twice where foreign writers may offer less QoS."""
        profiles = reading_qos(topic, foreign_writers=foreign_writers)
        self.create_subscriptions(message_type or topic.type, topic.name, callback, profiles)

    def subscribe_with_info(
        self, topic: Topic, callback: Callable[[Any, Any], None], depth: int
    ) -> None:
        """As subscribe, with a queue of this depth; callback gets rclpy's MessageInfo as well."""
        profiles = with_depth(reading_qos(topic), depth)
        self.create_subscriptions(topic.type, topic.name, callback, profiles, info=True)

    def create_subscriptions(
        self,
        message_type: Any,
        name: str,
        callback: Callable[..., None],
        profiles: list[QoSProfile],
        *,
        info: bool = False,
    ) -> None:
        """Subscribe with each QoS profile; a message that fits more than one is delivered once.

        With one profile, or with info, a callback of two arguments gets rclpy's MessageInfo too.
        Messages of the types of tick_decoders.py are named tuples.
        """
        # Without rclpy's QoS events, as in advertise(); connection_check.py names what does not
        # fit, and not a publisher that fits another of the profiles.
        events = SubscriptionEventCallbacks(use_default_callbacks=False)
        decode = decoder(message_type)
        call: Any = callback if decode is None else _decoded(callback, decode)
        if len(profiles) > 1:
            call = _without_duplicates(call, info=info)
        for qos in profiles:
            self._subscribed.append(
                self.create_subscription(
                    message_type, name, call, qos, event_callbacks=events, raw=decode is not None
                )
            )

    def subscribe_polled(
        self,
        polled: PolledSubscriptions,
        message_type: Any,
        name: str,
        deliver: Deliver,
        profiles: list[QoSProfile],
    ) -> None:
        """Subscribe with each QoS profile to serialized messages, which no executor waits for."""
        no_events = SubscriptionEventCallbacks(use_default_callbacks=False)
        subscriptions = [
            self.create_subscription(
                message_type,
                name,
                lambda _: None,
                qos,
                callback_group=polled.group,
                event_callbacks=no_events,
                raw=True,
            )
            for qos in profiles
        ]
        polled.add(subscriptions, deliver)

    def unsubscribe(self, keep: Collection[Topic] = ()) -> None:
        """Destroy what advertise and subscribe created, except the publishers of these topics."""
        while self._subscribed:
            self.destroy_subscription(self._subscribed.pop())
        for topic, publisher in self._advertised:
            if topic not in keep:
                self.destroy_publisher(publisher)
        self._advertised = [(topic, made) for topic, made in self._advertised if topic in keep]

    def create_wall_timer(self, period_s: float, callback: Callable[[], None]) -> Timer:
        """Call back every period_s of real time, whatever the node's clock does."""
        return self.create_timer(period_s, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def on_time_set_back(self, callback: Callable[[], None]) -> None:
        """Call back whenever the node's clock (with use_sim_time: /clock) is set back."""
        threshold = JumpThreshold(
            min_forward=None, min_backward=Duration(nanoseconds=-1), on_clock_change=False
        )
        # rclpy itself does not keep the handle alive.
        self._jump_handles.append(
            self.get_clock().create_jump_callback(threshold, post_callback=lambda _: callback())
        )

    def advertise_ready(self, peers: set[str]) -> None:
        """Advertise ~/ready: true once missing() is empty for these peers.

        Called last in a constructor: parameters that were given but not declared are logged.
        """
        parameters.warn_of_unknown(self)
        self._advertise_parameters()
        self._peers = peers
        self.create_service(Trigger, "~/ready", self._on_ready)

    def _advertise_parameters(self) -> None:
        """Publish the parameters, latched, now and when they change.

        A recording can then be decided again, whoever makes it.
        """
        topic = PARAMETERS.get(self._kind)
        if topic is None:
            return
        publisher = self.create_publisher(
            topic.type,
            topic.name,
            topic.qos,
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
        )

        def publish(_: object = None) -> None:
            text = json.dumps(parameters.values(self), sort_keys=True)
            publisher.publish(topic.type(data=text))

        publish()
        self.add_post_set_parameters_callback(publish)

    def announce(self, text: str) -> None:
        """Log which topics the node listens to, and what it does with them."""
        names = dict.fromkeys(subscription.topic_name for subscription in self._subscribed)
        self.get_logger().info(f"listening to {', '.join(names)}; {text}")

    def missing(self) -> str:
        """What is missing before a first message would reach all peers; empty: nothing.

        Also a node, any, whose message type differs on an input or on an output for our nodes.
        """
        for topic, publisher in self._advertised:
            expected = expected_readers(topic, self._peers - {self.get_name()})
            if not expected:
                continue
            if not_reached := readers_not_reached(self, publisher, expected):
                return f"{topic.name} waits for {', '.join(sorted(not_reached))}"
        outputs = [made.topic_name for topic, made in self._advertised if topic.readers]
        inputs = [subscription.topic_name for subscription in self._subscribed]
        mismatch = type_mismatch(self, [*outputs, *inputs])
        return mismatch or (self.awaits() if self._peers else "")

    def awaits(self) -> str:
        """Which input the node waits for, "" for none; without peers it is ready all the same."""
        return ""

    def _on_ready(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        missing = self.missing()
        response.message = missing or self.awaits()
        response.success = not missing
        return response

    def count_callers(self) -> int:
        """How many clients this node's services have."""
        return sum(self.count_clients(service.service_name) for service in self.services)

    def drain(self, executor: Executor) -> None:
        """Receive what was sent already; called once after a signal, before close."""

    def wait_for_readers(self, timeout_s: float = READERS_TIMEOUT_S) -> bool:
        """Whether all reliable readers have what this node published, after a wait if need be.

        A writer that is destroyed takes along what a busy reader has not fetched yet.
        """
        deadline = time.monotonic() + timeout_s
        return all(
            publisher.wait_for_all_acked(Duration(seconds=max(deadline - time.monotonic(), 0.0)))
            for _, publisher in self._advertised
        )

    def spin_once(self, executor: Executor) -> None:
        """One iteration of the process's loop, SPIN_S long at most."""
        executor.spin_once(timeout_sec=SPIN_S)

    def close(self) -> None:
        """Release what must not be lost; called once, before the node is destroyed."""

    def destroy_node(self) -> None:
        """Unregister the clock callbacks, then destroy the node."""
        while self._jump_handles:
            self._jump_handles.pop().unregister()
        super().destroy_node()


def _decoded(callback: Callable[..., None], decode: Callable[[bytes], Any]) -> Any:
    """The callback for serialized messages, with as many arguments."""
    try:
        inspect.signature(callback).bind(None)
    except TypeError:
        return lambda data, info: callback(decode(data), info)
    return lambda data: callback(decode(data))


def readers_not_reached(node: Node, publisher: Publisher, readers: set[str]) -> set[str]:
    """Which of these nodes do not subscribe yet, or all if not every subscription is matched."""
    known = node.get_subscriptions_info_by_topic(publisher.topic_name)
    found = [info.node_name for info in known if info.node_name in readers]
    absent = readers.difference(found)
    return absent if absent or publisher.get_subscription_count() >= len(found) else readers


def _without_duplicates(
    callback: Callable[..., None], *, info: bool
) -> Callable[[Any, Any], None]:
    """Call back once per message, though two subscriptions deliver it."""
    duplicates = DuplicateFilter()

    def call(message: Any, message_info: Any) -> None:
        if duplicates.is_new(message_info):
            callback(*((message, message_info) if info else (message,)))

    return call
