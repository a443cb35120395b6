# SPDX-License-Identifier: Apache-2.0
"""Circles that were seen and have left the sensing region, followed on for a while."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ..core.geometry import Point, distance
from ..core.options import check, option
from ..core.types import NANO, Circle

_SAME = 0.25  # of a radius: a circle seen this near to a remembered one is the same


@dataclass(frozen=True, slots=True, kw_only=True)
class ObstacleMemoryParams:
    """How long what is out of sight is believed to move on as it did."""

    path_m: float = option(
        0.6, "way after which a circle out of sight is given up", unit="m", minimum=0.0,
        maximum=1000.0,
    )  # fmt: skip
    longest_s: float = option(
        10.0, "time after which it is given up at any speed", unit="s", minimum=0.0,
        maximum=3600.0,
    )  # fmt: skip

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)


class ObstacleMemory:
    """What was seen and is out of sight; nothing is in it that no look ever showed.

    A remembered circle that ought to be in sight is dropped, whether or not it is seen: the
    present look knows better.
    """

    def __init__(self, params: ObstacleMemoryParams | None = None) -> None:
        """Start empty."""
        self.params = params or ObstacleMemoryParams()
        self._circles: list[tuple[Circle, float]] = []  # and since when they are out of sight, s
        self._stamp_ns: int | None = None

    def update(
        self, stamp_ns: int, position: Point, range_m: float, seen: Sequence[Circle]
    ) -> list[Circle]:
        """Circles seen at that stamp and those remembered, all as they are at that stamp.

        range_m is how near the edge of a circle has to be to be seen; who is seen farther away
        proves it longer. Stamps that do not rise begin anew.
        """
        last, self._stamp_ns = self._stamp_ns, stamp_ns
        found = [(circle, 0.0) for circle in seen]
        if last is not None and last < stamp_ns:
            dt = (stamp_ns - last) * NANO
            edges = [distance(c.center_m, position) - c.radius_m for c in seen]
            range_m = max(range_m, *edges) if edges else range_m
            for circle, age in self._circles:
                (x, y), (vx, vy), r = circle.center_m, circle.velocity_mps, circle.radius_m
                here, age, same = (x + vx * dt, y + vy * dt), age + dt, _SAME * r
                beyond = distance(here, position) - r - range_m
                # Who is farther beyond cannot be one of those in sight.
                hidden = beyond > same or (
                    beyond > 0.0 and all(distance(here, c.center_m) > same for c in seen)
                )
                if hidden and not self._given_up(circle, age):
                    later = Circle(center_m=here, radius_m=r, velocity_mps=(vx, vy))
                    found.append((later, age))
        self._circles = found
        return [circle for circle, _ in found]

    def _given_up(self, circle: Circle, age_s: float) -> bool:
        """Whether a circle has been out of sight for too long."""
        p, (vx, vy) = self.params, circle.velocity_mps
        return age_s > p.longest_s or age_s * math.sqrt(vx * vx + vy * vy) > p.path_m
