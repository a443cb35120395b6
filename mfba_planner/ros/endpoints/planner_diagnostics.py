# SPDX-License-Identifier: Apache-2.0
"""The planner's /diagnostics: the state of its inputs, and its last decision."""

from __future__ import annotations

import time

from ...core.planner_types import Decision
from ...planning.supervised_planner import SupervisedPlanner
from ...recording.from_messages import points_text
from ..interface.diagnostic_status import InputHealth, driving_status
from ..node_settings import PlannerSettings
from ..runtime.base_node import GraphNode
from ..runtime.goal_queue import GoalQueue
from ..runtime.input_monitor import InputMonitor
from ..runtime.refused_inputs import RefusedInputs
from .diagnostics_publisher import DiagnosticsPublisher


class PlannerDiagnostics:
    """Records inputs and decisions; publishes once a period and when something changes."""

    def __init__(
        self,
        node: GraphNode,
        settings: PlannerSettings,
        refused_inputs: RefusedInputs,
        monitor: InputMonitor,
    ) -> None:
        """Advertise /diagnostics."""
        self._publisher = DiagnosticsPublisher(node, settings)
        self._refused_inputs, self._monitor = refused_inputs, monitor
        self._health = InputHealth(("odom", "sectors"))
        self._published: tuple[object, ...] = ()

    def input_received(self, name: str, stamp_ns: int, now_s: float, fault: str) -> None:
        """An input was received; fault is why its content is refused, "" if it is not."""
        self._health.received(name, stamp_ns, now_s)
        self._health.set_fault(name, fault)

    def set_fault(self, name: str, fault: str) -> None:
        """Why the newest of an input is refused, "" if it is not."""
        self._health.set_fault(name, fault)

    def set_awaited(self, name: str, text: str) -> None:
        """That an input is awaited which comes once, "" if it is not."""
        self._health.set_awaited(name, text)

    def decision_made(
        self,
        decision: Decision,
        path_planner: SupervisedPlanner,
        goal_queue: GoalQueue,
        state: str,
    ) -> None:
        """Publish at once what has changed, everything else once a period."""
        now_s = time.monotonic()
        self._publisher.set_time(decision.stamp_ns, now_s)
        present = (
            decision.mode,
            path_planner.phase,
            goal_queue.goal_id,
            *self._health.kinds_of_fault,
        )
        changed, self._published = present != self._published, present
        if changed or self._publisher.is_due(now_s):
            self.publish(decision, path_planner, goal_queue, state, changed=changed)

    def publish(
        self,
        decision: Decision | None,
        path_planner: SupervisedPlanner,
        goal_queue: GoalQueue,
        state: str,
        *,
        changed: bool = False,
    ) -> None:
        """Publish if a period has passed, or if something has changed."""
        now_s, timeout_s = time.monotonic(), path_planner.params.input_timeout_s
        values = {
            "method": path_planner.params.label,
            "goal": points_text([goal_queue.goal] if goal_queue.goal else []),
            "goal_index": goal_queue.goal_index,
            "goal_id": str(goal_queue.goal_id),
            "last refused": self._refused_inputs.last,
        }
        statuses = [
            self._health.status(
                now_s,
                timeout_s,
                self._refused_inputs.by_kind,
                self._monitor.note,
                self._monitor.values,
            ),
            driving_status(decision, path_planner.phase, state, values),
        ]
        self._publisher.publish(statuses, now_s, changed=changed)
