# SPDX-License-Identifier: Apache-2.0
"""The MuJoCo model: a room, people as mocap bodies, and a robot with two wheels and a castor.

Contacts: wheels and castor touch the floor only, the body touches people, walls and pillars.
People and all that stands do not touch each other.
"""

from __future__ import annotations

import colorsys
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass

from crowded_room import BODY_RADIUS_M, BORDER, SIDE_M, WALL_M, Room

TIMESTEP_S = 0.004
BODY_Z_M, BODY_HALF_M = 0.15, 0.1  # middle and half of the height of the robot's body
LIDAR_Z_M = 0.32
PERSON_HALF_M, WALL_HALF_M = 0.85, 0.6
PADDING = "-150 -20"  # of people: 1/s^2 and 1/s, the acceleration per depth and per speed
HIDDEN_GROUP = 3  # geoms that lidar and camera do not see
_FLOOR, _BODY = "1", "2"  # bits of contype and conaffinity


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotBody:
    """Masses, lengths and limits of the robot.

    The motors are velocity servos: a torque in proportion to the error of the wheel's speed, up to
    max_torque_nm. The driver board lets v and omega of the command rise within max_accel_mps2 and
    max_turn_accel_radps2, the limits that the planner is given too.
    """

    mass_kg: float = 12.0
    wheel_radius_m: float = 0.08
    wheel_apart_m: float = 0.36
    wheel_friction: float = 0.8
    servo_nms: float = 2.0
    max_torque_nm: float = 1.8
    max_wheel_radps: float = 18.0
    max_accel_mps2: float = 2.5
    max_turn_accel_radps2: float = 3.2


def model_xml(room: Room, body: RobotBody) -> str:
    """The model of a room with the robot at the origin, heading along x."""
    root = ElementTree.Element("mujoco", model=room.scenario.name)
    ElementTree.SubElement(root, "compiler", angle="radian", inertiafromgeom="true")
    option = ElementTree.SubElement(
        root, "option", timestep=str(TIMESTEP_S), integrator="implicitfast", cone="elliptic"
    )
    option.set("impratio", "10")
    world = ElementTree.SubElement(root, "worldbody")
    _geom(
        world, "floor", "plane", "0 0 0.1", rgba="0.62 0.62 0.6 1", contype=_FLOOR,
        conaffinity=_FLOOR, pos=f"{SIDE_M / 2} {SIDE_M / 2} 0", friction="1 0.005 0.0001",
    )  # fmt: skip
    _add_walls(world, room)
    for number, obstacle in enumerate(room.scenario.obstacles):
        x, y = obstacle.center_m
        if number < room.people:
            _add_person(world, number)
        else:
            _geom(
                world, f"pillar{number - room.people}", "cylinder",
                f"{obstacle.radius_m} {WALL_HALF_M}", pos=f"{x} {y} {WALL_HALF_M}",
                rgba="0.55 0.42 0.3 1", contype=_BODY, conaffinity=_BODY,
            )  # fmt: skip
    _add_robot(world, body)
    actuators = ElementTree.SubElement(root, "actuator")
    torque, speed = body.max_torque_nm, body.max_wheel_radps
    for side in ("left", "right"):
        ElementTree.SubElement(
            actuators, "velocity", name=side, joint=side, kv=str(body.servo_nms),
            ctrllimited="true", ctrlrange=f"{-speed} {speed}",
            forcelimited="true", forcerange=f"{-torque} {torque}",
        )  # fmt: skip
    return ElementTree.tostring(root, encoding="unicode")


def _geom(
    parent: ElementTree.Element, name: str, kind: str, size: str, **more: str
) -> ElementTree.Element:
    attributes = {"name": name, "type": kind, "size": size} | more
    return ElementTree.SubElement(parent, "geom", attributes)


