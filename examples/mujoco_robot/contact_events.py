# SPDX-License-Identifier: Apache-2.0
"""Contact events of the robot's body, from the engine's contacts of every step."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from mfba_planner.core.geometry import Point, Pose2D, rotated

APART_S = 0.5  # a body that bounces off and touches again within this time touches once
STANDING_MPS = 0.05
STANDING_RADPS = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactEvent:
    """The begin of one contact.

    side is standing where the robot stood, behind where it was touched on the side that it moved
    away from, else driving: then it has driven into what it touches.
    """

    time_s: float
    touched: str  # name of the geom: person3, pillar0, wall1, border2
    side: str
    speed_mps: float

    @property
    def is_person(self) -> bool:
        """Whether it is a person."""
        return self.touched.startswith("person")


def side_of(pose: Pose2D, speed_mps: float, turn_radps: float, point: Point) -> str:
    """How the robot moved beside a point of contact: standing, behind or driving."""
    if abs(speed_mps) < STANDING_MPS and abs(turn_radps) < STANDING_RADPS:
        return "standing"
    ahead, _ = rotated((point[0] - pose.x, point[1] - pose.y), -pose.yaw)
    return "behind" if abs(speed_mps) >= STANDING_MPS and ahead * speed_mps < 0.0 else "driving"


class ContactEvents:
    """Turns the contacts of single steps into events, each counted once."""

    def __init__(self) -> None:
        """Start without contacts."""
        self.events: list[ContactEvent] = []
        self._last_s: dict[str, float] = {}

    def add(
        self,
        time_s: float,
        touching: Iterable[tuple[str, Point]],
        pose: Pose2D,
        speed_mps: float,
        turn_radps: float,
    ) -> None:
        """Add the contacts (name, point) of a step; the motion is that before the step."""
        for name, point in touching:
            if time_s - self._last_s.get(name, -math.inf) > APART_S:
                side = side_of(pose, speed_mps, turn_radps, point)
                self.events.append(
                    ContactEvent(time_s=time_s, touched=name, side=side, speed_mps=speed_mps)
                )
            self._last_s[name] = time_s
