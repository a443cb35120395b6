# SPDX-License-Identifier: Apache-2.0
"""Specification of a sweep: worlds, planners, seeds, perception; and its list of runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from typing import Any, NamedTuple

from ...core.errors import ConfigError, MfbaError
from ...core.named_import import import_named
from ...core.option_specs import Scalar, did_you_mean, flatten, require_range
from ...core.planner_types import PathPlanner
from ...perception.sensory_vector import SensorParams
from ...planning.planner_params import PlannerParams
from ...planning.planner_registry import Factory, find_factory, preset_of
from ...simulation.lidar_perception import (
    LIDAR_PERCEPTIONS,
    OWN_ROBOT,
    LidarPerception,
    with_lidar,
)
from ...simulation.planner_observations import INPUTS, Observe, Perception
from ...simulation.scenario import Scenario
from ...swarm.optimizer import raised
from ..suites import Suite, suite
from ..suites.named_suites import SPEED_MPS
from ..suites.scenario_suite import ScenarioSet
from .planner_sandbox import fault_of_planner

PATIENCE_S, LONGEST_S = 60.0, 86_400.0
MOST_RUNS = 2**31 - 1  # worlds, seeds
DEFAULT_PERCEPTION = "lidar"
# What a planner can be given instead of its input, as listed in reports and in --help.
PERCEIVED = dict.fromkeys(LIDAR_PERCEPTIONS, "scan") | INPUTS
PERCEPTIONS = tuple(PERCEIVED)
_CALLED_WITH = "PlannerParams, SensorParams and a seed"
_GIVE = f"give MODULE:NAME of something that is called with {_CALLED_WITH}, and makes a planner"


class Run(NamedTuple):
    """One run of a sweep."""

    suite: str
    world: int
    planner: str
    seed: int

    def __str__(self) -> str:
        return f"{self.suite}/{self.world}/{self.planner}/{self.seed}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """All that determines a run, except its Run.

    perception: a robot of simulation.lidar_perception, or a name of
    simulation.planner_observations.Perception. patience_s is the wall time after which a run
    counts as hung; nothing else in a run depends on a clock. scenarios are the worlds of the
    user's own suite; None: those of a built-in one. robot holds changed options of the robot of a
    lidar's perception: names as in --set, and values.
    """

    params: PlannerParams = field(default_factory=lambda: PlannerParams(speed_mps=SPEED_MPS))
    sensor: SensorParams = field(default_factory=SensorParams)
    perception: str = DEFAULT_PERCEPTION
    noise_m: float = 0.0
    latency_ticks: int = 0
    suite_seed: int = 0
    patience_s: float = PATIENCE_S
    scenarios: ScenarioSet | None = None
    robot: tuple[tuple[str, Scalar], ...] = ()

    def __post_init__(self) -> None:
        """Raise ConfigError for an invalid value."""
        if self.perception not in PERCEIVED:
            known = did_you_mean(self.perception, list(PERCEPTIONS))
            raise ConfigError(f"perception {self.perception!r}: unknown; {known}")
        if self.robot and self.perception not in LIDAR_PERCEPTIONS:
            raise ConfigError(
                f"--set robot.{self.robot[0][0]}: --perception {self.perception} has no "
                f"robot; give one of {', '.join(LIDAR_PERCEPTIONS)}"
            )
        # Also of lidars: the same limits of noise and latency.
        Perception("sectors", noise_m=self.noise_m, latency_ticks=self.latency_ticks)
        require_range("--patience", self.patience_s, 0, LONGEST_S, "s", above=True)

    def suite(self, name: str) -> Suite:
        """The suite of the runs. Raises ConfigError for an unknown name."""
        if self.scenarios is None or name != self.scenarios.name:
            return suite(name, self.suite_seed)
        return self.scenarios.suite()

    def scenario(self, run: Run) -> Scenario:
        """The world of a run, with the robot of the perception."""
        world = self.suite(run.suite).world(run.world, self.params.speed_mps)
        if self.perception not in LIDAR_PERCEPTIONS:
            return world
        return with_lidar(world, self.perception, self.noise_m, dict(self.robot))

    def observer(self, seed: int, *, sectors: bool = True) -> Observe:
        """The perception of a run with this seed; a lidar's always computes the sectors."""
        if self.perception in LIDAR_PERCEPTIONS:
            return LidarPerception(self.perception, self.latency_ticks)
        return Perception(
            self.perception,
            noise_m=self.noise_m,
            latency_ticks=self.latency_ticks,
            seed=seed,
            sectors=sectors,
        )

    def make_planner(self, run: Run) -> PathPlanner:
        """A fresh planner; see make_planner."""
        return make_planner(run.planner, self.params, self.sensor, run.seed)

    def facts(self) -> dict[str, Any]:
        """All values as plain data; of scenarios their digest."""
        plain = {item.name: getattr(self, item.name) for item in fields(self)}
        plain["robot"] = dict(self.robot)
        plain |= {"params": flatten(self.params), "sensor": flatten(self.sensor)}
        scenarios = plain.pop("scenarios")
        return plain if scenarios is None else {**plain, "scenarios": scenarios.digest()}


