# SPDX-License-Identifier: Apache-2.0
"""Time and memory of decisions among what stands, per part.

Run: python bench/local_map_planning.py [--seeds N] [--only TEXT] [--decisions N]. Processor time
of whole decisions, median and 99th percentile (ms), and the mean time of their parts:

tracker: tracks and the outline of what stands; map: the local map; field: distances to what
stands around the robot; to go: the distance to go; search: rollouts, risks and bats; rest: all
else. Places of 20 x 20 m by seed, seen by 360 beams: circles after BARN, and rooms of segments
with a door each. With --decisions the first place is driven again and again, so often, and the
resident memory is printed ten times: it must be flat.
"""

from __future__ import annotations

import argparse
import functools
import math
import resource
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from mfba_planner.core.geometry import distance
from mfba_planner.core.planner_types import Decision, Observation
from mfba_planner.core.robot_base import Drive
from mfba_planner.core.segments import Segment
from mfba_planner.perception.obstacle_tracker import Tracker
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.perception.static_map import StaticMap
from mfba_planner.planning.distance_to_go import DistanceToGo
from mfba_planner.planning.map_search import MapSearch
from mfba_planner.planning.planner_factory import make_planner
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.planning.supervised_planner import SupervisedPlanner
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.planner_observations import observe_scan
from mfba_planner.simulation.robot_model import Lidar, Robot
from mfba_planner.simulation.run_episode import run
from mfba_planner.simulation.scenario import Scenario

SIZE_M, ROOM_M, DOOR_M, RADIUS_M = 20.0, 4.0, 1.0, 0.22
START, GOAL = (-8.0, -8.0), (8.0, 8.0)
LONGEST_S = 60.0
PARTS = {
    "tracker": (Tracker, "update"),
    "map": (StaticMap, "update"),
    "field": (MapSearch, "clearance"),
    "to go": (DistanceToGo, "update"),
    "search": (MapSearch, "search"),
}


def circles(seed: int, reach_m: float, drive: Drive) -> Scenario:
    """300 circles of 0.15 m as in BARN, away from start and goal."""
    rng = np.random.default_rng(seed)
    found = list[Obstacle]()
    while len(found) < 300:
        x, y = rng.uniform(-0.5 * SIZE_M, 0.5 * SIZE_M, size=2).tolist()
        if min(distance((x, y), START), distance((x, y), GOAL)) > 1.0:
            found.append(Obstacle(center_m=(x, y), radius_m=0.15))
    return place(f"circles {seed}", reach_m, drive, obstacles=tuple(found))


def rooms(seed: int, reach_m: float, drive: Drive) -> Scenario:
    """Five by five rooms of 4 m; every wall between two has a door of 1 m."""
    rng = np.random.default_rng(seed)
    half, segments = 0.5 * SIZE_M, list[Segment]()
    for row in range(6):
        for column in range(5):
            at, low = row * ROOM_M - half, column * ROOM_M - half
            door = low + float(rng.uniform(0.3, ROOM_M - DOOR_M - 0.3))
            ends = [(low, low + ROOM_M)]
            if 0 < row < 5:
                ends = [(low, door), (door + DOOR_M, low + ROOM_M)]
            for a, b in ends:
                segments += [(a, at, b, at), (at, a, at, b)]
    return place(f"rooms {seed}", reach_m, drive, segments_m=tuple(segments))


def place(name: str, reach_m: float, drive: Drive, **what: Any) -> Scenario:
    """A task in it."""
    robot = Robot(lidar=Lidar(beams=360, range_max_m=reach_m), drive=drive)
    return Scenario(
        name=name, start_m=START, goal_m=GOAL, robot_radius_m=RADIUS_M, time_limit_s=LONGEST_S,
        robot=robot, **what,
    )  # fmt: skip


Make = Callable[[int, float, Drive], Scenario]
ROWS: dict[str, tuple[Make, float, Drive]] = {
    f"{kind}-{drive.value}-{reach_m:g}-m": (make, reach_m, drive)
    for drive in Drive
    for kind, make in (("circles", circles), ("rooms", rooms))
    for reach_m in (3.5, 10.0)
}


