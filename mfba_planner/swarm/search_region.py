# SPDX-License-Identifier: Apache-2.0
"""Where bats search: a box in d dimensions, or the disc of one step in the plane."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from ..core.errors import ConfigError

Vector = list[float]


class Region(Protocol):
    """Where the bats search."""

    def span(self) -> tuple[Vector, Vector]:
        """Return x_min and x_max of eq. 3, d floats each."""

    def inner(self) -> tuple[Vector, Vector]:
        """Return a box in whose interior clamp changes nothing."""

    def clamp(self, x: Vector) -> Vector:
        """Return x, or the point of the edge that replaces an x outside."""


@dataclass(frozen=True, slots=True)
class Box:
    """Axis-aligned box [lower, upper], d floats each; raises ConfigError if empty or infinite."""

    lower: tuple[float, ...]
    upper: tuple[float, ...]

    def __post_init__(self) -> None:
        """Refuse a box in which nothing can be searched."""
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
        """Each coordinate is cut to its interval, a NaN to the lower edge."""
        return [
            (v if v < high else high) if v > low else low
            for v, low, high in zip(x, self.lower, self.upper)
        ]


@dataclass(frozen=True, slots=True)
class Disc:
    """Disc in the plane: the points a robot can reach in one step."""

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
        """A point outside is drawn back along its radius."""
        (cx, cy), (px, py) = self.center, x
        dx, dy = px - cx, py - cy
        norm = math.sqrt(dx * dx + dy * dy)
        if norm <= self.radius:
            return x
        scale = self.radius / norm
        return [cx + dx * scale, cy + dy * scale]