def default_setting(suite_name: str, scenarios: ScenarioSet | None = None) -> Setting:
    """The setting of a suite without any option: its robot's speed. Raises ConfigError.

    In the user's own scenarios it is the robot of `mfba sim`.
    """
    if scenarios is None:
        return Setting(params=PlannerParams(speed_mps=suite(suite_name).speed_mps))
    params = PlannerParams(speed_mps=scenarios.suite().speed_mps)
    return Setting(params=params, perception=OWN_ROBOT, scenarios=scenarios)


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepSpec:
    """Each planner in worlds first .. first + worlds - 1 of a suite, with seeds 0 .. seeds - 1.

    Where a suite repeats its worlds, each round has the next seed, and seeds is 1. own holds, by
    name, the parameters of planners that differ from the setting's.
    """

    suite: str
    planners: tuple[str, ...]
    worlds: int
    first: int = 0
    seeds: int = 1
    oracle: bool = True
    setting: Setting = field(default_factory=Setting)
    own: Mapping[str, PlannerParams] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Raise ConfigError for an invalid value, with the nearest name for an unknown one."""
        for name, value, least in (
            ("--worlds", self.worlds, 1),
            ("--first", self.first, 0),
            ("--seeds", self.seeds, 1),
        ):
            require_range(name, value, least, MOST_RUNS)
        found = self.setting.suite(self.suite)
        if found.count is not None and self.first + self.worlds > found.count:
            raise ConfigError(
                f"--first={self.first} --worlds={self.worlds}: {self.suite} has {found.count} "
                "worlds, counted from 0; give fewer, or leave both out"
            )
        if self.setting.scenarios is not None and self.setting.suite_seed:
            raise ConfigError(
                f"--suite-seed={self.setting.suite_seed}: scenario files are not drawn from a "
                "seed; leave it out"
            )
        if found.distinct is not None and self.seeds > 1:
            raise ConfigError(
                f"--seeds={self.seeds}: {self.suite} has {found.distinct} worlds, which --worlds "
                "repeats with the next seed each time; leave out --seeds"
            )
        if self.setting.robot:  # what a robot of one of the worlds refuses is said at the door
            for world in self.world_range if self.setting.scenarios else [self.first]:
                self.setting.scenario(Run(self.suite, world, "", 0))
        if not self.planners:
            raise ConfigError("--planner: none given; name at least one")
        for k, name in enumerate(self.planners):
            setting = self.setting_of(name)
            _check_inputs(name, _inputs_of(name, setting), setting.perception)
            if name in self.planners[:k]:
                raise ConfigError(f"--planner {name}: given twice; name each planner once")

    def setting_of(self, planner: str) -> Setting:
        """The setting of the runs of one planner."""
        own = self.own.get(planner)
        return self.setting if own is None else replace(self.setting, params=own)

    @property
    def world_range(self) -> range:
        """Numbers of the worlds."""
        return range(self.first, self.first + self.worlds)

    def run_seeds(self, world: int) -> range:
        """Seeds of a world's runs."""
        distinct = self.setting.suite(self.suite).distinct
        first = 0 if distinct is None else world // distinct
        return range(first, first + self.seeds)

    def runs(self, planner: str, worlds: range) -> list[Run]:
        """Runs of one planner in some worlds, sorted as in the table."""
        return [
            Run(self.suite, world, planner, seed)
            for world in worlds
            for seed in self.run_seeds(world)
        ]


def _inputs_of(name: str, setting: Setting) -> Sequence[str]:
    """What a planner reads, () for what it does not say. Raises ConfigError for none."""
    with _as_config_error(name):
        planner = make_planner(name, setting.params, setting.sensor, seed=0)
        if fault := fault_of_planner(planner):
            raise ConfigError(f"planner {name}: {fault}; {_GIVE}")
        return [str(name) for name in getattr(planner, "inputs", ())]


@contextmanager
def _as_config_error(name: str) -> Iterator[None]:
    """Turn what the code of MODULE:NAME raises into a ConfigError; a bug of ours stays one."""
    try:
        yield
    except MfbaError:
        raise
    except Exception as error:
        if ":" not in name:
            raise
        raise ConfigError(f"planner {name}: {raised('the factory', error)}; {_GIVE}") from error


def _check_inputs(planner: str, inputs: Sequence[str], perception: str) -> None:
    """Raise ConfigError for a planner that could not observe any obstacle."""
    if not inputs or "sectors" in inputs or PERCEIVED[perception] in inputs:
        return
    usable = [name for name, given in PERCEIVED.items() if given in inputs]
    raise ConfigError(
        f"--perception {perception}: planner {planner} uses none of it; "
        f"give --perception {' or '.join(usable)}"
    )


def make_planner(name: str, params: PlannerParams, sensor: SensorParams, seed: int) -> PathPlanner:
    """A new planner: a registered name, or MODULE:NAME with the same signature.

    Raises ConfigError for an unknown one.
    """
    return _factory(name)(params, sensor, seed)


def own_preset(name: str, params: PlannerParams) -> PlannerParams:
    """The preset parameters of a planner, else the given ones. Raises as make_planner()."""
    factory = _factory(name)
    with _as_config_error(name):
        found = preset_of(factory, params)
        if not isinstance(found, PlannerParams):
            raise TypeError(f"preset gave {type(found).__name__}, not PlannerParams")
        return found


def _factory(name: str) -> Factory:
    """The factory of a planner: a registered name, or MODULE:NAME."""
    if ":" not in name:
        return find_factory(name)
    factory: Factory = import_named("planner", name, name, _CALLED_WITH)
    return factory


def read_run(text: str) -> Run:
    """A run from SUITE/WORLD/PLANNER/SEED. Raises ConfigError."""
    words = text.split("/")
    if len(words) != 4 or not (words[1].isdecimal() and words[3].isdecimal()):
        raise ConfigError(f"{text}: no run; give SUITE/WORLD/PLANNER/SEED, or a row's number")
    return Run(words[0], int(words[1]), words[2], int(words[3]))
