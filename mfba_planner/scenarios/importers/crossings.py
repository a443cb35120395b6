# SPDX-License-Identifier: Apache-2.0
"""Crossings of a robot among recorded people, who do not react to it.

Crossing k is drawn from the seed and k: a side of the area, start and goal on it and on the
opposite one, and a moment at which a robot that drives straight would come within 1 m of a
person's centre or nearer. People are where they were recorded, straight between two samples, and
absent before and after.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...core.errors import ConfigError
from ...core.geometry import Point
from .imported import Imported, ImportOptions, Plain, check_count, rounded

Track = tuple[np.ndarray, np.ndarray]  # times (n,) and positions (n, 2) of one person
Positions = Callable[[Track, np.ndarray], np.ndarray]

ROBOT_RADIUS_M = 0.3
LIMIT_S = 60.0
NEAR_M = 1.0  # that a straight trip comes to a person's centre, or nearer
FREE_M = 0.4  # around the start at first, beyond both radii, and around the goal while arriving
LEAST_PEOPLE = 3  # who are in the area meanwhile
TRIES = 5000
_AREA_PERCENT = (2.0, 98.0)  # of all positions: what lies in the recorded area
_STEP_S = 0.1
_ARRIVING = 20  # steps


@dataclass(frozen=True, slots=True, kw_only=True)
class Crossing:
    """A trip that begins at t0_s of the recording, and the people recorded during it."""

    start_m: Point
    goal_m: Point
    t0_s: float
    tracks: Sequence[Track]


def straight_on(track: Track, t_s: np.ndarray) -> np.ndarray:
    """Positions (k, 2) at times (k,): interpolated, and straight on beyond both ends."""
    times, points = track
    k = np.clip(np.searchsorted(times, t_s, side="right") - 1, 0, len(times) - 2)
    share = (t_s - times[k]) / (times[k + 1] - times[k])
    found: np.ndarray = points[k] + share[:, None] * (points[k + 1] - points[k])
    return found


def while_recorded(track: Track, t_s: np.ndarray) -> np.ndarray:
    """Positions (k, 2) at times (k,): interpolated; NaN before and after the recording."""
    times, _ = track
    absent = (t_s < times[0]) | (t_s > times[-1])
    return np.where(absent[:, None], np.nan, straight_on(track, t_s))


def draw_crossing(
    name: str,
    tracks: Sequence[Track],
    speed_mps: float,
    number: int,
    seed: int,
    radius_m: float,
    robot_radius_m: float = ROBOT_RADIUS_M,
    *,
    positions: Positions = while_recorded,
    ends: tuple[Point, Point] | None = None,
    at_s: float | None = None,
) -> Crossing:
    """Crossing `number` of a recording; ConfigError, beginning with its name, if none is found.

    ends are start and goal, and at_s the moment of the start, instead of drawn ones.
    """
    rng = np.random.default_rng([seed, number])
    everywhere = np.concatenate([points for _, points in tracks])
    low, high = np.percentile(everywhere, _AREA_PERCENT, axis=0)
    first_s = min(times[0] for times, _ in tracks)
    last_s = max(times[-1] for times, _ in tracks)
    tries = 1 if ends is not None and at_s is not None else TRIES
    for _ in range(tries):
        a, b = _ends(rng, low, high) if ends is None else map(np.array, ends)
        trip_s = math.dist(a, b) / speed_mps
        if last_s - first_s <= trip_s:
            raise ConfigError(f"{name}: shorter than a trip of {trip_s:.0f} s; give a longer one")
        t0 = rng.uniform(first_s, last_s - trip_s) if at_s is None else at_s
        # Who is recorded during the trip; those who come later are left out.
        present = [t for t in tracks if t[0][0] <= t0 + 1.5 * trip_s and t[0][-1] >= t0]
        t = np.arange(0.0, trip_s, _STEP_S)
        robot = a + (t / trip_s)[:, None] * (b - a)
        centers = np.array([positions(track, t0 + t) for track in present])
        centers = centers.reshape(-1, t.size, 2)
        with np.errstate(invalid="ignore"):
            inside = ((centers >= low) & (centers <= high)).all(axis=2).any(axis=1)
        if inside.sum() < LEAST_PEOPLE:
            continue
        away = _distances(centers, robot)
        free_m = radius_m + robot_radius_m + FREE_M
        at_goal = _distances(centers[:, -_ARRIVING:], b)
        if away.min() > NEAR_M or away[:, 0].min() < free_m or at_goal.min() < free_m:
            continue
        return Crossing(start_m=_point(a), goal_m=_point(b), t0_s=float(t0), tracks=present)
    raise ConfigError(f"{name}: no crossing found in {tries} tries; give a denser recording")


def _ends(
    rng: np.random.Generator, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Start and goal on opposite sides of the area."""
    axis, flip = int(rng.integers(2)), rng.random() < 0.5
    a, b = np.empty(2), np.empty(2)
    a[axis], b[axis] = (high[axis], low[axis]) if flip else (low[axis], high[axis])
    a[1 - axis], b[1 - axis] = rng.uniform(low[1 - axis], high[1 - axis], 2)
    return a, b


