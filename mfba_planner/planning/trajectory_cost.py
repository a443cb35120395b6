# SPDX-License-Identifier: Apache-2.0
"""Cost of the path through a waypoint to the goal, with obstacles at constant velocity."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from operator import itemgetter

import numpy as np

from ..core.geometry import Point, towards
from ..core.option_specs import check, option
from ..core.planner_types import Circle, Ranges
from .drive_rollout import DriveRollout

_ROUNDING = 1.0 - 1e-9
_TINY = 1e-12
TURNING_MARGIN_M, TURNING_CLOSE, TURNING_HORIZON = 0.15, 7.0, 5.0 / 3.0
SLOW = 0.9  # share of the speed below which a candidate waits
_Row = tuple[float, float, float, float, float, float, float, float, float, float]
_by_clearance = itemgetter(0)
Candidate = tuple[float, Point, float, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class RiskParams:
    """Weights of predicted contacts, close passes and waiting, in metres of path."""

    horizon_s: float = option(3.0, "prediction horizon tau", unit="s", minimum=0.1, maximum=60.0)
    contact_m: float = option(
        3.0,
        "weight of a contact, at any time within the horizon",
        unit="m",
        minimum=0.0,
        maximum=1e6,
    )
    urgent_m: float = option(
        100.0, "additional weight of an imminent contact", unit="m", minimum=0.0, maximum=1e6
    )
    close_m: float = option(
        0.3, "weight of a pass without clearance", unit="m", minimum=0.0, maximum=1e6
    )
    margin_m: float = option(
        0.015, "clearance below which a pass is close", unit="m", minimum=1e-6, maximum=10.0
    )
    margin_ticks: float = option(
        1.5, "ticks of an obstacle's motion added to the margin", minimum=0.0, maximum=100.0
    )
    fast_mps: float = option(
        0.5, "speed from which an obstacle is kept farther away from, as it may turn",
        unit="m/s", minimum=0.0, maximum=100.0,
    )  # fmt: skip
    fast_margin_s: float = option(
        0.4, "margin added per m/s above fast_mps", unit="s", minimum=0.0, maximum=10.0
    )
    fast_close_s: float = option(
        1.0, "weight of a close pass added per m/s above fast_mps, for at most 1 m/s",
        unit="s", minimum=0.0, maximum=100.0,
    )  # fmt: skip
    waiting: float = option(
        0.1, "cost of waiting, in seconds of driving per second", minimum=0.0, maximum=100.0
    )

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)

    def around(self, speed_mps: float, tick_s: float) -> tuple[float, float]:
        """Margin (m) around an obstacle of this speed, and the weight of a pass within it (m).

        One that turns is noticed a tick later. One that is fast leaves no time to evade then.
        """
        over = max(speed_mps - self.fast_mps, 0.0)
        margin = self.margin_m + self.margin_ticks * tick_s * speed_mps + self.fast_margin_s * over
        return margin, self.close_m + self.fast_close_s * min(over, 1.0)

    def for_turning(self) -> RiskParams:
        """The weights of a base that cannot step aside when an obstacle beside it turns.

        It passes at a distance, rather drives on than into the margin, and looks further ahead:
        it would flee from who overtakes it until turning aside is too late.
        """
        return replace(
            self,
            margin_m=self.margin_m + TURNING_MARGIN_M,
            close_m=TURNING_CLOSE * self.close_m,
            horizon_s=TURNING_HORIZON * self.horizon_s,
        )


class TrajectoryCost:
    """Costs of candidates from one position among circles that keep their velocities.

    Plain floats instead of arrays are faster here: few circles are near, and most candidates are
    rejected by their length or by the first circle.
    """

    def __init__(
        self,
        position: Point,
        circles: Sequence[Circle],
        params: RiskParams,
        tick_s: float,
        speed_mps: float = math.inf,
        drive: DriveRollout | None = None,
    ) -> None:
        """Take the present circles; those out of reach within the horizon are left out.

        With a drive, the risk is that of the path which a differential base takes.
        """
        self._drive = drive
        self.params = params
        px, py = position
        tau = params.horizon_s
        self._rows: list[_Row] = []
        self._tau, self._waiting = tau, params.waiting
        self._weights = tau, params.contact_m, params.urgent_m
        for circle in circles:
            (x, y), (vx, vy), r = circle.center_m, circle.velocity_mps, circle.radius_m
            circle_speed = math.sqrt(vx * vx + vy * vy)
            margin, close = params.around(circle_speed, tick_s)
            x, y, outer = x - px, y - py, r + margin
            reachable = outer + (speed_mps + circle_speed) * tau
            away, outer = x * x + y * y, outer * outer
            if away <= reachable * reachable:
                self._rows.append((away - outer, x, y, vx, vy, r, margin, outer, away, close))
        # The nearest first, as it rejects most candidates; the sort is stable.
        self._rows.sort(key=_by_clearance)
        self._active_rows = self._rows
        self._contact_on_first_segment = False

    def closed(self, ux: np.ndarray, uy: np.ndarray) -> np.ndarray:
        """Bits (m,): 1 if a robot with velocity (ux, uy) comes too close within tau."""
        if not self._rows:
            return np.zeros(ux.shape, dtype=int)
        _, x, y, vx, vy, _, _, outer, away, _ = np.array(self._rows).T[:, :, None]
        if self._drive is not None:
            delay = self._drive.turn_delay.towards_all(ux, uy)
            x, y = x + vx * delay, y + vy * delay
            away = x * x + y * y
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
        # (a t + 2 b) t + away, in place for speed: 72 headings times all circles
        a *= t
        b *= 2.0
        a += b
        a *= t
        a += away
        near: np.ndarray = (a < np.minimum(away, outer) * _ROUNDING).any(axis=0)
        return near.astype(int)

    def cheapest(
        self, candidates: Sequence[Candidate], to_goal: Point, speed: float, bound: float
    ) -> tuple[Point, float, float] | None:
        """Waypoint, t1 and cost of the cheapest candidate if below the bound, else None.

        A candidate is its least possible cost, its waypoint, t1 and a number; candidates of equal
        number have the same velocity until t1. They must be sorted. A good first one saves time:
        any can be put first with least cost -inf and a unique number. Of equal costs the first is
        taken. Circles out of reach of all cheaper candidates are left out of cost() afterwards.
        """
        found, blocked = None, set[int]()
        for k, (lower, waypoint, t1, number) in enumerate(candidates):
            if lower >= bound:
                break  # so are all that follow
            if number in blocked:
                continue  # same contact at the same time as a shorter one of this number
            cost = self.cost(waypoint, t1, to_goal, speed, bound)
            if cost < bound:
                found, bound = (waypoint, t1, cost), cost
            elif self._contact_on_first_segment:
                blocked.add(number)
            if k == 0:
                self._leave_out_unreachable(to_goal, bound)
        return found

    def cost(
        self, waypoint: Point, t1: float, to_goal: Point, speed: float, bound: float = math.inf
    ) -> float:
        """Eq. 1 through a waypoint (relative, like the goal), plus waiting and risk, in metres.

        The robot reaches the waypoint after t1 > 0 seconds and then drives straight to the goal
        at full speed. A cost not below the bound may be returned too small, but not below it.
        """
        (qx, qy), (gx, gy) = waypoint, to_goal
        rx, ry = gx - qx, gy - qy
        first, second = math.sqrt(qx * qx + qy * qy), math.sqrt(rx * rx + ry * ry)
        total = first + second + self._waiting * (speed * t1 - first)
        if total >= bound:
            return total
        budget, tau = bound - total, self._tau
        if self._drive is not None:
            turns_s = self._drive.turn_delay.towards(qx, qy)
            total += self._waiting * speed * turns_s
            budget = bound - total
            if budget <= 0.0:
                return total
            return total + self._rollout_risk(waypoint, t1, to_goal, budget)
        risk = self._segment_risk(
            0.0, 0.0, 0.0, 0.0, qx / t1, qy / t1, t1 if t1 < tau else tau, budget
        )
        driven = first / speed  # not t1: waiting must not reduce the risk
        if risk < budget and driven < tau and second > 0.0:
            ux, uy = rx * speed / second, ry * speed / second
            duration = min(second / speed, tau - driven)
            later = self._segment_risk(qx, qy, t1, driven, ux, uy, duration, budget)
            if later > risk:
                risk = later
        return total + risk

    def _rollout_risk(self, waypoint: Point, t1: float, to_goal: Point, budget: float) -> float:
        """The risk of cost() on the path that a differential drive takes."""
        assert self._drive is not None
        (qx, qy), tau = waypoint, self._tau
        share = math.sqrt(qx * qx + qy * qy) / (t1 * self._drive.full_mps)
        wait_s = t1 if share < SLOW else 0.0
        worst = 0.0
        for x, y, t, driven, ux, uy, lasts in self._drive.stretches(
            waypoint, wait_s, share, to_goal, tau
        ):
            if driven >= tau:
                break
            risk = self._segment_risk(x, y, t, driven, ux, uy, lasts, budget)
            if risk > worst:
                worst = risk
                if worst >= budget:
                    break
        return worst

    def _leave_out_unreachable(self, to_goal: Point, bound: float) -> None:
        """Leave circles out of cost() that no candidate with a cost below the bound can reach.

        On such a path |p| + |p - goal| is below the bound, so for the centre of a circle it
        touches this sum is below the bound + 2 radii. The sum is convex in time, so its present
        tangent gives a lower limit.
        """
        (gx, gy), tau, kept = to_goal, self.params.horizon_s, []
        for row in self._active_rows:
            _, x, y, vx, vy, r, margin, _, _, _ = row
            hx, hy = x - gx, y - gy
            near = math.sqrt(x * x + y * y) or _TINY
            far = math.sqrt(hx * hx + hy * hy) or _TINY
            sum_now = near + far
            change = (vx * x + vy * y) / near + (vx * hx + vy * hy) / far
            if change < 0.0:
                sum_now += change * tau
            if sum_now < bound + 2.0 * (r + margin):
                kept.append(row)
        self._active_rows = kept

    def _segment_risk(
        self,
        qx: float,
        qy: float,
        t0: float,
        s0: float,
        ux: float,
        uy: float,
        duration: float,
        bound: float,
    ) -> float:
        """The largest risk on a segment from (qx, qy) at time t0; or a risk not below bound.

        s0 is the driving time before it. With x = 1 - s/tau, a contact after the driving time s
        costs contact_m x^2 + urgent_m x^8; a closest approach costs close_m x times the missing
        share of the margin. Within a margin, a robot may move in any direction that does not
        bring it closer.
        """
        tau, contact, urgent = self._weights
        worst, sqrt = 0.0, math.sqrt
        for _, x, y, vx, vy, r, margin, outer, away, close in self._active_rows:
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
            t = nearest if nearest < duration else duration
            c = (a * t + 2.0 * b) * t + away
            if c >= outer or c >= away * _ROUNDING:
                continue
            missing = 1.0 - (sqrt(c) - r) / margin if c > 0.0 else 1.0
            risk = (missing if missing < 1.0 else 1.0) * close * (1.0 - (s0 + t) / tau)
            if c < r * r:
                deepest = away + b * nearest  # squared distance if the segment lasted until then
                met = nearest - sqrt((r * r - (deepest if deepest < c else c)) / a)
                urgency = 1.0 - (s0 + met) / tau if met > 0.0 else 1.0 - s0 / tau
                urgency *= urgency
                risk += urgency * (contact + urgent * urgency * urgency * urgency)
            if risk > worst:
                worst = risk
                if worst >= bound:
                    # A longer segment would have this contact at the same time.
                    self._contact_on_first_segment = t0 == 0.0 and worst - close >= bound
                    break
        return worst


def predicted_circles(circles: Sequence[Circle], dt: float) -> Sequence[Circle]:
    """The circles dt seconds later, at constant velocity."""
    if dt == 0.0:
        return circles
    return [
        replace(c, center_m=(c.center_m[0] + dt * vx, c.center_m[1] + dt * vy))
        for c in circles
        for vx, vy in [c.velocity_mps]
    ]


def circles_from_sectors(position: Point, ranges_m: Ranges, radius_m: float) -> list[Circle]:
    """A circle at rest for every set sector, its edge at the range along the sector's middle."""
    width = 2.0 * math.pi / max(len(ranges_m), 1)
    return [
        Circle(center_m=towards(position, (i + 0.5) * width, r + radius_m), radius_m=radius_m)
        for i, r in enumerate(ranges_m)
        if math.isfinite(r)
    ]
