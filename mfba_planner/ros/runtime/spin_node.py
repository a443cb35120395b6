# SPDX-License-Identifier: Apache-2.0
"""How a node process runs: init, spin, and a clean end on SIGINT and SIGTERM."""

from __future__ import annotations

import signal
import time
import warnings
from collections.abc import Callable

import rclpy
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions

from ...core.interrupts import interrupts_held
from ...core.ros_arguments import NO_PARAMETER_SERVICES, split_ros_args
from ..shared_memory import remove_abandoned
from .base_node import SPIN_S, GraphNode
from .environment_notes import environment_notes
from .node_executor import NodeExecutor

# Longest time that a node stays after its end by a service call, for callers that stay too.
CALLERS_TIMEOUT_S = 2.0


class StopFlag:
    """Set by SIGINT and SIGTERM. Nothing is raised, so no write is interrupted."""

    def __init__(self) -> None:
        """Install both signal handlers (main thread only)."""
        self.is_set = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._on_signal)

    def _on_signal(self, *_: object) -> None:
        self.is_set = True


def make_executor(context: rclpy.Context | None = None) -> Executor:
    """The executor all nodes use; MultiThreadedExecutor is far slower and drops messages.

    With an rclpy whose inner parts have other names it is rclpy's own, which is slower.
    """
    executor = NodeExecutor(context=context)
    if executor.is_usable:
        return executor
    executor.shutdown()
    return SingleThreadedExecutor(context=context)


def wait_for_callers(
    node: GraphNode,
    executor: Executor,
    is_stopped: Callable[[], bool],
    timeout_s: float = CALLERS_TIMEOUT_S,
) -> None:
    """Spin until no client of the node's services is left, so that each has its response.

    rclpy returns as soon as the middleware has the response. A client that does not run at that
    moment gets it later, or asks for it again; a writer that is destroyed meanwhile takes the
    response with it. No call tells whether it has arrived, but a caller that has it goes away.
    """
    deadline = time.monotonic() + timeout_s
    while node.count_callers() and not is_stopped() and time.monotonic() < deadline:
        executor.spin_once(timeout_sec=SPIN_S / 5)


def spin_node(make_node: Callable[..., GraphNode], args: list[str]) -> int:
    """Run one node until a signal or its own end; return 0. Its MfbaErrors pass through."""
    stop = StopFlag()
    own, args = split_ros_args(args)
    options = {"start_parameter_services": False} if NO_PARAMETER_SERVICES in own else {}
    remove_abandoned()
    # A client that is not discovered yet, or no longer there, asks again or is not missed.
    # That the last response was lost is told by response_sender.py.
    warnings.filterwarnings(
        "ignore", "failed to send response", RuntimeWarning, module=r"rclpy\.service"
    )
    with interrupts_held():  # by the middleware's threads, for ever
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    node: GraphNode | None = None
    executor = make_executor()
    try:
        with interrupts_held():
            node = make_node(**options)
        for note in environment_notes(rclpy.get_default_context().get_domain_id()):
            node.get_logger().warning(note)
        executor.add_node(node)
        while not stop.is_set and not node.finished:
            node.spin_once(executor)
        if node.finished:
            wait_for_callers(node, executor, lambda: stop.is_set)
        node.drain(executor)
        node.wait_for_readers()
        return 0
    finally:
        try:
            if node is not None:
                node.close()
        finally:
            # Left to the garbage collector, the executor may print that its handle is invalid.
            executor.shutdown()
            if node is not None:
                node.destroy_node()
            rclpy.try_shutdown()
            # The participant and its shared memory, without waiting for the interpreter's end.
            rclpy.get_default_context().destroy()
