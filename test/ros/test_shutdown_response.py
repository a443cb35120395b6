# SPDX-License-Identifier: Apache-2.0
"""A node that ends on a service call: its caller gets the response first."""

import time
import warnings
from pathlib import Path
from typing import Any

import pytest
from launched_programs import Program
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from planner_talk import LOCKSTEP
from ros_graph import Graph

from mfba_planner.ros.nodes.planner import PlannerNode
from mfba_planner.ros.runtime.response_sender import ATTEMPTS, send_until_discovered
from mfba_planner.ros.runtime.spin_node import wait_for_callers

SHUTDOWN = ChangeState.Request(transition=Transition(label="shutdown"))


@pytest.mark.parametrize("turn", range(3))
def test_the_process_stays_until_its_caller_has_gone(
    graph: Graph, ros_env: dict[str, str], tmp_path: Path, turn: int
) -> None:
    """A process that ends at once takes a response with it that has not arrived.

    The caller here cannot prove the loss: it happens to one in six callers that do not run at
    that moment. It proves that the process still responds, which includes sending again.
    """
    change = graph.probe.create_client(ChangeState, "/planner/change_state")
    state = graph.probe.create_client(GetState, "/planner/get_state")
    with Program("planner", cwd=tmp_path, more_env=ros_env) as program:
        graph.until(change.service_is_ready)
        graph.until(state.service_is_ready)
        response = change.call_async(SHUTDOWN)
        graph.until(response.done, timeout_s=10.0)
        assert response.result().success
        after = state.call_async(GetState.Request())
        graph.until(after.done, timeout_s=10.0)
        assert after.result().current_state.label == "finalized"
        graph.probe.destroy_client(change)
        graph.probe.destroy_client(state)
        assert program.end() == 0
        assert program.stderr == ""


def test_twenty_callers_get_their_responses(graph: Graph) -> None:
    for _ in range(20):
        node = graph.start(PlannerNode, LOCKSTEP)
        assert graph.call(ChangeState, "planner/change_state", SHUTDOWN).success
        assert node.finished
        graph.stop(node)


def test_a_caller_that_stays_does_not_keep_the_node(graph: Graph) -> None:
    node = graph.start(PlannerNode, LOCKSTEP)
    client = graph.probe.create_client(ChangeState, "planner/change_state")
    graph.until(lambda: node.count_callers() == 1)
    started = time.monotonic()
    wait_for_callers(node, graph.executor, lambda: False, timeout_s=0.3)
    assert time.monotonic() - started >= 0.3
    wait_for_callers(node, graph.executor, lambda: True, timeout_s=600.0)  # a signal ends it
    graph.probe.destroy_client(client)
    wait_for_callers(node, graph.executor, lambda: False, timeout_s=600.0)
    assert node.count_callers() == 0


class LateService:
    """A service whose client is discovered after some attempts to respond."""

    def __init__(self, undiscovered: int) -> None:
        self.undiscovered, self.sent = undiscovered, 0

    def send_response(self, response: Any, header: Any) -> None:
        self.sent += 1
        if self.sent <= self.undiscovered:
            warnings.warn("failed to send response (timeout)", RuntimeWarning, stacklevel=1)


@pytest.mark.parametrize(
    ("undiscovered", "wanted", "sent", "lost"),
    [(0, True, 1, False), (3, True, 4, False), (99, True, ATTEMPTS, True), (3, False, 1, True)],
)
def test_a_last_response_is_sent_until_its_client_is_discovered(
    undiscovered: int, wanted: bool, sent: int, lost: bool
) -> None:
    service: Any = LateService(undiscovered)
    send_until_discovered(service, lambda: wanted)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        service.send_response(None, None)
    assert service.sent == sent
    assert [str(w.message) for w in caught] == ["failed to send response (timeout)"] * lost
