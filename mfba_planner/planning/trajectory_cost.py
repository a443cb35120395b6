# SPDX-License-Identifier: Apache-2.0
"""What a way through a waypoint would cost among circles that keep their velocities."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from operator import itemgetter

import numpy as np

from ..core.geometry import Point, towards
from ..core.options import check, option
from ..core.types import Circle, Ranges

_ROUNDING = 1.0 - 1e-9
_TINY = 1e-12
_Row = tuple[float, float, float, float, float, float, float, float, float]
_nearness = itemgetter(0)
Way = tuple[float, Point, float, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class RiskParams:
    """How predicted contacts, close passes and waiting weigh against metres of way."""

    horizon_s: float = option(
        3.0, "tau, beyond which nothing is predicted", unit="s", minimum=0.1, maximum=60.0
    )
    contact_m: float = option(
        3.0, "weight of a contact, however far off", unit="m", minimum=0.0, maximum=1e6
    )
    urgent_m: float = option(
        100.0, "weight of a contact within moments", unit="m", minimum=0.0, maximum=1e6
    )
    close_m: float = option(
        0.3, "weight of a pass without clearance", unit="m", minimum=0.0, maximum=1e6
    )
    margin_m: float = option(
        0.015, "clearance below which a pass is close", unit="m", minimum=1e-6, maximum=10.0
    )
    margin_ticks: float = option(
        1.5, "ticks of an obstacle's own motion added to it", minimum=0.0, maximum=100.0
    )
    waiting: float = option(
        0.1, "what a second of waiting counts, in seconds of driving", minimum=0.0, maximum=100.0
    )

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)


class TrajectoryCost:
    """Circles around one position, each moving on as it does now.

    A circle that turns is noticed a tick later: hence margins that grow with its speed. Plain
    floats, since few circles are near and most ways are refused by their length or by the
    first circle: arrays cost more than they spare.
    """

    def __init__(
        self,
        position: Point,
        circles: Sequence[Circle],
        params: RiskParams,
        tick_s: float,
        speed_mps: float = math.inf,
    ) -> None:
        """Take the circles as they are now; who cannot be met at that speed is left out."""
        self.params = params
        px, py = position
        tau, per_mps = params.horizon_s, params.margin_ticks * tick_s
        self._rows: list[_Row] = []
        self._tau, self._waiting = tau, params.waiting
        self._weights = tau, params.close_m, params.contact_m, params.urgent_m
        for circle in circles:
            (x, y), (vx, vy), r = circle.center_m, circle.velocity_mps, circle.radius_m
            own = math.sqrt(vx * vx + vy * vy)
            margin = params.margin_m + per_mps * own
            x, y, outer = x - px, y - py, r + margin
            meets = outer + (speed_mps + own) * tau
            away, outer = x * x + y * y, outer * outer
            if away <= meets * meets:
                self._rows.append((away - outer, x, y, vx, vy, r, margin, outer, away))
        # The nearest first: it refuses most. Of equally near ones the first told.
        self._rows.sort(key=_nearness)
        self._weighed = self._rows
        self._shut = False

    def closed(self, ux: np.ndarray, uy: np.ndarray) -> np.ndarray:
        """Bits (m,): 1 where a robot with velocity (ux, uy) comes too close within tau."""
        if not self._rows:
            return np.zeros(ux.shape, dtype=int)
        _, x, y, vx, vy, _, _, outer, away = np.array(self._rows).T[:, :, None]
        wx, wy = vx - ux, vy - uy
        b = x * wx
        b += y * wy
        wx *= wx
        wy *= wy
        a = wx
        a += wy
        a += _TINY
        t = -b
        t /= a
        np.maximum(t, 0.0, out=t)
        np.minimum(t, self.params.horizon_s, out=t)
        # (a t + 2 b) t + away, in place: this is done for 72 headings and every circle
        a *= t
        b *= 2.0
        a += b
        a *= t
        a += away
        near: np.ndarray = (a < np.minimum(away, outer) * _ROUNDING).any(axis=0)
        return near.astype(int)

    def cheapest(
        self, ways: Sequence[Way], to_goal: Point, speed: float, bound: float
    ) -> tuple[Point, float, float] | None:
        """Waypoint, t1 and cost of the cheapest way if it costs less than the bound, else None.

        A way is what it costs at least, its waypoint, t1 and a number: ways of equal number have
        the same velocity until t1. They are sorted; the first had better be a good one (at least
        -inf, with a number of its own, any can be). Of equally cheap ones the first is taken.
        Who is met by none that costs less is left out of cost() from then on.
        """
        found, shut = None, set[int]()
        for k, (lower, way, t1, number) in enumerate(ways):
            if lower >= bound:
                break  # so are all that follow
            if number in shut:
                continue  # it meets whom a shorter one met, at the same moment, or is longer still
            cost = self.cost(way, t1, to_goal, speed, bound)
            if cost < bound:
                found, bound = (way, t1, cost), cost
            elif self._shut:
                shut.add(number)
            if k == 0:
                self._narrow(to_goal, bound)
        return found

    def cost(
        self, way: Point, t1: float, to_goal: Point, speed: float, bound: float = math.inf
    ) -> float:
        """Eq. 1 through a waypoint (relative, like the goal), plus waiting and risk, in metres.

        The robot is at the waypoint after t1 > 0 seconds and goes on straight to the goal at
        full speed. Where the cost is not below the bound, a smaller number may be returned
        that is not below it either.
        """
        (qx, qy), (gx, gy) = way, to_goal
        rx, ry = gx - qx, gy - qy
        first, second = math.sqrt(qx * qx + qy * qy), math.sqrt(rx * rx + ry * ry)
        total = first + second + self._waiting * (speed * t1 - first)
        if total >= bound:
            return total
        left, tau = bound - total, self._tau
        risk = self._leg(0.0, 0.0, 0.0, 0.0, qx / t1, qy / t1, t1 if t1 < tau else tau, left)
        driven = first / speed  # what is put off by waiting is no less of a risk
        if risk < left and driven < tau and second > 0.0:
            ux, uy = rx * speed / second, ry * speed / second
            lasts = min(second / speed, tau - driven)
            later = self._leg(qx, qy, t1, driven, ux, uy, lasts, left)
            if later > risk:
                risk = later
        return total + risk

    def _narrow(self, to_goal: Point, bound: float) -> None:
        """Leave out of cost() who is met by no way that costs less than the bound.

        Such a way stays where |p| + |p - goal| is less than the bound, hence the centres of
        those it meets where it is less than the bound + 2 radii. That sum is convex in time,
        so its tangent now tells how small it may become.
        """
        (gx, gy), tau, kept = to_goal, self.params.horizon_s, []
        for row in self._weighed:
            _, x, y, vx, vy, r, margin, _, _ = row
            hx, hy = x - gx, y - gy
            near = math.sqrt(x * x + y * y) or _TINY
            far = math.sqrt(hx * hx + hy * hy) or _TINY
            sum_now = near + far
            change = (vx * x + vy * y) / near + (vx * hx + vy * hy) / far
            if change < 0.0:
                sum_now += change * tau
            if sum_now < bound + 2.0 * (r + margin):
                kept.append(row)
        self._weighed = kept

    def _leg(
        self,
        qx: float,
        qy: float,
        t0: float,
        s0: float,
        ux: float,
        uy: float,
        lasts: float,
        bound: float,
    ) -> float:
        """The worst risk of a leg that begins in (qx, qy) at t0; or one not below bound.

        s0 of the way is driven before it. With x = 1 - s/tau, a contact after s of driving costs
        contact_m x^2 + urgent_m x^8, a closest approach costs close_m x times the share of the
        margin that is missing. Who is within a margin already may leave it in any direction, but
        not go deeper.
        """
        tau, close, contact, urgent = self._weights
        worst, sqrt = 0.0, math.sqrt
        for _, x, y, vx, vy, r, margin, outer, away in self._weighed:
            if t0 > 0.0:
                x = x + vx * t0 - qx
                y = y + vy * t0 - qy
                away = x * x + y * y
            wx = vx - ux
            wy = vy - uy
            b = x * wx + y * wy
            if b >= 0.0:
                continue
            a = wx * wx + wy * wy
            nearest = -b / a
            t = nearest if nearest < lasts else lasts
            c = (a * t + 2.0 * b) * t + away
            if c >= outer or c >= away * _ROUNDING:
                continue
            missing = 1.0 - (sqrt(c) - r) / margin if c > 0.0 else 1.0
            risk = (missing if missing < 1.0 else 1.0) * close * (1.0 - (s0 + t) / tau)
            if c < r * r:
                deepest = away + b * nearest  # if the leg lasted until then
                met = nearest - sqrt((r * r - (deepest if deepest < c else c)) / a)
                late = 1.0 - (s0 + met) / tau if met > 0.0 else 1.0 - s0 / tau
                late *= late
                risk += late * (contact + urgent * late * late * late)
            if risk > worst:
                worst = risk
                if worst >= bound:
                    # However long the leg, a contact on it comes at the same moment.
                    self._shut = t0 == 0.0 and worst - close >= bound
                    break
        return worst


def moved(circles: Sequence[Circle], dt: float) -> Sequence[Circle]:
    """The circles dt seconds later, at constant velocity."""
    if dt == 0.0:
        return circles
    return [
        replace(c, center_m=(c.center_m[0] + dt * vx, c.center_m[1] + dt * vy))
        for c in circles
        for vx, vy in [c.velocity_mps]
    ]


def from_sectors(position: Point, ranges_m: Ranges, radius_m: float) -> list[Circle]:
    """A circle at rest for every set sector, its edge at the range along the middle."""
    width = 2.0 * math.pi / max(len(ranges_m), 1)
    return [
        Circle(center_m=towards(position, (i + 0.5) * width, r + radius_m), radius_m=radius_m)
        for i, r in enumerate(ranges_m)
        if math.isfinite(r)
    ]
