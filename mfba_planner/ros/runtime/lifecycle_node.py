# SPDX-License-Identifier: Apache-2.0
"""A node with a life cycle: unconfigured, inactive, active, finalized."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.lifecycle import LifecycleNodeMixin, LifecycleState, TransitionCallbackReturn

from .base_node import GraphNode
from .response_sender import send_until_discovered


class ManagedNode(GraphNode, LifecycleNodeMixin):
    """Subclasses implement configure, activate, deactivate and clean_up.

    The services are those of any managed node (ros2 lifecycle get|set); a node without
    parameter services (start_parameter_services=False) has none of them either.
    """

    def __init__(self, name: str, **kwargs: Any) -> None:
        """Pass rclpy's keyword arguments on; the node is unconfigured then."""
        GraphNode.__init__(self, name, **kwargs)
        services = kwargs.get("start_parameter_services", True)
        LifecycleNodeMixin.__init__(self, enable_communication_interface=services)
        self._transition_error: Exception | None = None
        if services:
            # Only the last response: the others must not delay the node.
            send_until_discovered(self._service_change_state, lambda: self.finished)

    @property
    def state(self) -> str:
        """unconfigured, inactive, active or finalized (or a transition's name)."""
        label: str = self._state_machine.current_state[1]
        return label

    @property
    def is_active(self) -> bool:
        """Whether the node is in the state active."""
        return self.state == "active"

    def enter_life_cycle(self, autostart: bool) -> None:
        """With autostart configure and activate now, and raise what fails; called once."""
        if autostart:
            self.trigger_configure()
            self.trigger_activate()
            if self._transition_error is not None:
                raise self._transition_error

    def configure(self) -> None:
        """Unconfigured to inactive."""

    def activate(self) -> None:
        """Inactive to active."""

    def deactivate(self) -> None:
        """Active to inactive."""

    def clean_up(self) -> None:
        """Inactive to unconfigured."""

    def missing(self) -> str:
        """Besides the subscribers: to be active."""
        return super().missing() if self.is_active else f"{self.state}, not active"

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Rclpy's callback for configure."""
        return self._run(self.configure)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Rclpy's callback for activate."""
        return self._run(self.activate)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Rclpy's callback for deactivate."""
        return self._run(self.deactivate)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Rclpy's callback for clean_up."""
        return self._run(self.clean_up)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """From any state: deactivate and clean up where needed; the process ends with it.

        spin_node.wait_for_callers first lets the response arrive.
        """
        if state.label == "active":
            self._run(self.deactivate)
        self.finished = True
        return self._run(self.clean_up) if state.label != "unconfigured" else _SUCCESS

    def _run(self, transition: Callable[[], None]) -> TransitionCallbackReturn:
        """Log and keep what a transition raises: rclpy itself would drop it."""
        try:
            transition()
        except Exception as error:
            self._transition_error = error
            self.get_logger().error(f"{transition.__name__}: {error}")
            return TransitionCallbackReturn.ERROR
        return _SUCCESS


_SUCCESS = TransitionCallbackReturn.SUCCESS
