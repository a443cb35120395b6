# SPDX-License-Identifier: Apache-2.0
"""The named suites; world k of a suite depends only on the suite, its seed and k."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...core.errors import ConfigError
from ...core.option_specs import did_you_mean
from ...simulation.scenario import Scenario
from .adversarial_worlds import FAMILIES, adversarial_obstacles
from .barn_worlds import barn_scenario
from .dynabarn_worlds import DIFFICULTIES, dynabarn_obstacles
from .random_crowds import CrowdParams, Motion, crowd
from .room_worlds import FAMILIES as ROOM_FAMILIES
from .room_worlds import room_scenario
from .social_forces import PedestrianParams, pedestrian_obstacles
from .task_geometry import ROOM, Trip, scenario
from .walled_crowd import HallParams, hall_scenario

WORLD_STREAM = 3  # spawn key of worlds' SeedSequence children; one number per purpose
SPEED_MPS = 0.8  # of the robot, unless the suite has another
FAST_MPS = 1.0  # of the robot in suites with obstacles as fast as it and faster

_Make = Callable[["Suite", int, float], Scenario]


@dataclass(frozen=True, slots=True, kw_only=True)
class Suite:
    """Worlds 0, 1, 2, ... of one kind; number is the suite's own index in the seeds.

    speed_mps is the robot's, at which results and gaps to the optimum are reported. in_the_open:
    moving obstacles in an empty hall, not a place with walls or a field of posts.
    """

    name: str
    description: str
    number: int
    make: _Make
    distinct: int | None = None  # number of different worlds; None: all differ
    count: int | None = None  # number of worlds; None: no end
    speed_mps: float = SPEED_MPS
    in_the_open: bool = True
    seed: int = 0

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle by name, as `make` cannot be pickled."""
        return suite, (self.name, self.seed)

    def world(self, k: int, speed_mps: float | None = None) -> Scenario:
        """World k for a robot of this speed (only adversarial worlds depend on it).

        None is the suite's own speed. Raises ConfigError for a k that is negative or
        past the end, or a speed that is not above 0.
        """
        if k < 0:
            raise ConfigError(f"k={k}: negative; worlds are counted from 0")
        if self.count is not None and k >= self.count:
            raise ConfigError(
                f"world {k}: {self.name} has {self.count} worlds; give 0 to {self.count - 1}"
            )
        speed_mps = self.speed_mps if speed_mps is None else speed_mps
        if not (math.isfinite(speed_mps) and speed_mps > 0.0):
            raise ConfigError(f"speed_mps={speed_mps}: no speed; give a number above 0")
        return self.make(self, self.world_number(k), speed_mps)

    def world_number(self, k: int) -> int:
        """The smallest number with the same world as k; repeats differ in the planner's seed."""
        return k if self.distinct is None else k % self.distinct

    def stream(self, k: int) -> np.random.Generator:
        """The random stream of world k, from the seed, the suite's number and k alone."""
        key = (WORLD_STREAM, self.number, k)
        sequence = np.random.SeedSequence(self.seed, spawn_key=key)
        return np.random.Generator(np.random.PCG64(sequence))


def suite(name: str, seed: int = 0) -> Suite:
    """The suite of this name. Raises ConfigError, with the nearest name, for an unknown one."""
    if name not in _SUITES:
        raise ConfigError(f"{name!r}: no such suite; {did_you_mean(name, list(_SUITES))}")
    if seed < 0:
        raise ConfigError(f"seed={seed}: negative; give a whole number from 0 up")
    return replace(_SUITES[name], seed=seed)


def suite_names() -> list[str]:
    """Names of all suites, as listed in reports."""
    return list(_SUITES)


_CASES = ("case1", "case2")


def _paper(_: Suite, k: int, __: float) -> Scenario:
    from ...scenarios.scenario_files import load_scenario

    return load_scenario(_CASES[k])


def _crowd(params: CrowdParams) -> _Make:
    walls = ROOM if params.walled else None

    def make(source: Suite, k: int, _: float) -> Scenario:
        return scenario(f"{source.name}-{k}", crowd(params, source.stream(k)), walls)

    return make


def _adversarial(source: Suite, k: int, speed_mps: float) -> Scenario:
    family = list(FAMILIES)[k % len(FAMILIES)]
    obstacles = adversarial_obstacles(family, Trip(speed_mps=speed_mps), source.stream(k))
    return scenario(f"{source.name}-{k}-{family}", obstacles)


