# SPDX-License-Identifier: Apache-2.0
"""What the planner reports of itself on /diagnostics, and when."""

from __future__ import annotations

import time

from ...core.types import Decision
from ...planning.supervised_planner import SupervisedPlanner
from ...recording.from_messages import points_text
from ..interface.health import Health, driving
from ..node_parameters import PlannerSettings
from ..runtime.goal_queue import GoalQueue
from ..runtime.node_runtime import GraphNode, Refusals
from .diagnostics_publisher import DiagnosticTopic


class PlannerHealth:
    """Listens to what the planner hears and decides; publishes once in a period and on changes."""

    def __init__(self, node: GraphNode, settings: PlannerSettings, refusals: Refusals) -> None:
        """Advertise /diagnostics."""
        self._topic = DiagnosticTopic(node, settings)
        self._refusals = refusals
        self._health = Health(("odom", "sectors"))
        self._seen: tuple[object, ...] = ()

    def heard(self, name: str, stamp_ns: int, now_s: float, fault: str) -> None:
        """An input came; fault is why its content is refused, "": it is sound."""
        self._health.heard(name, stamp_ns, now_s)
        self._health.judged(name, fault)

    def decided(
        self,
        decision: Decision,
        path_planner: SupervisedPlanner,
        goal_queue: GoalQueue,
        state: str,
    ) -> None:
        """Report at once where something has changed; everything else can wait."""
        now_s = time.monotonic()
        self._topic.at(decision.stamp_ns, now_s)
        seen = (decision.mode, path_planner.phase, goal_queue.number, *self._health.faults)
        news, self._seen = seen != self._seen, seen
        if news or self._topic.is_due(now_s):
            self.report(decision, path_planner, goal_queue, state, news=news)

    def report(
        self,
        decision: Decision | None,
        path_planner: SupervisedPlanner,
        goal_queue: GoalQueue,
        state: str,
        *,
        news: bool = False,
    ) -> None:
        """Publish, if it is time to, or if a level has changed."""
        now_s, timeout_s = time.monotonic(), path_planner.params.input_timeout_s
        values = {
            "method": path_planner.params.label,
            "goal": points_text([goal_queue.goal] if goal_queue.goal else []),
            "goal_index": goal_queue.leg,
            "goal_id": str(goal_queue.number),
            "last refused": self._refusals.last,
        }
        statuses = [
            self._health.inputs(now_s, timeout_s, self._refusals.by_kind),
            driving(decision, path_planner.phase, state, values),
        ]
        self._topic.publish(statuses, now_s, news=news)
