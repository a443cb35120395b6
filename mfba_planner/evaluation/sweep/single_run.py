# SPDX-License-Identifier: Apache-2.0
"""Compute single runs of a sweep, one at a time or several together, to their Episodes."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import cast

from ...core.planner_types import NANO, Observation, PathPlanner
from ...optimizers.registry import BATS
from ...planning.algorithm_1 import Algorithm1, generate_paths_together
from ...planning.planner_params import Swarm
from ...planning.planner_registry import find_factory
from ...planning.predictive_planner import Predictive
from ...planning.supervised_planner import SupervisedPlanner
from ...simulation.episode import Episode, Outcome
from ...simulation.lidar_perception import LIDAR_PERCEPTIONS
from ...simulation.planner_observations import Observe, observe_sectors
from ...simulation.run_episode import always_continue, episode_generator, run_to_end
from ...simulation.scenario_map import with_known_map
from .planner_sandbox import HungError, PlannerFault, PlannerSandbox
from .sweep_spec import Run, Setting

TICKS_HELD = 100_000  # of all runs computed together, of some kB each


@dataclass(frozen=True, slots=True, kw_only=True)
class CompletedRun:
    """A completed run; fault is the planner's fault that ended it, "" for none."""

    episode: Episode
    fault: str
    times_ns: tuple[int, ...] = ()  # wall time of each decision

    @property
    def fault_at(self) -> str:
        """The fault with its tick."""
        return f"tick {len(self.episode.ticks)}: {self.fault}" if self.fault else ""


def run_one(run: Run, setting: Setting, *, whole: bool = True) -> CompletedRun:
    """Compute a run in this process, without a time limit for the planner.

    After a fault of the planner the Episode holds the decisions before it, maybe none.
    whole=False may leave out sectors that the planner does not read; the path is the same.
    """
    sandbox = PlannerSandbox(setting.params)
    completed = run_to_end(_decision_by_decision(run, setting, sandbox, whole))
    return replace(completed, times_ns=tuple(sandbox.times_ns))


def run_together(runs: Sequence[Run], setting: Setting) -> Iterator[CompletedRun]:
    """run_one() of runs for which generates_paths_together(): one swarm batch per tick for all.

    The same decisions, bit for bit. Single decisions are not timed: times_ns is empty.
    """
    limit_s = setting.scenario(runs[0]).time_limit_s
    at_once = max(1, int(TICKS_HELD * setting.params.tick_ns * NANO / limit_s))
    for first in range(0, len(runs), at_once):
        yield from _tick_by_tick(runs[first : first + at_once], setting)


def _tick_by_tick(runs: Sequence[Run], setting: Setting) -> list[CompletedRun]:
    sandboxes = [PlannerSandbox(setting.params) for _ in runs]
    running = {
        i: _decision_by_decision(run, setting, sandboxes[i], False) for i, run in enumerate(runs)
    }
    found: dict[int, CompletedRun] = {}
    while running:
        observations: dict[int, Observation] = {}
        for i, generator in running.items():
            try:
                observations[i] = next(generator)
            except StopIteration as end:
                found[i] = end.value
        running = {i: running[i] for i in observations}
        planners = [cast(Algorithm1, _inner(sandboxes[i].planner)) for i in observations]
        generate_paths_together(planners, list(observations.values()))
    return [found[i] for i in range(len(runs))]


def generates_paths_together(planner: str, setting: Setting) -> bool:
    """Whether it is Algorithm 1 with a fresh swarm per tick, which is faster in one batch."""
    params = setting.params
    if ":" in planner or params.swarm is not Swarm.FRESH or params.optimizer != BATS:
        return False
    return type(find_factory(planner)(setting.params, setting.sensor, 0)) is Algorithm1


def _decision_by_decision(
    run: Run, setting: Setting, sandbox: PlannerSandbox, whole: bool
) -> Generator[Observation, None, CompletedRun]:
    """A run as a generator: yields the observation before every decision."""
    scenario, fault = setting.scenario(run), ""
    setting = replace(setting, params=scenario.planner_params(setting.params))
    try:
        path_planner = sandbox.make_planner(
            lambda: with_known_map(_as_on_a_robot(run, setting), setting.params, scenario)
        )
        episode = yield from episode_generator(
            scenario,
            setting.params,
            setting.sensor,
            run.seed,
            always_continue,
            sandbox,
            _observer(_inner(path_planner), run, setting, whole),
        )
    except (PlannerFault, HungError) as error:
        fault = str(error)
        episode = Episode(
            scenario=scenario,
            sensor=setting.sensor,
            planner=setting.params,
            seed=run.seed,
            driver="core",
            ticks=tuple(sandbox.decisions),
            outcome=Outcome.INTERRUPTED,
        )
    if run.planner != "paper":
        episode = replace(episode, planner_name=run.planner)
    return CompletedRun(episode=episode, fault=fault)


def _as_on_a_robot(run: Run, setting: Setting) -> PathPlanner:
    """The planner; from a lidar one that can drive a robot is supervised, as in `mfba sim`."""
    path_planner = setting.make_planner(run)
    if setting.perception in LIDAR_PERCEPTIONS and isinstance(
        path_planner, (Algorithm1, Predictive)
    ):
        return SupervisedPlanner(path_planner)
    return path_planner


def _inner(path_planner: PathPlanner | None) -> PathPlanner | None:
    return path_planner.inner if isinstance(path_planner, SupervisedPlanner) else path_planner


def _observer(path_planner: object, run: Run, setting: Setting, whole: bool) -> Observe:
    # Algorithm 1 reads the sectors only, and they are the same without circles.
    if isinstance(path_planner, Algorithm1) and setting.perception == "known":
        return observe_sectors
    # A planner with reads_sectors = False is spared their cost.
    return setting.observer(
        run.seed, sectors=whole or getattr(path_planner, "reads_sectors", True)
    )
