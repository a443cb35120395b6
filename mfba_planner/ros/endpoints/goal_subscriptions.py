# SPDX-License-Identifier: Apache-2.0
"""The planner's goals from goal_pose and waypoints, and the service ~/cancel."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

from std_srvs.srv import Trigger

from ...core.errors import FrameError, InputError
from ...core.geometry import Point, Pose2D
from ...core.planner_types import RefusalReason
from ...recording.from_messages import goal_point, waypoint_points
from ..interface import topics
from ..runtime.base_node import GraphNode
from ..runtime.goal_queue import GoalQueue
from ..runtime.refused_inputs import RefusedInputs
from .transform_subscription import TransformSubscription

_LONG_WAIT_S = 2.0
_NO_GOAL = (
    "no goal_pose was received, though it has a publisher; publish one, or play its message too "
    "(`ros2 bag play --start-offset` skips latched ones, `ros2 run mfba_planner replay` does not)"
)
Convert = Callable[[], tuple[Point, ...]]


class GoalSubscriptions:
    """The newest message sets the goals; one that is refused changes nothing.

    The same goals again change nothing either, unless the planner has finished them. Goals in
    another frame are transformed once, when they arrive or when tf first gives their frame;
    without tf2_msgs they are refused.
    """

    def __init__(
        self,
        node: GraphNode,
        frame: str,
        refused_inputs: RefusedInputs,
        is_finished: Callable[[], bool],
        on_new: Callable[[], None],
    ) -> None:
        """Advertise ~/cancel; goals are taken in this frame, on_new is called for new ones."""
        self._node, self._frame, self._refused_inputs = node, frame, refused_inputs
        self._is_finished, self._on_new = is_finished, on_new
        self.transforms = TransformSubscription(node)
        self.transforms.on_new = self._on_transforms
        self._tree = self.transforms.tree if topics.TRANSFORMS else None
        self.reset()
        node.create_service(Trigger, "~/cancel", self._on_cancel)

    def reset(self) -> None:
        """Forget all goals."""
        self.goal_queue = GoalQueue()
        self.any_received = False
        self._waited_since_s = math.inf
        self._held: tuple[str, Convert] | None = None
        self.awaited = ""  # the transform that held goals wait for

    def subscribe(self) -> None:
        """Subscribe to goal_pose and waypoints."""
        self._node.subscribe(topics.GOAL_POSE, self._on_goal_pose)
        self._node.subscribe(topics.WAYPOINTS, self._on_waypoints)

    def advance(self, pose: Pose2D | RefusalReason, tolerance_m: float) -> Point | None:
        """The present goal: of several, the first that is not reached at this pose."""
        if not isinstance(pose, str):
            before = self.goal_queue.goal_index
            if self.goal_queue.advance(pose.position, tolerance_m):
                self._log(f"goal {before} reached: on to {self.goal_queue.goal}")
        return self.goal_queue.goal

    def is_expected(self) -> bool:
        """Whether goal_pose has a publisher, and no goal was received since this node started.

        Ticks are not answered until then. If that lasts, a warning says so.
        """
        if self.any_received or not self._node.count_publishers(topics.GOAL_POSE.name):
            self._waited_since_s = math.inf
            return False
        now_s = time.monotonic()
        self._waited_since_s = min(self._waited_since_s, now_s)
        if now_s - self._waited_since_s >= _LONG_WAIT_S:
            self._node.get_logger().warning(
                f"ticks are not answered: {self.awaited or _NO_GOAL}", throttle_duration_sec=5.0
            )
        return True

    def _log(self, text: str) -> None:
        self._node.get_logger().info(text)

    def _on_goal_pose(self, message: Any) -> None:
        self._set_goals("goal_pose", lambda: (goal_point(message, self._frame, tree=self._tree),))

    def _on_waypoints(self, message: Any) -> None:
        self._set_goals("waypoints", lambda: waypoint_points(message, self._frame, self._tree))

    def _on_transforms(self) -> None:
        """Try the goals that wait for a transform again."""
        if self._held is None:
            return
        try:
            goals = self._held[1]()
        except InputError:  # as when they arrived
            return
        self._take(self._held[0], goals)

    def _set_goals(self, name: str, convert: Convert) -> None:
        try:
            goals = convert()
        except InputError as error:
            self._refused_inputs.add(error, name)
            if isinstance(error, FrameError) and self._tree is not None:
                self._held, self.awaited = (name, convert), str(error)
                self.transforms.subscribe()
            return
        self._take(name, goals)

    def _take(self, name: str, goals: tuple[Point, ...]) -> None:
        self._held, self.awaited = None, ""
        self.any_received = True
        if self.goal_queue.set_goals(goals, finished=self._is_finished()):
            self._on_new()
            self._log(f"{name}: on to {self.goal_queue.goal}, goal {self.goal_queue.goal_index}")

    def _on_cancel(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._held, self.awaited = None, ""
        goal = self.goal_queue.cancel()
        response.success = goal is not None
        response.message = f"no longer driving to {goal}" if goal else "there was no goal"
        self._log(f"cancel: {response.message}")
        return response
