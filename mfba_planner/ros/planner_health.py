# SPDX-License-Identifier: Apache-2.0
"""What the planner reports of itself on /diagnostics, and when."""

from __future__ import annotations

import time

from ..core.guarded import Guarded
from ..core.planner import NANO, Decision
from ..messages import points_text
from ..node_settings import PlannerSettings
from .errands import Errands
from .health import Health, driving
from .planner_topics import DiagnosticTopic
from .runtime import GraphNode, Refusals


class PlannerHealth:
    """Listens to what the planner hears and decides; publishes once in a period and on changes."""

    def __init__(self, node: GraphNode, settings: PlannerSettings, refusals: Refusals) -> None:
        """Advertise /diagnostics."""
        self._topic = DiagnosticTopic(node, settings)
        self._refusals = refusals
        self._health = Health(("odom", "sectors"))
        self._faults: dict[str, str] = {}
        self._seen: tuple[object, ...] = ()
        self._stamp_ns, self._stamp_s = node.get_clock().now().nanoseconds, time.monotonic()

    def heard(self, name: str, stamp_ns: int, now_s: float, fault: str) -> None:
        """An input came; fault is why its content is refused, "": it is sound."""
        self._health.pulses[name].beat(stamp_ns, now_s)
        self._faults[name] = fault

    def decided(self, decision: Decision, brain: Guarded, errands: Errands, state: str) -> None:
        """Report at once where something has changed; everything else can wait."""
        if decision.stamp_ns != self._stamp_ns:  # on old inputs again: time goes on all the same
            self._stamp_ns, self._stamp_s = decision.stamp_ns, time.monotonic()
        seen = (decision.mode, brain.phase, errands.number, *self._faults.values())
        news, self._seen = seen != self._seen, seen
        if news or self._topic.is_due(self._time_ns(time.monotonic())):
            self.report(decision, brain, errands, state, news=news)

    def report(
        self,
        decision: Decision | None,
        brain: Guarded,
        errands: Errands,
        state: str,
        *,
        news: bool = False,
    ) -> None:
        """Publish, if it is time to, or if a level has changed."""
        now_s = time.monotonic()
        fault = next(filter(None, self._faults.values()), "")
        timeout_s = brain.params.input_timeout_s
        values = {
            "method": brain.params.label,
            "goal": points_text([errands.goal] if errands.goal else []),
            "leg": errands.leg,
            "errand": str(errands.number),
            "last refused": self._refusals.last,
        }
        statuses = [
            self._health.inputs(now_s, timeout_s, self._refusals.by_kind, fault),
            driving(decision, brain.phase, state, values),
        ]
        self._topic.publish(statuses, self._time_ns(now_s), news=news)

    def _time_ns(self, now_s: float) -> int:
        """The newest stamp, and what has passed since it came."""
        return self._stamp_ns + round((now_s - self._stamp_s) / NANO)
