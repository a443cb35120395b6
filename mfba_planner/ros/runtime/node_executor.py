# SPDX-License-Identifier: Apache-2.0
"""The executor of all nodes: rclpy's single-threaded one, with less work per message."""

from __future__ import annotations

import inspect
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple

import rclpy
from rclpy.exceptions import InvalidHandle
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.subscription import Subscription

from .polled_subscriptions import PolledGroup

# While messages come, subscriptions are read in turn without waiting; after this time everything
# is waited for again, as timers, services and clients must not be late by more.
READ_S = 0.002

TIMER, SUBSCRIPTION, CONDITION, CLIENT, SERVICE = KINDS = (
    "timer",
    "subscription",
    "guard_condition",
    "client",
    "service",
)

# What rclpy 7.1 does not promise to keep.
OF_RCLPY = [
    "_context", "_guard", "_is_shutdown", "_make_handler", "_sigint_gc", "_take_client",
    "_take_guard_condition", "_take_service", "_take_waitable", "_tasks", "_tasks_lock",
]  # fmt: skip


class Entity(NamedTuple):
    """What the executor waits for: a timer, subscription, guard condition, client or service."""

    kind: str
    pointer: int  # as the wait set names it
    rclpy_entity: Any
    node: Any


class NodeExecutor(SingleThreadedExecutor):
    """Calls one callback per spin_once, in rounds: at most one message of each subscription.

    rclpy makes a wait set, a task and a coroutine for every callback. Here the wait set is made
    anew only when an entity was created or destroyed, callbacks are called directly, and a
    round of messages that follows another one needs no wait. Nodes are served in the sequence
    in which they were added.
    """

    def __init__(self, *, context: rclpy.Context | None = None) -> None:
        """Start without nodes; context as in rclpy."""
        super().__init__(context=context)
        self._in_sequence: list[Node] = []
        self._changed = True  # an entity or node came or went
        self._entities: list[Entity] = []
        self._waitables: list[tuple[Any, Node]] = []
        self._wait_set: Any = None
        self._ready: deque[Callable[[], bool]] = deque()  # each returns whether it did anything
        self._subscriptions: list[Subscription] = []
        self._round: Iterator[Subscription] = iter(())
        self._received = False  # a message in this round
        self._waited_s = -READ_S

    @property
    def is_usable(self) -> bool:
        """Whether this rclpy has all that is used of its inner parts."""
        return all(hasattr(self, name) for name in OF_RCLPY)

    def wake(self) -> None:
        """Called by rclpy whenever an entity of a node was created or destroyed."""
        self._changed = True
        super().wake()

    def add_node(self, node: Node) -> bool:
        """As in rclpy."""
        added: bool = super().add_node(node)
        if added:
            self._in_sequence.append(node)
            self._changed = True
        return added

    def remove_node(self, node: Node) -> None:
        """As in rclpy; what was ready in this round is found again in the next."""
        super().remove_node(node)
        if node in self._in_sequence:
            self._in_sequence.remove(node)
        self._changed = True
        self._ready.clear()

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """As in rclpy."""
        self._in_sequence.clear()
        self._ready.clear()
        self._entities.clear()
        self._subscriptions.clear()
        self._wait_set, self._round, self._changed = None, iter(()), True
        return bool(super().shutdown(timeout_sec))

    def _spin_once_impl(
        self,
        timeout_sec: Any = None,  # float, or rclpy's TimeoutObject
        wait_condition: Callable[[], bool] = lambda: False,
    ) -> None:
        """Of spin_once and spin_once_until_future_complete."""
        if self._is_shutdown or wait_condition():
            return
        if self._tasks and self._run_tasks():
            return
        if self._call_ready() or self._read_next():
            return
        self._wait(getattr(timeout_sec, "timeout", timeout_sec), wait_condition)
        self._call_ready()

    def _run_tasks(self) -> bool:
        """Run what futures and coroutines have left to do; whether something was finished."""
        with self._tasks_lock:
            tasks = [task for task, _, _ in self._tasks]
        for task in tasks:
            task()
        with self._tasks_lock:
            self._tasks = [
                entry for entry in self._tasks if not (entry[0].done() or entry[0].cancelled())
            ]
            unfinished = [entry[0] for entry in self._tasks]
        finished = [task for task in tasks if task not in unfinished]
        for task in finished:
            if task.exception() is not None:
                raise task.exception()
        return bool(finished)

    def _call_ready(self) -> bool:
        """Call one callback of those found ready; False if there is none."""
        while self._ready:
            if self._ready.popleft()():
                return True
        return False

    def _read_next(self) -> bool:
        """Read subscriptions in turn, up to a message; False if it is time to wait."""
        while True:
            if self._changed:
                return False
            for subscription in self._round:
                if self._read(subscription):
                    self._received = True
                    return True
            if not self._received or time.monotonic() - self._waited_s > READ_S:
                return False
            self._begin_round()

    def _begin_round(self) -> None:
        self._round, self._received = iter(self._subscriptions), False

    def _read(self, subscription: Subscription) -> bool:
        """Take one message and call back; False if there is none."""
        try:
            with (handle := subscription.handle):
                taken = handle.take_message(subscription.msg_type, subscription.raw)
        except InvalidHandle:  # destroyed
            return False
        if taken is None:
            return False
        message_only = subscription._callback_type is Subscription.CallbackType.MessageOnly
        self._call(subscription.callback, *(taken[:1] if message_only else taken))
        return True

    def _call(self, callback: Callable[..., Any], *args: Any) -> None:
        result = callback(*args)
        if inspect.iscoroutine(result):
            self.create_task(result)

    def _call_timer(self, timer: Any) -> bool:
        try:
            with (handle := timer.handle):
                if not handle.is_timer_ready():  # cancelled, or set back
                    return False
                handle.call_timer()
        except InvalidHandle:
            return False
        self._call(timer.callback)
        return True

    def _handle(self, entity: Any, node: Node, take: Callable[[Any], Any]) -> bool:
        """Serve a service, client, guard condition or waitable as rclpy does."""
        self._make_handler(entity, node, take)
        self._run_tasks()
        return True

    def _wait(self, timeout_s: float | None, condition: Callable[[], bool]) -> None:
        """Wait until something is ready, at most timeout_s; None or negative: for ever."""
        for_ever = timeout_s is None or timeout_s < 0.0
        deadline_s = time.monotonic() + (timeout_s or 0.0)
        while not self._is_shutdown and not condition():
            left_s = -1.0 if for_ever else max(deadline_s - time.monotonic(), 0.0)
            self._wait_once(-1 if for_ever else round(left_s * 1e9))
            if self._ready or self._tasks or left_s == 0.0:
                return

    def _wait_once(self, timeout_ns: int) -> None:
        handle = self._context.handle
        if handle is None or not self._context.ok():
            raise ExternalShutdownException
        with handle:
            if self._changed:
                self._collect()
            wait_set = self._wait_set
            self._fill(wait_set)
            wait_set.wait(timeout_ns)
        if self._is_shutdown:
            return
        if not self._context.ok():
            raise ExternalShutdownException
        self._waited_s = time.monotonic()
        self._queue_ready(wait_set)

    def _fill(self, wait_set: Any) -> None:
        """Add everything again: what was not ready after a wait is no longer in the set."""
        wait_set.clear_entities()
        add = {
            TIMER: wait_set.add_timer,
            SUBSCRIPTION: wait_set.add_subscription,
            CONDITION: wait_set.add_guard_condition,
            CLIENT: wait_set.add_client,
            SERVICE: wait_set.add_service,
        }
        for kind, _, entity, _ in self._entities:
            add[kind](entity.handle)
        for own in (self._guard, self._sigint_gc):
            wait_set.add_guard_condition(own.handle)
        for waitable, _ in self._waitables:
            waitable.add_to_wait_set(wait_set)

    def _queue_ready(self, wait_set: Any) -> None:
        for waitable, node in self._waitables:
            if waitable.is_ready(wait_set):
                self._ready.append(partial(self._handle, waitable, node, self._take_waitable))
        pointers = {kind: set(wait_set.get_ready_entities(kind)) for kind in KINDS}
        for kind, pointer, entity, node in self._entities:
            if pointer in pointers[kind]:
                self._ready.append(self._action(kind, entity, node))
        self._round, self._received = iter(()), bool(pointers[SUBSCRIPTION])

    def _action(self, kind: str, entity: Any, node: Node) -> Callable[[], bool]:
        if kind == SUBSCRIPTION:
            return partial(self._read, entity)
        if kind == TIMER:
            return partial(self._call_timer, entity)
        take = {
            CONDITION: self._take_guard_condition,
            CLIENT: self._take_client,
            SERVICE: self._take_service,
        }[kind]
        return partial(self._handle, entity, node, take)

    def _collect(self) -> None:
        """List the entities of all nodes, and make a wait set for them."""
        self._changed = False
        listed = [
            Entity(kind, entity.handle.pointer, entity, node)
            for node in self._in_sequence
            for kind, entities in (
                (TIMER, node.timers),
                (SUBSCRIPTION, node.subscriptions),
                (CONDITION, node.guards),
                (CLIENT, node.clients),
                (SERVICE, node.services),
            )
            for entity in entities
            if not isinstance(entity.callback_group, PolledGroup)
        ]
        self._entities = [entity for entity in listed if entity.pointer]  # 0: destroyed
        self._waitables = [
            (waitable, node) for node in self._in_sequence for waitable in node.waitables
        ]
        self._subscriptions = [e.rclpy_entity for e in self._entities if e.kind == SUBSCRIPTION]
        self._round = iter(())
        count = Counter(entity.kind for entity in self._entities)
        more = [waitable.get_num_entities() for waitable, _ in self._waitables]
        self._wait_set = rclpy_implementation.WaitSet(
            count[SUBSCRIPTION] + sum(n.num_subscriptions for n in more),
            count[CONDITION] + sum(n.num_guard_conditions for n in more) + 2,  # two of its own
            count[TIMER] + sum(n.num_timers for n in more),
            count[CLIENT] + sum(n.num_clients for n in more),
            count[SERVICE] + sum(n.num_services for n in more),
            sum(n.num_events for n in more),
            self._context.handle,
        )
