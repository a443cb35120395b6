# SPDX-License-Identifier: Apache-2.0
"""How the planner is told where to go: goal_pose, waypoints and ~/cancel."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from std_srvs.srv import Trigger

from ...core.errors import InputError
from ...core.geometry import Point, Pose2D
from ...recording.from_messages import goal_point, waypoint_points
from ..interface import topics
from ..runtime.goal_queue import GoalQueue
from ..runtime.node_runtime import GraphNode, Refusals


class GoalSubscriptions:
    """Errands as messages give them; the newest order counts, one that is refused changes nothing.

    An order of what is being done already is none, unless that is over.
    """

    def __init__(
        self,
        node: GraphNode,
        frame: str,
        refusals: Refusals,
        is_over: Callable[[], bool],
        on_new: Callable[[], None],
    ) -> None:
        """Offer ~/cancel; frame is that of all goals, on_new is called for a new order."""
        self._node, self._frame, self._refusals = node, frame, refusals
        self._is_over, self._on_new = is_over, on_new
        self.forget()
        node.create_service(Trigger, "~/cancel", self._on_cancel)

    def forget(self) -> None:
        """As if nothing had ever been ordered."""
        self.goal_queue = GoalQueue()
        self.any_received = False

    def listen(self) -> None:
        """Subscribe."""
        self._node.listen(topics.GOAL_POSE, self._on_goal)
        self._node.listen(topics.WAYPOINTS, self._on_waypoints)

    def next_from(self, pose: Pose2D | str, tolerance_m: float) -> Point | None:
        """Where to go from here: of several goals, the first that is not reached."""
        if not isinstance(pose, str):
            before = self.goal_queue.leg
            if self.goal_queue.pass_by(pose.position, tolerance_m):
                self._tell(f"goal {before} reached: on to {self.goal_queue.goal}")
        return self.goal_queue.goal

    def is_under_way(self) -> bool:
        """Whether somebody gives goals, of which a planner this young has not heard the last."""
        return not self.any_received and self._node.count_publishers(topics.GOAL_POSE.name) > 0

    def _tell(self, text: str) -> None:
        self._node.get_logger().info(text)

    def _on_goal(self, message: Any) -> None:
        self._order("goal_pose", lambda: (goal_point(message, self._frame),))

    def _on_waypoints(self, message: Any) -> None:
        self._order("waypoints", lambda: waypoint_points(message, self._frame))

    def _order(self, name: str, read: Callable[[], tuple[Point, ...]]) -> None:
        try:
            goals = read()
        except InputError as error:
            self._refusals.add(error, name)
            return
        self.any_received = True
        if self.goal_queue.order(goals, over=self._is_over()):
            self._on_new()
            self._tell(f"{name}: on to {self.goal_queue.goal}, goal {self.goal_queue.leg}")

    def _on_cancel(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        goal = self.goal_queue.cancel()
        response.success = goal is not None
        response.message = f"no longer on the way to {goal}" if goal else "there was no goal"
        self._tell(f"cancel: {response.message}")
        return response
