# SPDX-License-Identifier: Apache-2.0
"""The executor of the nodes calls what rclpy's calls, and starves nothing."""

import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from std_msgs.msg import Int64
from std_srvs.srv import Trigger
from waiting import spin_until

from mfba_planner.ros.runtime import node_executor
from mfba_planner.ros.runtime.base_node import GraphNode
from mfba_planner.ros.runtime.node_executor import NodeExecutor
from mfba_planner.ros.runtime.polled_subscriptions import PolledSubscriptions, SerializedMessage
from mfba_planner.ros.runtime.spin_node import make_executor

DEEP = QoSProfile(depth=100)


@pytest.fixture
def executor(ros_context: Context) -> Iterator[NodeExecutor]:
    made = NodeExecutor(context=ros_context)
    yield made
    made.shutdown()


@pytest.fixture
def node(ros_context: Context, executor: NodeExecutor) -> Iterator[Node]:
    made = rclpy.create_node("under_test", context=ros_context)
    executor.add_node(made)
    yield made
    made.destroy_node()


def writer(node: Node, topic: str) -> Publisher:
    return node.create_publisher(Int64, topic, DEEP)


def append_data_to(received: list[int]) -> Callable[[Any], None]:
    return lambda message: received.append(message.data)


def sequence(executor: Any, context: Context) -> list[str]:
    """What the executor calls when messages, a timer and a request wait for it."""
    node = rclpy.create_node("sequence", context=context)
    called: list[str] = []

    def receive(topic: str, message: Any) -> None:
        called.append(f"{topic}{message.data}")

    topics = ("a", "b", "c")
    for topic in topics:
        node.create_subscription(Int64, topic, partial(receive, topic), DEEP)

    def respond(_: Any, response: Any) -> Any:
        called.append("service")
        return response

    node.create_service(Trigger, "call", respond)
    client = node.create_client(Trigger, "call")
    assert client.wait_for_service(timeout_sec=30.0)
    publishers = {topic: writer(node, topic) for topic in topics}
    for number, topic in enumerate("bbbacab"):
        publishers[topic].publish(Int64(data=number))
    future = client.call_async(Trigger.Request())
    executor.add_node(node)
    spin_until(executor, lambda: future.done() and len(called) == 8)
    executor.remove_node(node)
    node.destroy_node()
    return called


def test_the_sequence_of_callbacks_is_that_of_rclpy(
    ros_context: Context, executor: NodeExecutor
) -> None:
    reference = SingleThreadedExecutor(context=ros_context)
    expected = sequence(reference, ros_context)
    reference.shutdown()
    assert expected[:3] == ["a3", "b0", "c4"]
    found = sequence(executor, ros_context)
    messages = [name for name in expected if name != "service"]
    assert [name for name in found if name != "service"] == messages


def test_one_spin_calls_one_callback(node: Node, executor: NodeExecutor) -> None:
    received: list[int] = []
    node.create_subscription(Int64, "a", append_data_to(received), DEEP)
    publisher = writer(node, "a")
    for number in range(5):
        publisher.publish(Int64(data=number))
    while not received:
        executor.spin_once(timeout_sec=1.0)
    for count in range(2, 6):
        executor.spin_once(timeout_sec=1.0)
        assert received == [*range(count)]


def test_neither_timer_nor_service_waits_for_a_pause_in_the_messages(
    node: Node, executor: NodeExecutor
) -> None:
    publisher = writer(node, "a")
    node.create_subscription(Int64, "a", publisher.publish, DEEP)  # never ends
    ticks: list[float] = []
    node.create_timer(0.01, lambda: ticks.append(time.monotonic()))
    node.create_service(Trigger, "call", lambda _, response: response)
    client = node.create_client(Trigger, "call")
    publisher.publish(Int64())
    spin_until(executor, client.service_is_ready)
    for _ in range(3):
        future = client.call_async(Trigger.Request())
        spin_until(executor, future.done)
    spin_until(executor, lambda: len(ticks) > 5)


def test_done_callbacks_and_coroutines_run(node: Node, executor: NodeExecutor) -> None:
    async def answer(_: Any, response: Any) -> Any:
        response.message = "from a coroutine"
        return response

    received: list[str] = []

    async def on_message(message: Any) -> None:
        response = await client.call_async(Trigger.Request())
        received.append(f"{message.data} {response.message}")

    node.create_service(Trigger, "call", answer)
    client = node.create_client(Trigger, "call")
    callback: Any = on_message  # rclpy's types know of no coroutines
    node.create_subscription(Int64, "a", callback, DEEP)
    spin_until(executor, client.service_is_ready)
    writer(node, "a").publish(Int64(data=7))
    spin_until(executor, lambda: bool(received))
    done: list[str] = []
    future = client.call_async(Trigger.Request())
    future.add_done_callback(lambda finished: done.append(finished.result().message))
    spin_until(executor, lambda: bool(done))
    assert received == ["7 from a coroutine"]
    assert done == ["from a coroutine"]


def test_what_a_callback_creates_is_served_and_what_it_destroys_is_not(
    node: Node, executor: NodeExecutor
) -> None:
    received: list[str] = []
    second = node.create_subscription(Int64, "b", lambda _: received.append("b"), DEEP)

    def first(_: Int64) -> None:
        received.append("a")
        node.destroy_subscription(second)
        node.create_subscription(Int64, "c", lambda _: received.append("c"), DEEP)
        writer(node, "c").publish(Int64())

    # Created before "b" would be read: both messages wait for the same round.
    node.create_timer(3600.0, lambda: None)
    node.destroy_subscription(node.create_subscription(Int64, "unused", first, DEEP))
    node.create_subscription(Int64, "a", first, DEEP)
    writer(node, "a").publish(Int64())
    spin_until(executor, lambda: "c" in received)
    writer(node, "b").publish(Int64())
    for _ in range(20):
        executor.spin_once(timeout_sec=0.0)
    assert received == ["a", "c"]


