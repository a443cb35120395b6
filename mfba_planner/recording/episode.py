# SPDX-License-Identifier: Apache-2.0
"""From a bag back to an Episode: what the planner saw and decided, tick by tick, without ROS."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from mfba_planner.core.episode import Episode, Outcome, World
from mfba_planner.core.options import flatten, override
from mfba_planner.core.planner import Decision, PlannerParams
from mfba_planner.core.sensing import Ranges, SensorParams
from mfba_planner.core.world import Scenario
from mfba_planner.messages import decision, sector_ranges, stamp_ns
from mfba_planner.scenarios import load_scenario

from ..core.errors import BagError, ConfigError, InputError
from .configuration import read_configuration
from .reader import BagReader

T = TypeVar("T")

SECTORS, DECISION = "/sectors", "/planner/decision"


def read_episode(path: str | Path, *, salvage: bool = False) -> Episode:
    """The Episode a bag of ours holds; `salvage` also reads one that was never closed.

    Raises BagError for a bag without configuration or without decisions, and where a
    decision's inputs are missing.
    """
    with BagReader(path, salvage=salvage) as reader:
        try:
            return _read(reader)
        except (ConfigError, InputError) as error:
            raise BagError(f"{path}: {error}") from None


def _read(reader: BagReader) -> Episode:
    setup = read_setup(reader)
    return setup.episode(_decisions(reader))


class Setup(NamedTuple):
    """What a bag's configuration says about the run."""

    scenario: Scenario
    sensor: SensorParams
    planner: PlannerParams
    seed: int
    driver: str
    lockstep: bool

    def episode(self, ticks: tuple[Decision, ...]) -> Episode:
        """The Episode of these decisions, at least one."""
        return Episode(
            scenario=self.scenario,
            sensor=self.sensor,
            planner=self.planner,
            seed=self.seed,
            driver=self.driver,
            ticks=ticks,
            outcome=_outcome(self.scenario, self.planner, ticks),
        )


def read_setup(reader: BagReader) -> Setup:
    """The configuration a bag carries, checked. Raises BagError."""
    configuration = read_configuration(reader)
    nodes = configuration.get("nodes", {})
    try:
        world, planner, sensor = (
            nodes[name] for name in ("world_sim", "planner", "virtual_sensor")
        )
        return Setup(
            scenario=load_scenario(world["scenario_json"]),
            sensor=_only(SensorParams(), sensor),
            planner=_only(PlannerParams(), planner),
            seed=planner["seed"],
            driver=configuration["run"].get("driver", "by hand"),
            lockstep=bool(planner["lockstep"]),
        )
    except KeyError as error:
        raise BagError(
            f"{reader.path}: its configuration lacks {error}; record with `mfba run`"
        ) from None


def _only(defaults: T, values: dict[str, Any]) -> T:
    """The options of one dataclass out of all parameters of a node."""
    return override(defaults, {name: values[name] for name in flatten(defaults)})


def _decisions(reader: BagReader) -> tuple[Decision, ...]:
    """Join each decision with the sectors of its stamp, in order of stamps."""
    ranges: dict[int, Ranges] = {}
    decisions: dict[int, Any] = {}
    for topic in (SECTORS, DECISION):
        if topic not in reader.topics or not reader.topics[topic].message_count:
            raise BagError(f"{reader.path}: holds no {topic}; give a bag `mfba run` recorded")
    for message in reader.decoded([SECTORS, DECISION]):
        stamp = stamp_ns(message.message.header.stamp)
        if message.topic == SECTORS:
            ranges[stamp] = _seen(message.message)
        else:
            # A later one on a stamp only says that its inputs have become stale.
            decisions.setdefault(stamp, message.message)
    try:
        return tuple(decision(decisions[stamp], ranges[stamp]) for stamp in sorted(decisions))
    except KeyError as error:
        raise BagError(
            f"{reader.path}: no sectors at stamp {error} ns; was the bag edited?"
        ) from None


def _seen(sectors: Any) -> Ranges:
    """What the planner made of a sectors message: nothing, where it refused it."""
    try:
        return sector_ranges(sectors)
    except InputError:
        return ()


def _outcome(scenario: Scenario, params: PlannerParams, ticks: tuple[Decision, ...]) -> Outcome:
    """How the run ended, judged as the simulated world judges it."""
    world = World(scenario, params.tick_ns, params.goal_tolerance_m)
    world.tick, world.pose = ticks[-1].stamp_ns // params.tick_ns - 1, ticks[-1].pose
    return world.outcome() or Outcome.INTERRUPTED
