# SPDX-License-Identifier: Apache-2.0
"""ORCA through pyrvo: the velocity nearest to the wanted one that avoids all for tau seconds."""

from __future__ import annotations

import math

from ...core.errors import ConfigError
from ...core.geometry import Point
from ...core.types import NANO, Observation
from ...perception.sensory_vector import SensorParams
from ..base_planner import BasePlanner, Move
from ..mode_transitions import Event
from ..planner_params import PlannerParams

HORIZON_S = 3.0
MARGIN_M = 0.06
# ORCA asks each of two agents for half of the evasion. Obstacles do not do their half: the robot
# asks again from the velocity it got, until nothing is left to evade.
ROUNDS = 4


class Orca(BasePlanner):
    """One agent among others that keep their velocities; needs known circles."""

    reads_sectors = False

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
        """Stand still before the first tick."""
        self._velocity: Point = (0.0, 0.0)

    def move(self, obs: Observation, goal: Point) -> Move:
        """The velocity of ORCA; InputError where only a scan is known."""
        wanted = self.straight(obs.pose.position, goal, self.params.speed_mps)
        circles = obs.circles or ()
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
            place = (circle.center_m[0] - px, circle.center_m[1] - py)
            number = simulator.add_agent(place)
            simulator.set_agent_radius(number, circle.radius_m)
            simulator.set_agent_max_neighbors(number, 0)  # what they would do is not asked for
            others.append((number, place, circle.velocity_mps))
        velocity = self._velocity
        for _ in range(ROUNDS):
            simulator.set_agent_position(robot, (0.0, 0.0))
            simulator.set_agent_velocity(robot, velocity)
            simulator.set_agent_pref_velocity(robot, wanted)
            for number, place, keeps in others:
                simulator.set_agent_position(number, place)
                simulator.set_agent_velocity(number, keeps)
                simulator.set_agent_pref_velocity(number, keeps)
            simulator.do_step()
            velocity = simulator.get_agent_velocity(robot).to_tuple()
        # Single precision, and the program of last resort, may leave the disc of speeds.
        excess = max(1.0, math.hypot(*velocity) / speed)
        velocity = (velocity[0] / excess, velocity[1] / excess)
        self._velocity = velocity
        return Move(velocity=velocity, reason=f"ORCA among {len(circles)}", event=Event.OBSTACLE)
