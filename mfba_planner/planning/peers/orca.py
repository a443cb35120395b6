# SPDX-License-Identifier: Apache-2.0
"""ORCA by pyrvo: the velocity nearest to the preferred one without collision in HORIZON_S."""

from __future__ import annotations

import math

from ...core.errors import ConfigError
from ...core.geometry import Point
from ...core.planner_types import NANO, Observation
from ...perception.sensory_vector import SensorParams
from ..base_planner import Move
from ..mode_transitions import Event
from ..planner_params import PlannerParams
from .circle_planner import CirclePlanner

HORIZON_S = 3.0
MARGIN_M = 0.06
# ORCA assigns half of each evasion to either agent, but obstacles do not evade. So the robot runs
# it again from the resulting velocity, until little evasion is left.
ROUNDS = 4


class Orca(CirclePlanner):
    """One ORCA agent among agents at constant velocity."""

    def __init__(self, params: PlannerParams, sensor: SensorParams, seed: int) -> None:
        """Raise ConfigError where pyrvo is not installed."""
        try:
            from pyrvo import RVOSimulator
        except ImportError:
            raise ConfigError(
                "planner 'orca': needs pyrvo; pip install 'mfba_planner[orca]'"
            ) from None
        self._simulator = RVOSimulator
        super().__init__(params, sensor, seed)

    def forget(self) -> None:
        """Start from velocity 0, without tracks."""
        super().forget()
        self._velocity: Point = (0.0, 0.0)

    def move(self, obs: Observation, goal: Point) -> Move:
        """The velocity of ORCA; straight to the goal if no circle is within SR."""
        wanted = self.straight(obs.pose.position, goal, self.params.speed_mps)
        circles = self.circles(obs)
        if not circles:
            self._velocity = wanted
            return Move(velocity=wanted, reason="nothing within SR")
        speed = self.params.speed_mps
        simulator = self._simulator(
            self.params.tick_ns * NANO, 1e3, len(circles), HORIZON_S, HORIZON_S, MARGIN_M, speed
        )
        robot = simulator.add_agent((0.0, 0.0))
        px, py = obs.pose.position
        others = []
        for circle in circles:
            position = (circle.center_m[0] - px, circle.center_m[1] - py)
            number = simulator.add_agent(position)
            simulator.set_agent_radius(number, circle.radius_m)
            simulator.set_agent_max_neighbors(number, 0)  # their own evasion is not computed
            others.append((number, position, circle.velocity_mps))
        velocity = self._velocity
        for _ in range(ROUNDS):
            simulator.set_agent_position(robot, (0.0, 0.0))
            simulator.set_agent_velocity(robot, velocity)
            simulator.set_agent_pref_velocity(robot, wanted)
            for number, position, obstacle_velocity in others:
                simulator.set_agent_position(number, position)
                simulator.set_agent_velocity(number, obstacle_velocity)
                simulator.set_agent_pref_velocity(number, obstacle_velocity)
            simulator.do_step()
            velocity = simulator.get_agent_velocity(robot).to_tuple()
        # Single precision and ORCA's fallback program may exceed the speed.
        excess = max(1.0, math.hypot(*velocity) / speed)
        velocity = (velocity[0] / excess, velocity[1] / excess)
        self._velocity = velocity
        return Move(velocity=velocity, reason=f"ORCA among {len(circles)}", event=Event.OBSTACLE)
