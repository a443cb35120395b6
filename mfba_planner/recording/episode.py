# SPDX-License-Identifier: Apache-2.0
"""From a bag back to an Episode: what the planner saw and decided, tick by tick, without ROS."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from mfba_planner.core.digest import Digest
from mfba_planner.core.episode import Episode, Outcome, World
from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.metrics import Result, Tally
from mfba_planner.core.options import flatten, override
from mfba_planner.core.planner import Decision, PlannerParams
from mfba_planner.core.sensing import SensorParams
from mfba_planner.core.world import Scenario
from mfba_planner.scenarios import load_scenario

from ..core.errors import BagError, ConfigError, InputError
from ..messages import robot_pose, stamp_ns
from .configuration import read_configuration
from .decisions import of_a_fleet, rising_decisions, stream_decisions
from .reader import BagReader

T = TypeVar("T")

TRUTH = "/ground_truth"

# Options younger than the oldest bags: what they default to is what was done then.
LATER = ("method", "jump_m", "scan_radius_m", "caution.", "recovery.")


def read_episode(path: str | Path, *, salvage: bool = False) -> Episode:
    """The Episode a bag of ours holds; `salvage` also reads one that was never closed.

    Raises BagError for a bag without configuration or without decisions, and where a
    decision's inputs are missing.
    """
    with BagReader(path, salvage=salvage) as reader:
        setup = read_setup(reader)
        ticks: dict[int, Decision] = {}
        for found, _ in stream_decisions(reader):
            ticks.setdefault(found.stamp_ns, found)
        truth = read_truth(reader)
    decisions = tuple(ticks[stamp] for stamp in sorted(ticks))
    return setup.episode(decisions, truth)


def summarize(path: str | Path, *, salvage: bool = False) -> tuple[Episode, Result, str]:
    """Of a bag of any length: an Episode with its last tick only, the Result, the digest.

    Streams; raises as read_episode does, and where the stamp of a decision goes back.
    """
    with BagReader(path, salvage=salvage) as reader:
        setup, truth = read_setup(reader), read_truth(reader)
        stream = (found for found, _ in rising_decisions(reader))
        first = next(stream)  # or it raises
        tally, hashed = Tally(setup.episode((first,))), Digest()
        for tick in chain([first], stream):
            tally.add(tick, truth.get(tick.stamp_ns))
            hashed.add(tick)
    episode = setup.episode((tick,), truth)
    return episode, tally.result(episode.outcome), hashed.hexdigest()


class Setup(NamedTuple):
    """What a bag's configuration says about the run."""

    scenario: Scenario
    sensor: SensorParams
    planner: PlannerParams
    seed: int
    driver: str
    lockstep: bool
    odom_frame: str = ""  # that its inputs must be in; "": any

    def episode(self, ticks: tuple[Decision, ...], truth: Mapping[int, Pose2D] = {}) -> Episode:
        """The Episode of these decisions, at least one; truth is where the robot was, by stamp."""
        true = tuple(truth.get(tick.stamp_ns, tick.pose) for tick in ticks) if truth else ()
        last = true[-1] if true else ticks[-1].pose
        return Episode(
            scenario=self.scenario,
            sensor=self.sensor,
            planner=self.planner,
            seed=self.seed,
            driver=self.driver,
            ticks=ticks,
            outcome=_outcome(self.scenario, self.planner, ticks[-1].stamp_ns, last),
            truth=true,
        )


def read_setup(reader: BagReader, *, fleet: bool = False, robot: str = "") -> Setup:
    """The configuration a bag carries, checked; of a fleet's bag, that of a robot (the first).

    Raises BagError, also where several robots were recorded and not asked for.
    """
    configuration = read_configuration(reader)
    nodes = configuration.get("nodes", {})
    try:
        world = nodes["world_sim"]
        scenario = load_scenario(world["scenario_json"])
        if scenario.robots and not fleet:
            raise of_a_fleet(reader)
        above = f"{robot or scenario.robots[0].name}/" if scenario.robots else ""
        planner, sensor = (nodes[above + name] for name in ("planner", "virtual_sensor"))
        return Setup(
            scenario=scenario,
            sensor=_only(SensorParams(), sensor),
            planner=_only(PlannerParams(), planner),
            seed=planner["seed"],
            driver=configuration["run"].get("driver", "by hand"),
            lockstep=bool(planner["lockstep"]),
            odom_frame=planner.get("odom_frame", ""),
        )
    except (ConfigError, InputError) as error:
        raise BagError(f"{reader.path}: {error}") from None
    except KeyError as error:
        raise BagError(
            f"{reader.path}: its configuration lacks {error}; record with `mfba run`"
        ) from None


def _only(defaults: T, values: dict[str, Any]) -> T:
    """The options of one dataclass out of all parameters of a node."""
    told = [name for name in flatten(defaults) if name in values or not name.startswith(LATER)]
    return override(defaults, {name: values[name] for name in told})


def read_truth(reader: BagReader, namespace: str = "") -> dict[int, Pose2D]:
    """Where the robot really was, by stamp, in a bag that says so."""
    topic = namespace + TRUTH
    if topic not in reader.topics:
        return {}
    said = (message.message for message in reader.decoded([topic]))
    try:
        return {stamp_ns(odom.header.stamp): robot_pose(odom) for odom in said}
    except InputError as error:
        raise BagError(f"{reader.path}: {topic}: {error}") from None


def _outcome(scenario: Scenario, params: PlannerParams, last_ns: int, last: Pose2D) -> Outcome:
    """How the run ended, judged as the simulated world judges it."""
    world = World(scenario, params.tick_ns, params.goal_tolerance_m)
    world.tick, world.pose = last_ns // params.tick_ns - 1, last
    return world.outcome() or Outcome.INTERRUPTED