def test_a_message_that_waits_for_a_destroyed_subscription_is_dropped(
    node: Node, executor: NodeExecutor
) -> None:
    received: list[str] = []

    def first(_: Int64) -> None:
        received.append("a")
        node.destroy_subscription(second)

    node.create_subscription(Int64, "a", first, DEEP)
    second = node.create_subscription(Int64, "b", lambda _: received.append("b"), DEEP)
    for topic in ("b", "a"):
        writer(node, topic).publish(Int64())
    spin_until(executor, lambda: bool(received))
    for _ in range(20):
        executor.spin_once(timeout_sec=0.0)
    assert received == ["a"]


def test_a_node_that_was_removed_is_served_again_once_it_is_added(
    node: Node, executor: NodeExecutor
) -> None:
    received: list[int] = []
    node.create_subscription(Int64, "a", append_data_to(received), DEEP)
    publisher = writer(node, "a")
    for number in range(3):
        publisher.publish(Int64(data=number))
    spin_until(executor, lambda: received == [0])
    executor.remove_node(node)
    for _ in range(20):
        executor.spin_once(timeout_sec=0.0)
    assert received == [0]
    executor.add_node(node)
    spin_until(executor, lambda: received == [0, 1, 2])
    assert executor.get_nodes() == [node]


@pytest.mark.parametrize("kind", ["subscription", "timer", "service"])
def test_what_a_callback_raises_leaves_spin_once_and_the_next_spin_goes_on(
    node: Node, executor: NodeExecutor, kind: str
) -> None:
    def fail(*_: Any) -> None:
        raise ValueError(kind)

    client = node.create_client(Trigger, "call")
    if kind == "subscription":
        node.create_subscription(Int64, "a", fail, DEEP)
        writer(node, "a").publish(Int64())
    elif kind == "timer":
        node.create_timer(0.001, fail)
    else:
        node.create_service(Trigger, "call", fail)
        spin_until(executor, client.service_is_ready)
        client.call_async(Trigger.Request())
    with pytest.raises(ValueError, match=kind):
        spin_until(executor, lambda: False)
    received: list[int] = []
    node.create_subscription(Int64, "b", append_data_to(received), DEEP)
    writer(node, "b").publish(Int64(data=1))
    deadline = time.monotonic() + 30.0
    while not received and time.monotonic() < deadline:
        try:
            executor.spin_once(timeout_sec=0.1)
        except ValueError:
            assert kind == "timer"
    assert received == [1]


def test_polled_subscriptions_are_left_to_their_owner(
    ros_context: Context, executor: NodeExecutor
) -> None:
    owner = GraphNode("owner", context=ros_context)
    executor.add_node(owner)
    polled = PolledSubscriptions()
    messages: list[SerializedMessage] = []
    owner.subscribe_polled(polled, Int64, "a", messages.append, [DEEP])
    writer(owner, "a").publish(Int64())
    for _ in range(20):
        executor.spin_once(timeout_sec=0.0)
    assert not messages
    polled.poll()
    assert len(messages) == 1
    owner.destroy_node()


def test_a_spin_ends_after_its_timeout_or_when_it_is_woken(
    node: Node, executor: NodeExecutor
) -> None:
    for _ in range(5):
        executor.spin_once(timeout_sec=0.0)
    started = time.monotonic()
    executor.spin_once(timeout_sec=0.2)
    assert 0.19 < time.monotonic() - started < 20.0

    received: list[int] = []

    def create() -> None:
        node.create_subscription(Int64, "a", append_data_to(received), DEEP)
        writer(node, "a").publish(Int64(data=3))

    thread = threading.Thread(target=create)
    thread.start()
    started = time.monotonic()
    executor.spin_once(timeout_sec=600.0)
    thread.join()
    assert received == [3]
    assert time.monotonic() - started < 300.0


def test_a_condition_ends_the_wait(node: Node, executor: NodeExecutor) -> None:
    node.create_service(Trigger, "call", lambda _, response: response)
    client = node.create_client(Trigger, "call")
    spin_until(executor, client.service_is_ready)
    future = client.call_async(Trigger.Request())
    executor.spin_until_future_complete(future, timeout_sec=30.0)
    assert future.done()


def test_the_end_of_the_context_ends_a_spin(node: Node, executor: NodeExecutor) -> None:
    node.context.try_shutdown()
    with pytest.raises(ExternalShutdownException):
        executor.spin_once(timeout_sec=60.0)


def test_nothing_is_called_after_shutdown(node: Node, executor: NodeExecutor) -> None:
    called: list[Callable[..., None]] = []
    node.create_timer(0.001, lambda: called.append(print))
    spin_until(executor, lambda: bool(called))
    executor.shutdown()
    before = len(called)
    for _ in range(3):
        executor.spin_once(timeout_sec=0.01)
    assert len(called) == before


def test_another_rclpy_gets_its_own_executor(
    ros_context: Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    usual = make_executor(ros_context)
    assert isinstance(usual, NodeExecutor)
    usual.shutdown()
    monkeypatch.setattr(node_executor, "OF_RCLPY", ["_of_a_later_version"])
    own = make_executor(ros_context)
    assert type(own) is SingleThreadedExecutor
    own.shutdown()
