# SPDX-License-Identifier: Apache-2.0
"""The robot in its room, stepped by MuJoCo: command in; odometry, scan and contacts out.

No ROS here: the node and the statistics drive the same class. Time is an integer in ns.
"""

from __future__ import annotations

import math
from enum import Enum
from typing import Any, NamedTuple

import numpy as np
from contact_events import ContactEvents
from crowded_room import LIDAR, RANGE_SD_M, Room
from engine import mujoco
from robot_model_xml import (
    HIDDEN_GROUP,
    LIDAR_Z_M,
    PERSON_HALF_M,
    TIMESTEP_S,
    RobotBody,
    model_xml,
)
from wheel_odometry import OdometryErrors, WheelOdometry

from mfba_planner.core.geometry import Point, Pose2D, quaternion_from_yaw, wrap_angle
from mfba_planner.core.planner_types import NANO, Scan
from mfba_planner.simulation.simulated_lidar import limited, rays

STEP_NS = round(TIMESTEP_S / NANO)
ODOMETRY_NS = 20_000_000  # period of the odometry
SCAN_NS = 100_000_000  # period of the lidar
COMMAND_TIMEOUT_NS = 500_000_000  # without a command the base stops


class Lifted(Enum):
    """What the odometry says when the robot is lifted and put elsewhere.

    jumps: a localisation gives the new pose. unnoticed: the wheels have not turned.
    """

    JUMPS = "jumps"
    UNNOTICED = "unnoticed"


class Frame(NamedTuple):
    """What a film needs of one moment."""

    time_s: float
    qpos: np.ndarray
    people: np.ndarray