class Times:
    """Processor time of decisions, and of their parts."""

    def __init__(self) -> None:
        """Start empty."""
        self.decisions_s: list[float] = []
        self.parts_s: dict[str, float] = defaultdict(float)

    @contextmanager
    def measured(self) -> Iterator[None]:
        """Measure the parts meanwhile."""
        before = {name: getattr(owner, method) for name, (owner, method) in PARTS.items()}
        for name, (owner, method) in PARTS.items():
            setattr(owner, method, self._timed(name, before[name]))
        try:
            yield
        finally:
            for name, (owner, method) in PARTS.items():
                setattr(owner, method, before[name])

    def _timed(self, name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(call)
        def timed(*args: Any, **kwargs: Any) -> Any:
            start = time.process_time()
            try:
                return call(*args, **kwargs)
            finally:
                self.parts_s[name] += time.process_time() - start

        return timed

    def row(self, name: str) -> str:
        """One row of the table."""
        times = 1e3 * np.array(self.decisions_s)
        n = len(times)
        parts = [1e3 * self.parts_s[part] / n for part in PARTS]
        parts.append(float(times.mean()) - sum(parts))
        cells = [f"{np.quantile(times, share):.2f}" for share in (0.5, 0.99)]
        cells += [f"{part:.2f}" for part in parts]
        return f"| {name} | {n} | " + " | ".join(cells) + " |"


class TimedPlanner:
    """A planner whose decisions are measured."""

    def __init__(self, inner: SupervisedPlanner, times: Times, most: float = math.inf) -> None:
        """most: number of decisions."""
        self._inner, self._times, self.most = inner, times, most

    def plan(self, obs: Observation) -> Decision:
        """Decide."""
        start = time.process_time()
        decision = self._inner.plan(obs)
        self._times.decisions_s.append(time.process_time() - start)
        return decision

    def reset(self) -> None:
        """Begin anew."""
        self._inner.reset()


def drive(scenario: Scenario, times: Times, planner: TimedPlanner | None = None) -> TimedPlanner:
    """One run."""
    params = preset(PlannerParams(method=Method.PREDICTIVE, speed_mps=1.0))
    params, sensor = scenario.planner_params(params), SensorParams()
    planner = planner or TimedPlanner(make_planner(params, sensor, 0), times)
    run(
        scenario, planner=params, sensor=sensor, seed=0, path_planner=planner,
        observe=observe_scan, go_on=lambda _: len(times.decisions_s) < planner.most,
    )  # fmt: skip
    return planner


def resident_mb() -> float:
    """Resident memory now."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 1e6


def watch_memory(decisions: int) -> None:
    """Drive one place again and again with one planner."""
    scenario, times = circles(0, 3.5, Drive.OMNIDIRECTIONAL), Times()
    print(f"before: {resident_mb():.1f} MB")
    planner = None
    for part in range(1, 11):
        while len(times.decisions_s) < part * decisions / 10:
            planner = drive(scenario, times, planner)
            planner.reset()
        print(f"after {len(times.decisions_s)} decisions: {resident_mb():.1f} MB", flush=True)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--only", default="", help="rows whose name holds this")
    parser.add_argument("--decisions", type=int, default=0, help="watch the memory instead")
    found = parser.parse_args()
    if found.decisions:
        watch_memory(found.decisions)
        return
    columns = ["place", "decisions", "median, ms", "99 %, ms", *PARTS, "rest"]
    print("| " + " | ".join(columns) + " |\n" + "|---" * len(columns) + "|")
    for name, (make, reach_m, kind) in ROWS.items():
        if found.only not in name:
            continue
        times = Times()
        with times.measured():
            for seed in range(found.seeds):
                drive(make(seed, reach_m, kind), times)
        print(times.row(name), flush=True)


if __name__ == "__main__":
    main()
