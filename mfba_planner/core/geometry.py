# SPDX-License-Identifier: Apache-2.0
"""Plane geometry: poses, angles, yaw and quaternion, distances, tangents and rays to circles."""

from __future__ import annotations

import math
from typing import NamedTuple

Point = tuple[float, float]


class Pose2D(NamedTuple):
    """Planar pose in the odom frame: x, y in metres, yaw in radians (REP-103)."""

    x: float
    y: float
    yaw: float = 0.0

    @property
    def position(self) -> Point:
        """(x, y) in metres."""
        return (self.x, self.y)


def wrap_angle(angle_rad: float) -> float:
    """The same angle in (-pi, pi]."""
    wrapped = math.remainder(angle_rad, 2.0 * math.pi)
    return math.pi if wrapped == -math.pi else wrapped


def quaternion_from_yaw(yaw_rad: float) -> Point:
    """(z, w) of the unit quaternion of a planar rotation (REP-103)."""
    return (math.sin(0.5 * yaw_rad), math.cos(0.5 * yaw_rad))


def yaw_from_quaternion(x: float, y: float, z: float, w: float) -> float:
    """Yaw of a quaternion that must not be 0, but need not be normalized."""
    norm = x * x + y * y + z * z + w * w
    return math.atan2(2.0 * (w * z + x * y) / norm, 1.0 - 2.0 * (y * y + z * z) / norm)


def pose_as_in_message(pose: Pose2D) -> Pose2D:
    """The pose after yaw -> quaternion -> yaw, as in a message: the last bit may differ."""
    return (
        Pose2D(pose.x, pose.y, yaw_from_quaternion(0.0, 0.0, *quaternion_from_yaw(pose.yaw)))
        if pose.yaw
        else pose
    )


def distance(a: Point, b: Point) -> float:
    """Euclidean distance, eq. 1 (sqrt is exact in IEEE-754, so every machine agrees)."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    return math.sqrt(dx * dx + dy * dy)


def bearing(a: Point, b: Point) -> float:
    """Direction from a to b in radians, counter-clockwise from +x; 0 when they coincide."""
    return math.atan2(b[1] - a[1], b[0] - a[0])


def towards(a: Point, heading_rad: float, length_m: float) -> Point:
    """The point at length_m from a along the heading."""
    return (a[0] + length_m * math.cos(heading_rad), a[1] + length_m * math.sin(heading_rad))


def rotated(vector: Point, angle_rad: float) -> Point:
    """A vector in the plane rotated counter-clockwise; an angle of 0 changes no bit."""
    if angle_rad == 0.0:
        return vector
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return (c * vector[0] - s * vector[1], s * vector[0] + c * vector[1])


def relative_pose(pose: Pose2D, base: Pose2D) -> Pose2D:
    """A pose as seen from another one, both given in the same frame."""
    x, y = rotated((pose.x - base.x, pose.y - base.y), -base.yaw)
    return Pose2D(x, y, math.remainder(pose.yaw - base.yaw, 2.0 * math.pi))


def tangent_half_angle(distance_m: float, radius_m: float) -> float:
    """Half the angle between the two tangents from a point to a circle (Fig. 5).

    On or inside the circle there are no tangents; the limit pi/2 is returned.
    """
    if distance_m <= radius_m:
        return math.pi / 2.0
    return math.asin(radius_m / distance_m)


def ray_circle_distance(distance_m: float, radius_m: float, offset_rad: float) -> float:
    """Distance along a ray to a circle whose centre lies offset_rad off the ray.

    inf when the ray misses; 0 when the ray starts on or inside the circle.
    """
    if distance_m <= radius_m:
        return 0.0
    along = distance_m * math.cos(offset_rad)
    across = distance_m * math.sin(offset_rad)
    under_root = radius_m * radius_m - across * across
    if along <= 0.0 or under_root < 0.0:
        return math.inf
    return max(0.0, along - math.sqrt(under_root))  # rounding, just outside the circle


def closest_approach(a0: Point, a1: Point, b0: Point, b1: Point) -> float:
    """Smallest distance between two points moving uniformly from a0 to a1 and b0 to b1."""
    px, py = b0[0] - a0[0], b0[1] - a0[1]
    qx, qy = b1[0] - a1[0] - px, b1[1] - a1[1] - py
    speed_squared = qx * qx + qy * qy
    s = 0.0 if speed_squared == 0.0 else -(px * qx + py * qy) / speed_squared
    s = min(1.0, max(0.0, s))
    dx, dy = px + s * qx, py + s * qy
    return math.sqrt(dx * dx + dy * dy)
