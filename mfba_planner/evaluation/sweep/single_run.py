# SPDX-License-Identifier: Apache-2.0
"""One run of a sweep, from its name to its Episode."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import cast

from ...core.types import NANO, Observation
from ...planning.algorithm_1 import Algorithm1, generate_paths_together
from ...planning.planner_params import Swarm
from ...planning.planner_registry import known
from ...simulation.episode import Episode, Outcome
from ...simulation.planner_observations import Observe, observe_sectors
from ...simulation.run_episode import always_continue, episode_generator, run_to_end
from .planner_sandbox import HungError, PlannerFault, PlannerSandbox
from .sweep_spec import Run, Setting

TICKS_HELD = 100_000  # of all runs under way at once, of some kB each


@dataclass(frozen=True, slots=True, kw_only=True)
class PlayedRun:
    """A run that was made; fault says why the planner's run ended before its time."""

    episode: Episode
    fault: str
    times_ns: tuple[int, ...] = ()  # what each decision took

    @property
    def fault_at(self) -> str:
        """The fault, and when."""
        return f"tick {len(self.episode.ticks)}: {self.fault}" if self.fault else ""


def run_one(run: Run, setting: Setting, *, whole: bool = True) -> PlayedRun:
    """Make a run in this process, however long a planner takes over it.

    After a fault of the planner the Episode holds what was decided before, which may be nothing.
    whole=False: the record may lack sectors that the planner does not read; its way is the same.
    """
    guard = PlannerSandbox(setting.params)
    played = run_to_end(_playing(run, setting, guard, whole))
    return replace(played, times_ns=tuple(guard.times_ns))


def run_together(runs: Sequence[Run], setting: Setting) -> Iterator[PlayedRun]:
    """play() of runs that flies_together() says yes to: tick by tick, all their bats at once.

    The same decisions to the last bit. What one of them takes cannot be told: times_ns is empty.
    """
    limit_s = setting.scenario(runs[0]).time_limit_s
    at_once = max(1, int(TICKS_HELD * setting.params.tick_ns * NANO / limit_s))
    for begin in range(0, len(runs), at_once):
        yield from _tick_by_tick(runs[begin : begin + at_once], setting)


def _tick_by_tick(runs: Sequence[Run], setting: Setting) -> list[PlayedRun]:
    guards = [PlannerSandbox(setting.params) for _ in runs]
    left = {i: _playing(run, setting, guards[i], False) for i, run in enumerate(runs)}
    found: dict[int, PlayedRun] = {}
    while left:
        seen: dict[int, Observation] = {}
        for i, under_way in left.items():
            try:
                seen[i] = next(under_way)
            except StopIteration as end:
                found[i] = end.value
        left = {i: left[i] for i in seen}
        planners = [cast(Algorithm1, guards[i].planner) for i in seen]
        generate_paths_together(planners, list(seen.values()))
    return [found[i] for i in range(len(runs))]


def generates_paths_together(planner: str, setting: Setting) -> bool:
    """Whether it is Algorithm 1 with fresh bats, which are quicker flown at once."""
    if ":" in planner or setting.params.swarm is not Swarm.FRESH:
        return False
    return type(known(planner)(setting.params, setting.sensor, 0)) is Algorithm1


def _playing(
    run: Run, setting: Setting, guard: PlannerSandbox, whole: bool
) -> Generator[Observation, None, PlayedRun]:
    """A run under way; it pauses before every decision."""
    scenario, fault = setting.scenario(run), ""
    try:
        path_planner = guard.take(lambda: setting.make_planner(run))
        episode = yield from episode_generator(
            scenario,
            setting.params,
            setting.sensor,
            run.seed,
            always_continue,
            guard,
            _look(path_planner, run, setting, whole),
        )
    except (PlannerFault, HungError) as error:
        fault = str(error)
        episode = Episode(
            scenario=scenario,
            sensor=setting.sensor,
            planner=setting.params,
            seed=run.seed,
            driver="core",
            ticks=tuple(guard.decisions),
            outcome=Outcome.INTERRUPTED,
        )
    if run.planner != "paper":
        episode = replace(episode, planner_name=run.planner)
    return PlayedRun(episode=episode, fault=fault)


def _look(path_planner: object, run: Run, setting: Setting, whole: bool) -> Observe:
    # The paper's planner reads bits alone, and they are the same without circles beside them.
    if isinstance(path_planner, Algorithm1) and setting.perception == "known":
        return observe_sectors
    # A planner that never reads the sectors may say so, and is spared what they cost.
    return setting.observer(
        run.seed, sectors=whole or getattr(path_planner, "reads_sectors", True)
    )
