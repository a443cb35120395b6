# SPDX-License-Identifier: Apache-2.0
"""Drives in many rooms: how often the robot arrives and what it touches, beside our simulator.

Run: python examples/mujoco_robot/many_worlds.py [--worlds N] [--first K] [--only ROW] [--graph N]
A row is a robot: MuJoCo's, also kidnapped in two forms, and that of
mfba_planner.simulation among the same people. The planner runs in this process, on the inputs
that its node would get; --graph N repeats every Nth world of the first row with the real nodes
and compares the decisions.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import tempfile
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from contact_events import ContactEvent, side_of
from crowded_room import PEOPLE, Walk, draw_room
from physics_world import Lifted, PhysicsWorld
from planner_in_process import DriveResult, drive, planner_params, robot_rng

from mfba_planner.core.child_process import end_with_parent
from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import bearing, distance, wrap_angle
from mfba_planner.core.planner_types import NANO
from mfba_planner.core.robot_base import Drive
from mfba_planner.entry_points import run_and_return_exit_code
from mfba_planner.evaluation.metrics import steps_driven, tick_clearances
from mfba_planner.evaluation.statistics import rate
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_factory import make_planner
from mfba_planner.recording.read_episode import read_episode
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.episode import Episode, Outcome
from mfba_planner.simulation.lidar_perception import OWN_ROBOT, LidarPerception
from mfba_planner.simulation.run_episode import run

Row = dict[str, Any]
TURNED_S = 1.5
SIDES = ("driving", "standing", "behind")


def by_geometry(episode: Episode) -> tuple[ContactEvent, ...]:
    """Contacts by the circles of robot and obstacles, swept between ticks; each begin once."""
    found, touching = [], set[int]()
    people_and_pillars = len(episode.scenario.obstacles)
    for gaps, (a, b) in zip(tick_clearances(episode), steps_driven(episode)):
        now = {number for number, gap in enumerate(gaps) if gap < 0.0}
        tick_s = max(1, b.stamp_ns - a.stamp_ns) * NANO
        forwards = abs(wrap_angle(bearing(a.pose.position, b.pose.position) - a.pose.yaw)) < 1.57
        speed = distance(a.pose.position, b.pose.position) / tick_s * (1.0 if forwards else -1.0)
        turn = wrap_angle(b.pose.yaw - a.pose.yaw) / tick_s
        time_s = episode.time_s(a.stamp_ns)
        centers = episode.scenario.centers(time_s)
        for number in sorted(now - touching):
            is_wall = number == people_and_pillars
            point = b.pose.position if is_wall else centers[number]
            side = "driving" if is_wall else side_of(a.pose, speed, turn, point)
            what = "wall" if is_wall else f"obstacle{number}"
            found.append(ContactEvent(time_s=time_s, touched=what, side=side, speed_mps=speed))
        touching = now
    return tuple(found)


def physics(number: int, lifted: Lifted | None = None, walk: Walk = Walk.WAYPOINTS) -> Row:
    """The robot of the physics engine in a world."""
    room = draw_room(number, walk=walk, kidnapped=lifted is not None)
    world = PhysicsWorld(room, robot_rng(number), lifted=lifted or Lifted.JUMPS)
    found: DriveResult = drive(world, seed=number)
    row = _row(number, found.episode, found.contacts)
    row |= {"arrived": found.arrived, "off_goal_m": found.off_goal_m}
    return row | {
        "odometry_off_m": found.odometry_off_m,
        "by_geometry": len(by_geometry(found.episode)),
    }


def ours(number: int, latency_ticks: int, drive_type: Drive = Drive.DIFFERENTIAL) -> Row:
    """The robot of our simulator in the same world; scans are that many ticks old."""
    room = draw_room(number)
    robot = replace(room.scenario.robot, drive=drive_type)
    room = room._replace(scenario=replace(room.scenario, robot=robot))
    params, sensor = planner_params(room), SensorParams()
    episode = run(
        room.scenario,
        planner=params,
        sensor=sensor,
        seed=number,
        path_planner=make_planner(params, sensor, number),
        observe=LidarPerception(OWN_ROBOT, latency_ticks),
    )
    return _row(number, episode, by_geometry(episode))


def _row(number: int, episode: Episode, contacts: Iterable[ContactEvent]) -> Row:
    last = (episode.truth or (episode.ticks[-1].pose,))[-1]
    return {
        "world": number,
        "arrived": episode.outcome is Outcome.GOAL_REACHED,
        "time_s": episode.time_s(episode.ticks[-1].stamp_ns),
        "off_goal_m": distance(last.position, episode.scenario.goal_m),
        "clearance_m": min(map(min, tick_clearances(episode))),
        "contacts": [asdict(event) for event in contacts],
        "ticks": len(episode.ticks),
        "digest": digest(episode.ticks),
    }


FIRST = "MuJoCo"
ROWS: dict[str, Callable[[int], Row]] = {
    FIRST: physics,
    "MuJoCo, people straight ahead": partial(physics, walk=Walk.STRAIGHT),
    "ours, no latency": partial(ours, latency_ticks=0),
    "ours, scans 0.1 s old": partial(ours, latency_ticks=1),
    "ours, omnidirectional": partial(ours, latency_ticks=0, drive_type=Drive.OMNIDIRECTIONAL),
    "kidnapped, noticed": partial(physics, lifted=Lifted.JUMPS),
    "kidnapped, unnoticed": partial(physics, lifted=Lifted.UNNOTICED),
}


def compute(job: tuple[str, int]) -> tuple[str, Row]:
    """One drive; a worker process calls it."""
    name, number = job
    return name, ROWS[name](number)


def table(found: dict[str, list[Row]]) -> str:
    """The rows as Markdown; intervals are Wilson's, 95 %."""
    lines = [
        "| robot | arrived | no contact | contacts: driving, standing, behind | of these people |"
        " time, s | off the goal, m: median, most |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, rows in found.items():
        events = [event for row in rows for event in row["contacts"]]
        sides = ", ".join(str(sum(e["side"] == side for e in events)) for side in SIDES)
        people = sum(e["touched"].startswith(("person", "obstacle")) for e in events)
        clean = sum(not row["contacts"] for row in rows)
        arrived = [row for row in rows if row["arrived"]]
        times = statistics.median([row["time_s"] for row in arrived] or [0.0])
        off = [row["off_goal_m"] for row in arrived] or [0.0]
        lines.append(
            f"| {name} | {_share(len(arrived), len(rows))} | {_share(clean, len(rows))} | {sides} "
            f"| {people} | {times:.1f} | {statistics.median(off):.2f}, {max(off):.2f} |"
        )
    return "\n".join(lines)


def _share(count: int, n: int) -> str:
    found = rate(count, n)
    return f"{count} of {n} [{100 * found.low:.1f}, {100 * found.high:.1f}] %"


def after_turns(rows: list[Row]) -> str:
    """How often the first contact of a drive is with a person who has just changed direction."""
    touched = turned = moments = just_turned = 0
    for row in rows:
        people = draw_room(row["world"]).scenario.obstacles[:PEOPLE]
        ends = [[knot[0] for knot in person.trajectory[1:]] for person in people]

        def has_turned(person: int, at_s: float, ends: list[list[float]] = ends) -> bool:
            return any(0.0 <= at_s - end_s <= TURNED_S for end_s in ends[person])

        for event in [e for e in row["contacts"] if e["touched"].startswith("person")][:1]:
            touched += 1
            turned += has_turned(int(event["touched"][len("person") :]), event["time_s"])
        for second in range(int(row["time_s"])):
            moments += len(people)
            just_turned += sum(has_turned(person, second) for person in range(len(people)))
    return (
        f"{FIRST}: {turned} of {touched} first contacts with a person who had turned within "
        f"{TURNED_S} s; of all people at any time {100 * just_turned / max(1, moments):.0f} %"
    )


def by_graph(row: Row) -> bool:
    """Whether the real nodes decide in this world as the planner in this process did."""
    from run import RunOptions, run_graph

    with tempfile.TemporaryDirectory() as directory:
        run_graph(RunOptions(world=row["world"]), Path(directory) / "run")
        ticks = read_episode(Path(directory) / "run/bag").ticks
    # The nodes may decide once more while they are being stopped.
    return digest(ticks[: row["ticks"]]) == row["digest"]


def main() -> int:
    """Compute the rows and print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--worlds", type=int, default=100)
    parser.add_argument("--first", type=int, default=0, help="number of the first world")
    parser.add_argument("--only", action="append", choices=list(ROWS), help="a row of the table")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument(
        "--graph", type=int, default=0, metavar="N", help="every Nth world through the graph too"
    )
    parser.add_argument("--out", type=Path, help="JSON lines, one per drive")
    given = parser.parse_args()
    if given.worlds < 1 or given.first < 0 or given.workers < 1 or given.graph < 0:
        raise ConfigError(
            f"--worlds {given.worlds} --first {given.first} --workers {given.workers} --graph "
            f"{given.graph}: give at least one world and one worker, and else numbers from 0 up"
        )
    names = given.only or list(ROWS)
    jobs = [(n, k) for n in names for k in range(given.first, given.first + given.worlds)]
    found: dict[str, list[Row]] = {name: [] for name in names}
    context = get_context("spawn")
    with ProcessPoolExecutor(
        given.workers, context, initializer=end_with_parent, initargs=(os.getpid(),)
    ) as pool:
        for name, row in pool.map(compute, jobs):
            found[name].append(row)
            if given.out:
                with given.out.open("a", encoding="utf-8") as lines:
                    lines.write(json.dumps({"row": name, **row}) + "\n")
    print(table(found))
    if FIRST in found:
        print(after_turns(found[FIRST]))
    if given.graph:
        again = found[FIRST][:: given.graph] if FIRST in found else []
        equal = sum(map(by_graph, again))
        print(f"graph: {equal} of {len(again)} digests equal")
    return 0


if __name__ == "__main__":
    sys.exit(run_and_return_exit_code(main, "many_worlds.py"))
