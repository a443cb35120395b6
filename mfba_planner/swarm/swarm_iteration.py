# SPDX-License-Identifier: Apache-2.0
"""One iteration of n bats (eq. 4-7): in d dimensions, and unrolled for the plane."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from .bat_params import BatParams, Bounds, Velocity, Walk
from .search_region import Box, Disc, Region, Vector

Bats = Iterable[Any]
Pair = tuple[Vector, Vector]
Pairs = list[Pair] | None
Iteration = Callable[[Bats, float, Vector, float, Pairs], list[Vector]]


@dataclass(slots=True)
class BatMotion:
    """Constants of eq. 4-7 for one swarm; points within low-high need no clamp."""

    f_min: float
    f_span: float
    sign: float
    inertia: float
    from_best: bool
    low: Vector
    high: Vector
    clamp: Callable[[Vector], Vector]
    is_box: bool
    disc: Disc | None

    @classmethod
    def of(cls, params: BatParams, region: Region) -> BatMotion:
        """Derive the constants from the options."""
        low, high = region.inner()
        clamp = region.clamp
        if params.bounds is Bounds.NONE:
            low, high, clamp = [-math.inf] * len(low), [math.inf] * len(low), _unchanged
        # Eq. 5 with the sign towards the best; the printed sign gives -f.
        sign = 1.0 if params.velocity is Velocity.TOWARDS_BEST else -1.0
        f_span, from_best = params.f_max - params.f_min, params.walk is Walk.BEST
        # Exact types only: a subclass may have another clamp.
        bounded = params.bounds is Bounds.CLAMP
        is_box, disc = type(region) is Box and bounded, None
        if type(region) is Disc and bounded:
            disc = region
        return cls(
            params.f_min, f_span, sign, params.inertia, from_best, low, high, clamp, is_box, disc
        )

    def iteration(self, d: int) -> Iteration:
        """The function for d dimensions: (bats, t, best, scale, pairs) -> candidates.

        A bat is a tuple of x, v (changed in place), r, beta / t, the draw that decides on the
        local walk, and d draws for epsilon. scale is sigma times the mean loudness. With pairs,
        a bat's walk is multiplied by the difference of its pair.
        """
        return self._iterate_in_the_plane if d == 2 else self._iterate_in_d_dimensions

    def _iterate_in_d_dimensions(
        self, bats: Bats, t: float, best: Vector, scale: float, pairs: Pairs
    ) -> list[Vector]:
        inertia, clamp = self.inertia, self.clamp
        points = []
        for i, (x, v, r, beta_factor, walk_draw, *draws) in enumerate(bats):
            f = self.sign * (self.f_min + self.f_span * (t * beta_factor))  # eq. 4
            point = []
            for j, (xj, bj, draw) in enumerate(zip(x, best, draws)):
                v[j] = vj = inertia * v[j] + (bj - xj) * f  # eq. 5
                new = xj + vj  # eq. 6
                if walk_draw > r:
                    epsilon = 2.0 * draw - 1.0
                    if pairs:
                        one, other = pairs[i]
                        epsilon *= other[j] - one[j]
                    new = (bj if self.from_best else new) + scale * epsilon  # eq. 7
                point.append(new)
            points.append(clamp(point))
        return points

    def _iterate_in_the_plane(
        self, bats: Bats, t: float, best: Vector, scale: float, pairs: Pairs
    ) -> list[Vector]:
        """Two coordinates unrolled: the same result bit by bit, in half the time."""
        f_min, f_span, sign, inertia = self.f_min, self.f_span, self.sign, self.inertia
        clamp, is_box, from_best, (bx, by) = self.clamp, self.is_box, self.from_best, best
        (left, bottom), (right, top) = self.low, self.high
        disc = self.disc
        if disc is not None:
            (cx, cy), radius = disc.center, disc.radius
        points: list[Vector] = []
        for (x, y), v, r, beta_factor, walk_draw, ex, ey in bats:
            f = sign * (f_min + f_span * (t * beta_factor))  # eq. 4
            vx, vy = v
            v[0] = vx = inertia * vx + (bx - x) * f  # eq. 5
            v[1] = vy = inertia * vy + (by - y) * f  # eq. 5
            if walk_draw > r:
                ex = 2.0 * ex - 1.0
                ey = 2.0 * ey - 1.0
                if pairs:
                    one, other = pairs[len(points)]
                    ex *= other[0] - one[0]
                    ey *= other[1] - one[1]
                if from_best:
                    x = bx + scale * ex  # eq. 7
                    y = by + scale * ey  # eq. 7
                else:
                    x = x + vx + scale * ex  # eq. 7
                    y = y + vy + scale * ey  # eq. 7
            else:
                x += vx  # eq. 6
                y += vy  # eq. 6
            if left < x < right and bottom < y < top:
                points.append([x, y])
            elif is_box:  # as Box.clamp, without its call
                x = left if not x > left else x if x < right else right
                y = bottom if not y > bottom else y if y < top else top
                points.append([x, y])
            elif disc is not None:  # as Disc.clamp
                dx, dy = x - cx, y - cy
                norm = math.sqrt(dx * dx + dy * dy)
                if norm > radius:
                    scaled = radius / norm
                    x, y = cx + dx * scaled, cy + dy * scaled
                points.append([x, y])
            else:
                points.append(clamp([x, y]))
        return points


def _unchanged(x: Vector) -> Vector:
    return x
