# SPDX-License-Identifier: Apache-2.0
"""Search regions of the bats: a box in d dimensions, or a disc in the plane."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from ..core.errors import ConfigError

Vector = list[float]


class Region(Protocol):
    """A search region."""

    def span(self) -> tuple[Vector, Vector]:
        """Return x_min and x_max of eq. 3, d floats each."""

    def inner(self) -> tuple[Vector, Vector]:
        """Return a box in whose interior clamp changes nothing."""

    def clamp(self, x: Vector) -> Vector:
        """Return x, or for an x outside a point on the edge."""


@dataclass(frozen=True, slots=True)
class Box:
    """Axis-aligned box [lower, upper], d floats each; raises ConfigError if empty or infinite."""

    lower: tuple[float, ...]
    upper: tuple[float, ...]

    def __post_init__(self) -> None:
        """Raise ConfigError for bounds that are not finite numbers with lower <= upper."""
        try:
            for name in ("lower", "upper"):
                edge = tuple(float(v) for v in getattr(self, name))
                object.__setattr__(self, name, edge)
        except (TypeError, ValueError):
            raise ConfigError(
                f"box from {self.lower!r} to {self.upper!r}: give d numbers for each"
            ) from None
        if not self.lower or len(self.lower) != len(self.upper):
            raise ConfigError(
                f"box of {len(self.lower)} lower and {len(self.upper)} upper bounds: "
                "give d >= 1 of each"
            )
        for low, high in zip(self.lower, self.upper):
            if not (math.isfinite(low) and math.isfinite(high) and low <= high):
                raise ConfigError(f"bounds [{low}, {high}]: give finite lower <= upper")

    def span(self) -> tuple[Vector, Vector]:
        """The box itself."""
        return list(self.lower), list(self.upper)

    def inner(self) -> tuple[Vector, Vector]:
        """The box itself."""
        return self.span()

    def clamp(self, x: Vector) -> Vector:
        """Each coordinate is cut to its interval, NaN to the lower edge."""
        return [
            (v if v < high else high) if v > low else low
            for v, low, high in zip(x, self.lower, self.upper)
        ]


@dataclass(frozen=True, slots=True)
class Disc:
    """Disc in the plane: the points a robot can reach in one goal step."""

    radius: float
    center: tuple[float, float] = (0.0, 0.0)

    def span(self) -> tuple[Vector, Vector]:
        """The disc's bounding square."""
        (cx, cy), r = self.center, self.radius
        return [cx - r, cy - r], [cx + r, cy + r]

    def inner(self) -> tuple[Vector, Vector]:
        """A square inside the disc."""
        (cx, cy), r = self.center, 0.7 * self.radius
        return [cx - r, cy - r], [cx + r, cy + r]

    def clamp(self, x: Vector) -> Vector:
        """A point outside is moved along its radius to the edge."""
        (cx, cy), (px, py) = self.center, x
        dx, dy = px - cx, py - cy
        norm = math.sqrt(dx * dx + dy * dy)
        if norm <= self.radius:
            return x
        scale = self.radius / norm
        return [cx + dx * scale, cy + dy * scale]