class PhysicsWorld:
    """One robot in one room; advance() moves time on."""

    def __init__(
        self,
        room: Room,
        rng: np.random.Generator,
        *,
        body: RobotBody | None = None,
        errors: OdometryErrors | None = None,
        lifted: Lifted = Lifted.JUMPS,
    ) -> None:
        """Put the robot at the start, heading along x; rng draws all errors of its sensors."""
        self.room, self.scenario, self.body = room, room.scenario, body or RobotBody()
        self.model: Any = mujoco.MjModel.from_xml_string(model_xml(room, self.body))
        self.data: Any = mujoco.MjData(self.model)
        self.now_ns = 0
        self.frames: list[Frame] = []
        self._rng, self._lifted = rng, lifted
        self._events = ContactEvents()
        self._target = (0.0, 0.0)
        self._ramped = (0.0, 0.0)
        self._commanded_ns = 0
        self._turned = 0.0
        self._find_names()
        start = Pose2D(*self.scenario.start_m)
        self.odometry = WheelOdometry(
            start,
            self.body.wheel_radius_m,
            self.body.wheel_apart_m,
            errors or OdometryErrors(),
            rng,
        )
        self._kidnappings = list(self.scenario.kidnappings)
        self._move_people()
        self.put(start)

    def _find_names(self) -> None:
        model = self.model

        def joint(name: str) -> int:
            return int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name))

        self._base = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "robot"))
        self._shell = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, "body"))
        self._names = [model.geom(number).name for number in range(model.ngeom)]
        self._wheels_at = [int(model.jnt_qposadr[joint(side)]) for side in ("left", "right")]
        self._wheel_speeds_at = [int(model.jnt_dofadr[joint(side)]) for side in ("left", "right")]
        self._visible_groups = np.ones(6, dtype=np.uint8)
        self._visible_groups[HIDDEN_GROUP] = 0

    @property
    def time_s(self) -> float:
        """Time of the people's motion, s."""
        return self.now_ns * NANO

    @property
    def contacts(self) -> list[Any]:
        """The contact events so far."""
        return self._events.events

    @property
    def pose(self) -> Pose2D:
        """The true pose of base_link."""
        x, y, _, w, _, _, z = self.data.qpos[:7].tolist()
        return Pose2D(x, y, 2.0 * math.atan2(z, w))

    @property
    def velocity(self) -> tuple[float, float]:
        """The true speed ahead (m/s) and turn rate (rad/s)."""
        vx, vy = self.data.qvel[:2].tolist()
        yaw = self.pose.yaw
        return vx * math.cos(yaw) + vy * math.sin(yaw), float(self.data.qvel[5])

    @property
    def wheel_radps(self) -> tuple[float, float]:
        """The true speeds of the wheels, left and right."""
        left, right = (float(self.data.qvel[k]) for k in self._wheel_speeds_at)
        return left, right

    @property
    def torques_nm(self) -> tuple[float, float]:
        """The torques of the motors, left and right."""
        left, right = self.data.actuator_force.tolist()
        return left, right

    def put(self, pose: Pose2D) -> None:
        """Set the robot down at a pose, at rest; its wheels keep their angles."""
        z, w = quaternion_from_yaw(pose.yaw)
        self.data.qpos[:7] = (pose.x, pose.y, 0.0, w, 0.0, 0.0, z)
        self.data.qvel[:] = 0.0
        self._ramped = (0.0, 0.0)
        mujoco.mj_forward(self.model, self.data)

    def command(self, v_mps: float, omega_radps: float) -> None:
        """Take a command, as from cmd_vel."""
        self._target, self._commanded_ns = (v_mps, omega_radps), self.now_ns

    def advance(self, until_ns: int, film_period_ns: int = 0) -> None:
        """Step until a time; with film_period_ns keep a frame for a film that often."""
        while self.now_ns < until_ns:
            if film_period_ns and self.now_ns % film_period_ns == 0:
                self._keep_frame()
            self._step()

    def _step(self) -> None:
        if self.now_ns - self._commanded_ns > COMMAND_TIMEOUT_NS:
            self._target = (0.0, 0.0)
        self._drive()
        pose, (speed, turn) = self.pose, self.velocity
        mujoco.mj_step(self.model, self.data)
        self._events.add(self.time_s, self._touching(), pose, speed, turn)
        self.now_ns += STEP_NS
        self._move_people()
        self._turned += float(self.data.qvel[5]) * TIMESTEP_S
        if self.now_ns % ODOMETRY_NS == 0:
            period_s = ODOMETRY_NS * NANO
            left, right = (float(self.data.qpos[k]) for k in self._wheels_at)
            self.odometry.update(left, right, self._turned / period_s, period_s)
            self._turned = 0.0
        if self._kidnappings and self.time_s >= self._kidnappings[0].at_s - 1e-9:
            self._kidnap(self._kidnappings.pop(0).to_m)

    def _drive(self) -> None:
        """Ramp the command, and give the wheels their speeds."""
        body = self.body
        limits = (body.max_accel_mps2 * TIMESTEP_S, body.max_turn_accel_radps2 * TIMESTEP_S)
        v, omega = (
            now + min(max(target - now, -limit), limit)
            for now, target, limit in zip(self._ramped, self._target, limits)
        )
        self._ramped = (v, omega)
        half = 0.5 * body.wheel_apart_m * omega
        self.data.ctrl[0] = (v - half) / body.wheel_radius_m
        self.data.ctrl[1] = (v + half) / body.wheel_radius_m

    def _touching(self) -> list[tuple[str, Point]]:
        """What the robot's body touches, and where."""
        data = self.data
        found = []
        for number in range(data.ncon):
            one, other = data.contact.geom[number].tolist()
            if self._shell in (one, other) and data.contact.dist[number] <= 0.0:
                x, y, _ = data.contact.pos[number].tolist()
                found.append((self._names[other if one == self._shell else one], (x, y)))
        return found

    def _move_people(self) -> None:
        centers = self.scenario.centers(self.time_s)[: self.room.people]
        if centers:
            self.data.mocap_pos[:, :2] = centers
            self.data.mocap_pos[:, 2] = PERSON_HALF_M

    def _kidnap(self, to_m: Point) -> None:
        """Lift the robot and put it elsewhere, its heading kept."""
        true, believed = self.pose, self.odometry.pose
        self.put(Pose2D(*to_m, true.yaw))
        if self._lifted is Lifted.JUMPS:
            self.odometry.put(Pose2D(*to_m, believed.yaw))

    def _keep_frame(self) -> None:
        self.frames.append(Frame(self.time_s, self.data.qpos.copy(), self.data.mocap_pos.copy()))

    def scan(self) -> Scan:
        """The lidar's scan now, in the lidar's frame, with noise; rounded as in a LaserScan."""
        ranges = self.true_ranges_m()
        ranges = np.maximum(ranges + RANGE_SD_M * self._rng.normal(size=ranges.size), 0.0)
        return Scan(
            ranges_m=limited(ranges, LIDAR),
            angle_min_rad=float(np.float32(LIDAR.first_beam_rad)),
            angle_increment_rad=float(np.float32(LIDAR.covered_rad / LIDAR.beams)),
            range_min_m=float(np.float32(LIDAR.range_min_m)),
            range_max_m=float(np.float32(LIDAR.range_max_m)),
        )

    def true_ranges_m(self) -> np.ndarray:
        """Range of each beam without noise, inf for a miss; the lidar tilts with the body."""
        c, s = rays(LIDAR.beams)
        turn = self.data.xmat[self._base].reshape(3, 3)
        origin = self.data.xpos[self._base] + turn @ (0.0, 0.0, LIDAR_Z_M)
        directions = np.stack([c, s, np.zeros_like(c)], axis=1) @ turn.T
        ranges, _ = self.cast(origin, directions)
        return ranges

    def render(
        self, origin: np.ndarray, directions: np.ndarray, normals: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """As cast(), for a camera outside the robot, which sees the robot too."""
        return self.cast(origin, directions, normals, excluded=-1)

    def show(self, frame: Frame) -> None:
        """Put robot and people as they were at the moment of a frame; for films only."""
        self.data.qpos[:] = frame.qpos
        self.data.mocap_pos[:] = frame.people
        mujoco.mj_forward(self.model, self.data)

    def cast(
        self,
        origin: np.ndarray,
        directions: np.ndarray,
        normals: np.ndarray | None = None,
        excluded: int | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Ranges (n,) of rays along unit vectors (n, 3), inf for a miss, and the geoms hit (n,).

        The robot's own body is not hit. normals (3 n,) is filled in if given.
        """
        count, body = len(directions), self._base if excluded is None else excluded
        geoms, ranges = np.full(count, -1, dtype=np.int32), np.zeros(count)
        mujoco.mj_multiRay(
            self.model, self.data, origin, np.ascontiguousarray(directions).reshape(-1),
            self._visible_groups, True, body, geoms, ranges, normals, count,
            mujoco.mjMAXVAL,
        )  # fmt: skip
        return np.where(ranges < 0.0, np.inf, ranges), geoms


def heading_error_rad(world: PhysicsWorld) -> float:
    """How far the odometry's heading is off."""
    return wrap_angle(world.odometry.pose.yaw - world.pose.yaw)