def _add_walls(world: ElementTree.Element, room: Room) -> None:
    """The room's border, whose inner faces are the segments, and the walls inside."""
    thick = 0.5 * WALL_M
    grey = "0.8 0.8 0.83 1"
    for number, (x0, y0, x1, y1) in enumerate(BORDER):
        mx, my = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
        if y0 == y1:
            half, my = f"{SIDE_M / 2 + WALL_M} {thick}", my + (thick if my > 0.0 else -thick)
        else:
            half, mx = f"{thick} {SIDE_M / 2 + WALL_M}", mx + (thick if mx > 0.0 else -thick)
        _geom(
            world, f"border{number}", "box", f"{half} {WALL_HALF_M}", rgba=grey,
            pos=f"{mx} {my} {WALL_HALF_M}", contype=_BODY, conaffinity=_BODY,
        )  # fmt: skip
    for number, box in enumerate(room.boxes):
        _geom(
            world, f"wall{number}", "box", f"{box.half_x} {box.half_y} {WALL_HALF_M}", rgba=grey,
            pos=f"{box.x} {box.y} {WALL_HALF_M}", contype=_BODY, conaffinity=_BODY,
        )  # fmt: skip


def _add_person(world: ElementTree.Element, number: int) -> None:
    """A cylinder that a mocap body carries, and a head for the film.

    It goes on below the floor, so that no contact pushes the robot downwards. It is padded: who
    pushes the robot against a wall does not crush it, as the engine's stiff contact would.
    """
    person = ElementTree.SubElement(
        world, "body", name=f"person{number}", mocap="true", pos=f"0 0 {PERSON_HALF_M}"
    )
    red, green, blue = colorsys.hsv_to_rgb(number * 0.618 % 1.0, 0.55, 0.85)
    rgba = f"{red:.3f} {green:.3f} {blue:.3f} 1"
    _geom(
        person, f"person{number}", "cylinder", f"{BODY_RADIUS_M} {2 * PERSON_HALF_M - 0.2}",
        pos=f"0 0 {-PERSON_HALF_M}", rgba=rgba, contype=_BODY, conaffinity=_BODY,
        priority="1", friction="0.3", solref=PADDING,
    )  # fmt: skip
    _geom(
        person, f"head{number}", "sphere", "0.13", pos="0 0 0.75", rgba="0.9 0.75 0.65 1",
        contype="0", conaffinity="0",
    )  # fmt: skip


def _add_robot(world: ElementTree.Element, body: RobotBody) -> None:
    """base_link lies on the floor between the wheels; the weight rests partly on the castor."""
    robot = ElementTree.SubElement(world, "body", name="robot", pos="0 0 0")
    ElementTree.SubElement(robot, "freejoint", name="robot")
    wheel_kg = 0.05 * body.mass_kg
    # The shell has the shape that touches; the ballast below it, further back, has the weight.
    _geom(
        robot, "body", "cylinder", f"{BODY_RADIUS_M} {BODY_HALF_M}", pos=f"0 0 {BODY_Z_M}",
        mass=str(0.2 * body.mass_kg), rgba="0.15 0.2 0.28 1", contype=_BODY, conaffinity=_BODY,
        friction="0.3",
    )  # fmt: skip
    _geom(
        robot, "ballast", "cylinder", "0.12 0.03", pos="-0.06 0 0.08", group=str(HIDDEN_GROUP),
        mass=str(0.65 * body.mass_kg), contype="0", conaffinity="0",
    )  # fmt: skip
    _geom(
        robot, "lidar", "cylinder", "0.05 0.03", pos=f"0 0 {LIDAR_Z_M - 0.03}",
        mass=str(0.05 * body.mass_kg), rgba="0.9 0.35 0.1 1", contype="0", conaffinity="0",
    )  # fmt: skip
    _geom(
        robot, "castor", "sphere", "0.03", pos="-0.18 0 0.03", mass="0.1", condim="1",
        contype="0", conaffinity=_FLOOR, group=str(HIDDEN_GROUP), priority="1",
    )  # fmt: skip
    radius, half = body.wheel_radius_m, 0.5 * body.wheel_apart_m
    for side, y in (("left", half), ("right", -half)):
        wheel = ElementTree.SubElement(robot, "body", name=side, pos=f"0 {y} {radius}")
        ElementTree.SubElement(
            wheel, "joint", name=side, type="hinge", axis="0 1 0", damping="0.01", armature="0.01"
        )
        _geom(
            wheel, f"{side}_wheel", "cylinder", f"{radius} 0.015", euler="1.5707963 0 0",
            mass=str(wheel_kg), rgba="0.05 0.05 0.05 1", contype="0", conaffinity=_FLOOR,
            friction=f"{body.wheel_friction} 0.005 0.0001", priority="1", condim="4",
        )  # fmt: skip
