# SPDX-License-Identifier: Apache-2.0
"""Memory of circles that have left the sensing region, at constant velocity for some time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ..core.geometry import Point, distance
from ..core.option_specs import check, option
from ..core.planner_types import NANO, Circle

_SAME_SHARE = 0.25  # of the radius: circles at most this far apart are the same one


@dataclass(frozen=True, slots=True, kw_only=True)
class ObstacleMemoryParams:
    """How long a circle out of range is remembered, at constant velocity."""

    path_m: float = option(
        0.6, "distance moved out of range after which a circle is dropped", unit="m", minimum=0.0,
        maximum=1000.0,
    )  # fmt: skip
    longest_s: float = option(
        10.0, "time out of range after which it is dropped at any speed", unit="s", minimum=0.0,
        maximum=3600.0,
    )  # fmt: skip

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)


class ObstacleMemory:
    """Circles that were observed and are out of range now.

    A remembered circle that has come back into range is dropped, observed or not: the present
    observation replaces it.
    """

    def __init__(self, params: ObstacleMemoryParams | None = None) -> None:
        """Start empty."""
        self.params = params or ObstacleMemoryParams()
        self._circles: list[tuple[Circle, float]] = []  # and the time out of range, s
        self._stamp_ns: int | None = None

    def update(
        self, stamp_ns: int, position: Point, range_m: float, observed: Sequence[Circle]
    ) -> list[Circle]:
        """The observed and the remembered circles, all at their positions at that stamp.

        range_m is the distance up to which the edge of a circle is visible; it is extended to
        the farthest circle observed. A stamp that does not rise clears the memory.
        """
        last, self._stamp_ns = self._stamp_ns, stamp_ns
        found = [(circle, 0.0) for circle in observed]
        if last is not None and last < stamp_ns:
            dt = (stamp_ns - last) * NANO
            edges = [distance(c.center_m, position) - c.radius_m for c in observed]
            range_m = max(range_m, *edges) if edges else range_m
            for circle, age in self._circles:
                (x, y), (vx, vy), r = circle.center_m, circle.velocity_mps, circle.radius_m
                center, age, same = (x + vx * dt, y + vy * dt), age + dt, _SAME_SHARE * r
                beyond = distance(center, position) - r - range_m
                # A circle farther beyond the range cannot be one of the observed ones.
                hidden = beyond > same or (
                    beyond > 0.0 and all(distance(center, c.center_m) > same for c in observed)
                )
                if hidden and not self._expired(circle, age):
                    later = Circle(center_m=center, radius_m=r, velocity_mps=(vx, vy))
                    found.append((later, age))
        self._circles = found
        return [circle for circle, _ in found]

    def _expired(self, circle: Circle, age_s: float) -> bool:
        """Whether a circle has been out of range for too long."""
        p, (vx, vy) = self.params, circle.velocity_mps
        return age_s > p.longest_s or age_s * math.sqrt(vx * vx + vy * vy) > p.path_m