def _distances(centers: np.ndarray, robot: np.ndarray) -> np.ndarray:
    """Distances of people to the robot, inf of those who are not there."""
    away = np.linalg.norm(centers - robot, axis=2)
    return np.where(np.isnan(away), np.inf, away)


def crossings_of(name: str, tracks: Sequence[Track], options: ImportOptions) -> Imported:
    """Crossings as scenarios NAME-0, NAME-1, ... Raises ConfigError if there is none.

    With options.every_s one begins at every such moment that has one; the others are lost.
    """
    if (options.start_m is None) != (options.goal_m is None):
        raise ConfigError("start_m and goal_m: only one is given; give both, or none")
    scenarios, skipped = [], 0
    for k, at_s in enumerate(_moments(tracks, options)):
        try:
            crossing = draw_crossing(
                name,
                tracks,
                options.speed_mps,
                k,
                options.seed,
                options.person_radius_m,
                options.robot_radius_m or ROBOT_RADIUS_M,
                ends=_given_ends(options),
                at_s=at_s,
            )
        except ConfigError:
            if at_s is None:
                raise
            skipped += 1
            continue
        scenarios.append(_scenario(f"{name}-{k}", crossing, tracks, options))
    if not scenarios:
        raise ConfigError(
            f"no crossing at any of {skipped} moments; give others, or a denser recording"
        )
    lost = [f"{skipped} moments without a crossing"] if skipped else []
    return Imported(scenarios=scenarios, lost=lost)


def _given_ends(options: ImportOptions) -> tuple[Point, Point] | None:
    if options.start_m is None or options.goal_m is None:
        return None
    return options.start_m, options.goal_m


def _moments(tracks: Sequence[Track], options: ImportOptions) -> list[float | None]:
    if not options.every_s:
        return [None] * options.count
    first_s = min(times[0] for times, _ in tracks)
    last_s = max(times[-1] for times, _ in tracks)
    count = min(options.count, math.floor((last_s - first_s) / options.every_s) + 1)
    return [float(first_s + k * options.every_s) for k in range(count)]


def _scenario(
    name: str, crossing: Crossing, tracks: Sequence[Track], options: ImportOptions
) -> Plain:
    """A crossing among all who are recorded until its time limit."""
    limit_s, t0_s = options.time_limit_s or LIMIT_S, crossing.t0_s
    there = [t for t in tracks if t[0][0] < t0_s + limit_s and t[0][-1] > t0_s]
    people = [trajectory(track, t0_s, limit_s) for track in there]
    people = [knots for knots in people if len(knots) > 1]
    check_count("people", len(people))
    return {
        "name": name,
        "description": f"imported: recorded people from {crossing.t0_s:.3f} s on",
        "start_m": rounded(*crossing.start_m),
        "goal_m": rounded(*crossing.goal_m),
        "robot_radius_m": options.robot_radius_m or ROBOT_RADIUS_M,
        "time_limit_s": limit_s,
        "obstacles": [
            {"radius_m": options.person_radius_m, "trajectory": knots} for knots in people
        ],
    }


def trajectory(track: Track, t0_s: float, limit_s: float) -> list[list[float]]:
    """The knots [t, x, y] of a person from t0_s of the recording on, for limit_s.

    Cut at t = 0, and after the first sample beyond the limit.
    """
    times, _ = track
    begin = max(float(times[0]), t0_s)
    stamps = [begin, *times[(times > begin + 1e-6) & (times < t0_s + limit_s)].tolist()]
    stamps += times[times >= t0_s + limit_s][:1].tolist()
    places = straight_on(track, np.array(stamps))
    return [rounded(t - t0_s, x, y) for t, (x, y) in zip(stamps, places.tolist())]


def _point(row: np.ndarray) -> Point:
    return (float(row[0]), float(row[1]))
