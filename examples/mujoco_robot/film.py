# SPDX-License-Identifier: Apache-2.0
"""A film of a drive without OpenGL: the engine casts a ray per pixel, beside a view from above."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from crowded_room import BODY_RADIUS_M, ROBOT_RADIUS_M, SIDE_M
from engine import mujoco
from physics_world import Frame, PhysicsWorld
from PIL import Image, ImageDraw

from mfba_planner.core.geometry import Point

WIDTH_PX, HEIGHT_PX = 320, 240
FRAME_MS = 100
_VIEW_RAD = math.radians(65.0)  # horizontal angle of view
_BEHIND_M, _ABOVE_M, _DOWN_RAD = 2.2, 1.9, math.radians(28.0)  # the camera behind the robot
_LIGHT = np.array([0.35, -0.25, 0.9]) / np.linalg.norm([0.35, -0.25, 0.9])
_SKY = np.array([0.75, 0.85, 0.95])
_SUFFIXES = (".gif", ".webp")


def save_frames(path: Path, frames: Sequence[Frame]) -> None:
    """Write frames to a .npz file."""
    np.savez_compressed(
        path,
        time_s=np.array([frame.time_s for frame in frames]),
        qpos=np.array([frame.qpos for frame in frames]),
        people=np.array([frame.people for frame in frames]),
    )


def load_frames(path: Path) -> list[Frame]:
    """Read frames from a .npz file."""
    with np.load(path) as found:
        rows = zip(found["time_s"].tolist(), found["qpos"], found["people"])
        return [Frame(time_s, qpos, people) for time_s, qpos, people in rows]


class Camera:
    """Looks from behind and above the robot along a heading that follows the robot's slowly."""

    def __init__(self, world: PhysicsWorld) -> None:
        """Prepare the rays of all pixels."""
        self._world = world
        tan = math.tan(0.5 * _VIEW_RAD)
        u = np.linspace(-tan, tan, WIDTH_PX)
        v = np.linspace(tan, -tan, HEIGHT_PX) * HEIGHT_PX / WIDTH_PX
        across, up = np.meshgrid(u, v)
        rays = np.stack([np.ones_like(across), -across, up], axis=-1).reshape(-1, 3)
        rays /= np.linalg.norm(rays, axis=1)[:, None]
        c, s = math.cos(_DOWN_RAD), math.sin(_DOWN_RAD)
        self._rays = rays @ np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
        self._yaw: float | None = None
        model = world.model
        self._colours = np.vstack([model.geom_rgba[:, :3], _SKY])
        self._floor = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, "floor"))

    def picture(self) -> np.ndarray:
        """The picture of the present moment, (HEIGHT_PX, WIDTH_PX, 3) bytes."""
        pose = self._world.pose
        turn = 0.0 if self._yaw is None else math.remainder(pose.yaw - self._yaw, math.tau)
        self._yaw = pose.yaw if self._yaw is None else self._yaw + 0.15 * turn
        c, s = math.cos(self._yaw), math.sin(self._yaw)
        rays = self._rays @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        behind = _BEHIND_M
        origin = np.array([pose.x - behind * c, pose.y - behind * s, _ABOVE_M])
        origin[:2] = np.clip(origin[:2], 0.15, SIDE_M - 0.15)
        flat = np.zeros(3 * len(rays))
        ranges, geoms = self._world.render(origin, rays, flat)
        hit = geoms >= 0
        colours = self._colours[geoms]
        points = origin + np.where(hit, ranges, 0.0)[:, None] * rays
        floor = geoms == self._floor
        tiles = (np.floor(points[:, 0]) + np.floor(points[:, 1])) % 2 < 0.5
        colours = np.where((floor & tiles)[:, None], 0.88 * colours, colours)
        normals = flat.reshape(-1, 3)
        facing = np.where((normals * rays).sum(axis=1) > 0.0, -1.0, 1.0)
        light = 0.55 + 0.45 * np.maximum((normals @ _LIGHT) * facing, 0.0)
        haze = np.where(hit, np.exp(-0.02 * np.where(hit, ranges, 0.0)), 1.0)[:, None]
        shaded = np.where(hit[:, None], colours * light[:, None], colours)
        mixed = haze * shaded + (1.0 - haze) * _SKY
        picture: np.ndarray = (255.0 * np.clip(mixed, 0.0, 1.0)).astype(np.uint8)
        return picture.reshape(HEIGHT_PX, WIDTH_PX, 3)


