# SPDX-License-Identifier: Apache-2.0
"""A node with a life cycle: unconfigured, inactive, active, finalized."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.lifecycle import LifecycleNodeMixin, LifecycleState, TransitionCallbackReturn

from .node_runtime import GraphNode


class ManagedNode(GraphNode, LifecycleNodeMixin):
    """Subclasses say what set_up, start, halt and tear_down mean; begin() is called once.

    Its services are those of any managed node (ros2 lifecycle get|set); a node that nobody can
    call, start_parameter_services=False, offers none.
    """

    def __init__(self, name: str, **kwargs: Any) -> None:
        """Pass rclpy's keyword arguments on; the node is unconfigured then."""
        GraphNode.__init__(self, name, **kwargs)
        attended = kwargs.get("start_parameter_services", True)
        LifecycleNodeMixin.__init__(self, enable_communication_interface=attended)
        self._trouble: Exception | None = None

    @property
    def state(self) -> str:
        """unconfigured, inactive, active or finalized (or a transition's name)."""
        label: str = self._state_machine.current_state[1]
        return label

    @property
    def is_active(self) -> bool:
        """Whether it does what it is for."""
        return self.state == "active"

    def begin(self, autostart: bool) -> None:
        """Configure and activate at once, or wait to be told; what goes wrong is raised."""
        if autostart:
            self.trigger_configure()
            self.trigger_activate()
            if self._trouble is not None:
                raise self._trouble

    def set_up(self) -> None:
        """Unconfigured to inactive."""

    def start(self) -> None:
        """Inactive to active."""

    def halt(self) -> None:
        """Active to inactive."""

    def tear_down(self) -> None:
        """Inactive to unconfigured."""

    def missing(self) -> str:
        """Besides the subscribers: to be active."""
        return super().missing() if self.is_active else f"{self.state}, not active"

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Rclpy's name of set_up."""
        return self._done(self.set_up)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Rclpy's name of start."""
        return self._done(self.start)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Rclpy's name of halt."""
        return self._done(self.halt)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Rclpy's name of tear_down."""
        return self._done(self.tear_down)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """From wherever it is: all that leads down; the process ends with it."""
        if state.label == "active":
            self._done(self.halt)
        self.finished = True
        return self._done(self.tear_down) if state.label != "unconfigured" else _SUCCESS

    def _done(self, step: Callable[[], None]) -> TransitionCallbackReturn:
        """Rclpy swallows what is raised in a transition: log it, and keep it for begin."""
        try:
            step()
        except Exception as error:
            self._trouble = error
            self.get_logger().error(f"{step.__name__}: {error}")
            return TransitionCallbackReturn.ERROR
        return _SUCCESS


_SUCCESS = TransitionCallbackReturn.SUCCESS
