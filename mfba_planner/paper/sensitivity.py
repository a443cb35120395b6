# SPDX-License-Identifier: Apache-2.0
"""Sensitivity study: path lengths for readings of section 6.2 that change one thing at a time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ..core.geometry import Point, bearing, distance, towards
from ..core.option_specs import Scalar, flatten, override
from ..evaluation import statistics
from ..evaluation.metrics import evaluate
from ..perception.sensory_vector import SensorParams
from ..planning.planner_params import PlannerParams
from ..simulation.episode import Episode
from ..simulation.obstacle_motion import Obstacle
from ..simulation.run_episode import run
from ..simulation.scenario import Scenario
from ..swarm.bat_swarm import Algorithm
from . import published, readings_of_paper
from .study.chunk import SampleChunk, Trips, chunks
from .study.run import Sample

CASES = tuple(published.TRIP_TABLES)
LAWS = ("MFBA", "BA")
STATISTICS = ("best", "mean", "worst")
SEEDS, QUICK_SEEDS, CHUNK = 200, 20, 20
RESAMPLES = 2000
GROUPS = (
    "preset", "robot speed", "step", "iterations", "all three", "SR measured", "sectors",
    "gap heading", "frequency",
)  # fmt: skip
ENCOUNTERS = {"case1": "only obstacle 1", "case2": "obstacles 1, then 2"}  # Fig. 7 and 8


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """A reading of section 6.2; group and label name its difference to `section6`.

    sectors_rad: angle from +x to the start of sector 1. enlarged False: the obstacles are not
    enlarged by the robot's radius; contacts are counted with the radius all the same.
    """

    group: str
    label: str
    planner: PlannerParams = field(default_factory=PlannerParams)
    sensor: SensorParams = field(default_factory=SensorParams)
    sectors_rad: float = 0.0
    enlarged: bool = True

    @property
    def name(self) -> str:
        """Unique name, usable as a file name."""
        text = f"{self.group} {self.label}"
        return "".join(c if c.isalnum() or c in ".-" else "_" for c in text)


def all_readings(quick: bool = False) -> list[Reading]:
    """`section6`, readings with one difference to it, other sets that fit, and `fig1`."""
    base = readings_of_paper.planner("section6")
    found = [Reading(group="preset", label="section6", planner=base)]
    for group, label, changes, in_quick in _changes():
        if in_quick or not quick:
            planner = override(base, changes)
            found.append(Reading(group=group, label=label, planner=planner))
    found += [reading for reading in _sensing() if reading.sectors_rad or not quick]
    for algorithm in Algorithm:
        fig1 = override(readings_of_paper.planner("fig1"), {"bat.algorithm": algorithm.value})
        label = f"fig1, {algorithm.value.upper()}"
        found.append(Reading(group="preset", label=label, planner=fig1))
    return sorted(found, key=lambda reading: GROUPS.index(reading.group))


def _changes() -> Iterator[tuple[str, str, dict[str, Scalar], bool]]:
    """Yield (group, label, options, whether the quick form includes it)."""
    for speed in (0.5, 0.6, 0.7, 0.75, 0.77, 0.78, 0.79, 0.8, 0.82, 0.85, 0.9, 1.0):
        in_quick = speed in (0.6, 0.7, 0.82, 0.9)
        yield "robot speed", f"{speed:g} m/s", {"speed_mps": speed}, in_quick
    for step in (0.05, 0.1, 0.2, 0.25, 0.35, 0.4, 0.5):
        yield "step", f"{step:g} m", {"step_length_m": step}, step in (0.2, 0.5)
    for iterations in (1, 2, 3, 4, 6, 10, 20):
        options: dict[str, Scalar] = {"bat.iterations": iterations}
        yield "iterations", f"{iterations} per step", options, iterations in (1, 4, 10)
    for step, speed in ((0.25, 0.81), (0.2, 0.83)):
        options = {"bat.iterations": 4, "step_length_m": step, "speed_mps": speed}
        yield "all three", f"4 per step, {step:g} m, {speed:g} m/s", options, speed == 0.83
    yield "gap heading", "middle of sector i", {"gap_heading": "middle"}, True
    yield "frequency", "raw t, as printed", {"bat.schedule": "raw"}, True
    yield "frequency", "random (BA)", {"bat.algorithm": "ba"}, True


def _sensing() -> Iterator[Reading]:
    sr, radius = SensorParams().sensing_range_m, 0.3  # of robot and obstacles in both cases
    for label, reach, enlarged in (
        ("to the obstacle's own edge", sr - radius, True),
        ("to the obstacle's centre", sr - 2.0 * radius, True),
        ("own edge, not enlarged", sr, False),
        ("centre, not enlarged", sr - radius, False),
    ):
        ring = SensorParams(sensing_range_m=reach)
        yield Reading(group="SR measured", label=label, sensor=ring, enlarged=enlarged)
    half = math.pi / SensorParams().sectors
    yield Reading(group="sectors", label="turned by half a sector", sectors_rad=half)


@dataclass(frozen=True, slots=True, kw_only=True)
class Variation(Trips):
    """Episodes of a reading in one scenario."""

    reading: Reading

    def facts(self) -> dict[str, Scalar]:
        """Everything that the numbers depend on, as plain values."""
        return {
            "scenario": repr(self.scenario),
            **flatten(self.planner),
            **flatten(self.reading.sensor),
            "sectors_rad": self.reading.sectors_rad,
            "enlarged": self.reading.enlarged,
        }

    def _row(self, seed: int) -> dict[str, float]:
        """Length, contacts, whether it reached the goal and met the obstacles of the figure."""
        perceived = turned(self.scenario, -self.reading.sectors_rad)
        if not self.reading.enlarged:
            perceived = replace(perceived, robot_radius_m=0.0)
        episode = run(perceived, planner=self.planner, sensor=self.reading.sensor, seed=seed)
        result = evaluate(episode)
        encounters = result.encounters
        if not self.reading.enlarged:
            result = evaluate(_with_radius(episode, self.scenario.robot_radius_m))
        case1 = self.scenario.name == "case1"
        as_figure = encounters == (1,) if case1 else encounters[:2] == (1, 2)
        return {
            "length_m": result.length_m,
            "collisions": result.collisions,
            "reached": int(result.outcome.value == "goal_reached"),
            "as_figure": int(as_figure),
        }


def _with_radius(episode: Episode, radius_m: float) -> Episode:
    return replace(episode, scenario=replace(episode.scenario, robot_radius_m=radius_m))


def turned(scenario: Scenario, angle_rad: float) -> Scenario:
    """The scenario turned about its start: for the robot the sectors turn by -angle_rad."""
    if angle_rad == 0.0:
        return scenario
    start = scenario.start_m

    def moved(point: Point) -> Point:
        return towards(start, bearing(start, point) + angle_rad, distance(start, point))

    def obstacle(o: Obstacle) -> Obstacle:
        return replace(o, center_m=moved(o.center_m), heading_rad=o.heading_rad + angle_rad)

    obstacles = tuple(obstacle(o) for o in scenario.obstacles)
    return replace(scenario, goal_m=moved(scenario.goal_m), obstacles=obstacles)


def plan(scenarios: Mapping[str, Scenario], quick: bool, first: int = 0) -> list[SampleChunk]:
    """The runs of the study from seed `first` on, as chunks; scenarios: those of CASES."""
    found = []
    seeds = QUICK_SEEDS if quick else SEEDS
    for reading in all_readings(quick):
        for case in CASES:
            work = Variation(scenario=scenarios[case], planner=reading.planner, reading=reading)
            found += chunks(f"{reading.name}/{case}", work, first, seeds, CHUNK)
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """Result of a reading in one case; intervals: of best, mean and worst length (m) of ten runs.

    contacts, reached, as_figure: shares of the runs; as_figure: with the encounters of the figure.
    """

    reading: Reading
    case: str
    intervals: tuple[statistics.Interval, ...]
    contacts: float
    reached: float
    as_figure: float

    def off_m(self, law: str) -> tuple[float, ...]:
        """Our median minus the printed length, for each of STATISTICS."""
        printed = printed_m(self.case, law)
        return tuple(ours.middle - theirs for ours, theirs in zip(self.intervals, printed))

    def holds(self, law: str) -> tuple[bool, ...]:
        """Whether the printed length lies within the interval, for each of STATISTICS."""
        printed = printed_m(self.case, law)
        return tuple(length in i for i, length in zip(self.intervals, printed))

    @property
    def reproduces(self) -> tuple[str, ...]:
        """The laws whose whole printed row lies within the intervals, if no run has a contact."""
        fit = self.contacts == 0.0 and self.reached == 1.0
        return tuple(law for law in LAWS if fit and all(self.holds(law)))

    @property
    def mostly_as_figure(self) -> bool:
        """Whether most runs meet the obstacles of the paper's figure."""
        return self.as_figure > 0.5


def printed_m(case: str, law: str) -> tuple[float, ...]:
    """Best, mean and worst length (m) of ten runs as Table 5 or 7 prints them (1 / fitness)."""
    fitness = published.values(published.TRIP_TABLES[case], law)
    return tuple(1.0 / fitness[name] for name in ("maximum", "mean", "minimum"))


def rows(samples: Mapping[str, Sample], quick: bool) -> list[Row]:
    """The results of the samples of plan(): a row per reading and case, in the same sequence."""
    return [
        _row(reading, case, samples[f"{reading.name}/{case}"])
        for reading in all_readings(quick)
        for case in CASES
    ]


def _row(reading: Reading, case: str, sample: Sample) -> Row:
    rng = statistics.generator(CASES.index(case))
    tens = statistics.resample(sample["length_m"], published.TRIP_RUNS, rng, RESAMPLES)
    intervals = (tens.min(1), tens.mean(1), tens.max(1))
    return Row(
        reading=reading,
        case=case,
        intervals=tuple(map(statistics.interval, intervals)),
        contacts=float(np.mean(sample["collisions"] > 0)),
        reached=float(np.mean(sample["reached"])),
        as_figure=float(np.mean(sample["as_figure"])),
    )
