# SPDX-License-Identifier: Apache-2.0
"""replay: publishes a bag again, with its timing or as fast as the readers can."""

from __future__ import annotations

import time
from typing import Any

from rclpy.executors import Executor
from std_srvs.srv import Trigger

from ...core.ros_arguments import split_ros_args
from ..replaying.bag_player import Phase, Player
from ..replaying.replay_arguments import ReplaySettings, parse
from ..runtime.base_node import SPIN_S, GraphNode
from ..runtime.spin_node import spin_node

FINE_S = 0.0015  # an executor wakes up late: it is left this long before a message is due


class Replay(GraphNode):
    """A Player with the services ~/pause, ~/resume and ~/step."""

    def __init__(self, settings: ReplaySettings, **kwargs: Any) -> None:
        """Raise ConfigError or BagError for what cannot be played."""
        # It has no parameters of its own, and the executor waits for each service at every spin.
        super().__init__("replay", start_parameter_services=False, **kwargs)
        self.player = Player(self, settings)
        self._spun_s = 0.0
        self.create_service(Trigger, "~/pause", self._on_pause)
        self.create_service(Trigger, "~/resume", self._on_resume)
        self.create_service(Trigger, "~/step", self._on_step)

    def spin_once(self, executor: Executor) -> None:
        """Publish what is due, then spin until shortly before the next message is due."""
        wait_s = self.advance()
        if 0.0 < wait_s < FINE_S and time.monotonic() - self._spun_s < SPIN_S:
            time.sleep(wait_s)
            return
        executor.spin_once(timeout_sec=max(0.0, wait_s - FINE_S))
        self._spun_s = time.monotonic()

    def advance(self) -> float:
        """Publish what is due; return the seconds until the next is due, at most SPIN_S."""
        wait_s = self.player.advance()
        self.finished = self.player.phase is Phase.OVER
        return min(wait_s, SPIN_S)

    def _on_pause(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.player.pause()
        response.success, response.message = True, "paused"
        return response

    def _on_resume(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.player.resume()
        response.success, response.message = True, "running"
        return response

    def _on_step(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = self.player.step()
        return response

    def close(self) -> None:
        """Close the bag."""
        self.player.close()


def main(args: list[str]) -> int:
    """Entry point."""
    own, for_ros = split_ros_args(args)
    return spin_node(lambda: Replay(parse(own)), for_ros)
