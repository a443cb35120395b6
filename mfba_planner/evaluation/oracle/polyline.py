# SPDX-License-Identifier: Apache-2.0
"""Polylines at constant speed: lengths, and gaps to segments of obstacle motion; batched."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ...core.geometry import Point
from ...simulation.constant_velocity_segments import UniformSegments
from ...simulation.obstacle_motion import Walls

Segment = tuple[float, float, float, float, float, float, float]  # UniformSegments[:7]
FAR_M = 9.0  # gap reported for a pair that never moves at the same time


def lengths(points: np.ndarray) -> np.ndarray:
    """Length (b,) of every polyline; points (b, p, 2) in metres."""
    step = points[:, 1:] - points[:, :-1]
    return np.sqrt((step * step).sum(axis=2)).sum(axis=1)


def gaps(points: np.ndarray, speed_mps: float, segments: UniformSegments) -> np.ndarray:
    """Smallest gap (b, p - 1, m) in metres of every robot edge to every obstacle segment."""
    x, y, start, end, ux, uy = (column[:, :, None] for column in _edges(points, speed_mps))
    return edge_gaps(x, y, start, end, ux, uy, segments)


def pair_gaps(
    points: np.ndarray, speed_mps: float, rows: np.ndarray, segments: UniformSegments
) -> np.ndarray:
    """Smallest gap (b, m) of robot edge rows[k] to obstacle segment k, bit for bit as gaps()."""
    x, y, start, end, ux, uy = (column[:, rows] for column in _edges(points, speed_mps))
    return edge_gaps(x, y, start, end, ux, uy, segments)


def path_gaps(
    points: Sequence[Point], speed_mps: float, rows: Sequence[int], segments: Sequence[Segment]
) -> list[float]:
    """pair_gaps() of one polyline in plain floats, bit for bit.

    Refinement calls it most often; small arrays would take ten times as long.
    """
    edges, travelled = [], 0.0
    for (x, y), (x1, y1) in pairwise(points):
        dx, dy = x1 - x, y1 - y
        length = math.sqrt(dx * dx + dy * dy)
        travelled += length
        end, per_m = travelled / speed_mps, speed_mps / max(length, 1e-12)
        edges.append((x, y, end - length / speed_mps, end, dx * per_m, dy * per_m))
    found = []
    for row, (t0, t1, ox, oy, vx, vy, radius) in zip(rows, segments):
        x, y, start, end, ux, uy = edges[row]
        low = max(start, t0)
        span = min(end, t1) - low
        if span < 0.0:
            found.append(FAR_M)
            continue
        qx, qy, since, ahead = ux - vx, uy - vy, low - t0, low - start
        px = x + ux * ahead - ox - vx * since
        py = y + uy * ahead - oy - vy * since
        s = min(max(-(px * qx + py * qy) / max(qx * qx + qy * qy, 1e-300), 0.0), span)
        px += qx * s
        py += qy * s
        found.append(math.sqrt(px * px + py * py) - radius)
    return found


def _edges(points: np.ndarray, speed_mps: float) -> tuple[np.ndarray, ...]:
    """The robot's edges, all (b, p - 1): x, y, start, end, velocity."""
    step = points[:, 1:] - points[:, :-1]
    dx, dy = step[:, :, 0], step[:, :, 1]
    length = np.sqrt(dx * dx + dy * dy)
    end = np.cumsum(length, axis=1) / speed_mps
    start = end - length / speed_mps
    per_m = speed_mps / np.maximum(length, 1e-12)
    return points[:, :-1, 0], points[:, :-1, 1], start, end, dx * per_m, dy * per_m


def edge_gaps(
    x: np.ndarray,
    y: np.ndarray,
    start: np.ndarray,
    end: np.ndarray,
    ux: np.ndarray,
    uy: np.ndarray,
    segments: UniformSegments,
) -> np.ndarray:
    """Smallest gap of robot edges (from x, y at start, velocity u, until end) to segments.

    The m segments are broadcast over the robot's arrays, whose last axis is 1 or m.
    """
    low = np.maximum(start, segments.t0)
    span = np.minimum(end, segments.t1) - low
    qx, qy = ux - segments.vx, uy - segments.vy
    since = low - segments.t0
    ahead = low - start
    px = x + ux * ahead - segments.x - segments.vx * since
    py = y + uy * ahead - segments.y - segments.vy * since
    qq = np.maximum(qx * qx + qy * qy, 1e-300)
    s = np.minimum(np.maximum(-(px * qx + py * qy) / qq, 0.0), span)
    px += qx * s
    py += qy * s
    gap: np.ndarray = np.sqrt(px * px + py * py) - segments.radius
    gap[span < 0.0] = FAR_M
    return gap


def within(area: Walls | None, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Which points lie in a rectangle; all of them without a rectangle."""
    if area is None:
        return np.ones(np.shape(x), dtype=bool)
    (x0, y0), (x1, y1) = area.lower_m, area.upper_m
    inside: np.ndarray = (x0 <= x) & (x <= x1) & (y0 <= y) & (y <= y1)
    return inside