def _dynabarn(source: Suite, k: int, _: float) -> Scenario:
    name = list(DIFFICULTIES)[k % len(DIFFICULTIES)]
    return scenario(f"{source.name}-{k}-{name}", dynabarn_obstacles(name, source.stream(k)))


def _pedestrians(source: Suite, k: int, _: float) -> Scenario:
    obstacles = pedestrian_obstacles(PedestrianParams(), source.stream(k))
    return scenario(f"{source.name}-{k}", obstacles)


def _rooms(source: Suite, k: int, _: float) -> Scenario:
    family = list(ROOM_FAMILIES)[k % len(ROOM_FAMILIES)]
    return room_scenario(f"{source.name}-{k}-{family}", family, source.stream(k))


def _barn_like(source: Suite, k: int, _: float) -> Scenario:
    return barn_scenario(f"{source.name}-{k}", k, source.stream(k))


def _hall(source: Suite, k: int, _: float) -> Scenario:
    return hall_scenario(f"{source.name}-{k}", HallParams(), source.stream(k))


_DENSE = CrowdParams(
    obstacles=60, radius_min_m=0.1, radius_max_m=0.3, speed_min_mps=0.05, static_share=0.3
)
_TURNING = CrowdParams(
    obstacles=15,
    radius_min_m=0.2,
    radius_max_m=0.4,
    speed_min_mps=0.0,
    speed_max_mps=0.5,
    motion=Motion.PIECEWISE,
    turn_every_s=2.0,
    turn_max_rad=math.radians(60.0),
)


def _fast(obstacles: int) -> CrowdParams:
    return CrowdParams(obstacles=obstacles, speed_min_mps=0.5, speed_max_mps=2.0, margin_m=1.0)


# Never change a suite's number: it would change its worlds.
_ALL = (
    Suite(
        name="paper",
        description="case studies 1 and 2 in turn; repeats differ in the planner's seed",
        number=0,
        make=_paper,
        distinct=len(_CASES),
    ),
    *(
        Suite(
            name=f"random-{n}",
            description=f"{n} obstacles of 0.3 m at 0.1 to 0.3 m/s that bounce in 12 x 12 m",
            number=n,
            make=_crowd(CrowdParams(obstacles=n)),
        )
        for n in (3, 10, 20, 30)
    ),
    Suite(
        name="dense",
        description="60 obstacles of 0.1 to 0.3 m, three in ten at rest, others up to 0.3 m/s",
        number=101,
        make=_crowd(_DENSE),
    ),
    Suite(
        name="adversarial",
        description="cycling through " + ", ".join(FAMILIES),
        number=102,
        make=_adversarial,
    ),
    Suite(
        name="turning",
        description="15 obstacles of 0.2 to 0.4 m that change speed (up to 0.5 m/s) and heading",
        number=103,
        make=_crowd(_TURNING),
    ),
    *(
        Suite(
            name=f"fast-{n}",
            description=f"{n} obstacles of 0.3 m at 0.5 to 2 m/s that bounce in 12 x 12 m; robot "
            "1 m/s",
            number=110 + n,
            make=_crowd(_fast(n)),
            speed_mps=FAST_MPS,
        )
        for n in (10, 20)
    ),
    Suite(
        name="dynabarn-like",
        description="5 to 24 discs of 0.5 m at 0.74, 1.23 or 1.72 m/s on average (easy, medium, "
        "hard in turn) on curves; robot 1 m/s",
        number=104,
        make=_dynabarn,
        speed_mps=FAST_MPS,
    ),
    Suite(
        name="pedestrians",
        description="24 people of 0.25 m at 1.3 m/s on average in crossing streams, by social "
        "forces; robot 1 m/s",
        number=105,
        make=_pedestrians,
        speed_mps=FAST_MPS,
    ),
    Suite(
        name="rooms",
        description="walls, cycling through " + ", ".join(ROOM_FAMILIES),
        number=106,
        make=_rooms,
        in_the_open=False,
    ),
    Suite(
        name="barn-like",
        description="200 to 500 cylinders of 0.075 m by cellular automata; robot of 0.22 m, 1 m/s",
        number=107,
        make=_barn_like,
        in_the_open=False,
        speed_mps=FAST_MPS,
    ),
    Suite(
        name="crowd",
        description="14 people of 0.25 m, by social forces at 1.3 m/s on average, in a hall with "
        "two doors and pillars; robot 1 m/s",
        number=108,
        make=_hall,
        in_the_open=False,
        speed_mps=FAST_MPS,
    ),
)
_SUITES = {entry.name: entry for entry in _ALL}