class TopView:
    """The room from above: people, what stands, the path so far, the goal and the scan."""

    def __init__(self, world: PhysicsWorld) -> None:
        """Draw what does not change."""
        self._world = world
        self._scale = HEIGHT_PX * 2 / (SIDE_M + 0.4)
        self._path: list[Point] = []
        size = HEIGHT_PX * 2
        self._ground = Image.new("RGB", (size, size), (244, 244, 240))
        draw = ImageDraw.Draw(self._ground)
        for x0, y0, x1, y1 in world.scenario.segments_m:
            draw.line([self._px((x0, y0)), self._px((x1, y1))], fill=(70, 70, 80), width=3)
        for pillar in world.scenario.obstacles[world.room.people :]:
            self._disc(draw, pillar.center_m, pillar.radius_m, (140, 107, 77))
        self._ring(draw, world.scenario.goal_m, 0.3, (20, 140, 60))

    def _px(self, point: Point) -> Point:
        half = 0.2
        return (point[0] + half) * self._scale, (SIDE_M + half - point[1]) * self._scale

    def _box(self, point: Point, radius_m: float) -> tuple[float, float, float, float]:
        (x, y), r = self._px(point), radius_m * self._scale
        return x - r, y - r, x + r, y + r

    def _disc(self, draw: Any, point: Point, radius_m: float, colour: tuple[int, ...]) -> None:
        draw.ellipse(self._box(point, radius_m), fill=colour)

    def _ring(self, draw: Any, point: Point, radius_m: float, colour: tuple[int, ...]) -> None:
        draw.ellipse(self._box(point, radius_m), outline=colour, width=3)

    def picture(self, time_s: float, contacts: int) -> np.ndarray:
        """The view at a moment, bytes of the camera's picture's height."""
        world = self._world
        image = self._ground.copy()
        draw = ImageDraw.Draw(image)
        pose = world.pose
        self._path.append(pose.position)
        ranges = world.true_ranges_m()
        angles = pose.yaw + (np.arange(len(ranges)) + 0.5) * 2.0 * math.pi / len(ranges)
        for r, a in zip(ranges.tolist(), angles.tolist()):
            if r < 8.0:
                x, y = self._px((pose.x + r * math.cos(a), pose.y + r * math.sin(a)))
                draw.point([(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)], fill=(220, 60, 40))
        for number in range(world.room.people):
            x, y, _ = world.data.mocap_pos[number].tolist()
            colour = tuple((255 * world.model.geom(f"person{number}").rgba[:3]).astype(int))
            self._disc(draw, (x, y), BODY_RADIUS_M, colour)
        if len(self._path) > 1:
            draw.line([self._px(point) for point in self._path], fill=(40, 90, 200), width=3)
        self._disc(draw, pose.position, BODY_RADIUS_M, (38, 51, 71))
        self._ring(draw, pose.position, ROBOT_RADIUS_M, (120, 130, 150))
        ahead = (pose.x + 0.25 * math.cos(pose.yaw), pose.y + 0.25 * math.sin(pose.yaw))
        draw.line([self._px(pose.position), self._px(ahead)], fill=(255, 150, 40), width=3)
        small = image.resize((HEIGHT_PX, HEIGHT_PX), Image.Resampling.LANCZOS)
        text = f"{time_s:.1f} s, contacts: {contacts}"
        ImageDraw.Draw(small).text((8, 6), text, fill=(0, 0, 0))
        return np.asarray(small)


def write_film(
    path: Path, world: PhysicsWorld, frames: Sequence[Frame], contact_times_s: Sequence[float]
) -> None:
    """Render frames of a drive in this world to a GIF or WebP."""
    camera, above = Camera(world), TopView(world)
    images = []
    for frame in frames:
        world.show(frame)
        count = sum(at <= frame.time_s for at in contact_times_s)
        images.append(
            Image.fromarray(np.hstack([camera.picture(), above.picture(frame.time_s, count)]))
        )
    first, *others = images
    options = {"lossless": False, "quality": 75} if path.suffix == ".webp" else {"optimize": False}
    first.save(path, save_all=True, append_images=others, duration=FRAME_MS, loop=0, **options)
