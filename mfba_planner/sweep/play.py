# SPDX-License-Identifier: Apache-2.0
"""One run of a sweep, from its name to its Episode."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..core.episode import Episode, Look, Outcome, look
from ..core.episode import run as drive
from ..core.planner import Planner
from .guard import Guard, HungError, PlannerFault
from .order import Run, Setting


@dataclass(frozen=True, slots=True, kw_only=True)
class Played:
    """A run that was made; fault says why the planner's run ended before its time."""

    episode: Episode
    fault: str
    times_ns: tuple[int, ...]  # what each decision took

    @property
    def fault_at(self) -> str:
        """The fault, and when."""
        return f"tick {len(self.episode.ticks)}: {self.fault}" if self.fault else ""


def play(run: Run, setting: Setting, *, whole: bool = True) -> Played:
    """Make a run in this process, however long a planner takes over it.

    After a fault of the planner the Episode holds what was decided before, which may be nothing.
    whole=False: the record may lack sectors that the planner does not read; its way is the same.
    """
    scenario, fault = setting.scenario(run), ""
    guard = Guard(setting.params)
    try:
        brain = guard.take(lambda: setting.brain(run))
        episode = drive(
            scenario,
            planner=setting.params,
            sensor=setting.sensor,
            seed=run.seed,
            brain=guard,
            look=_look(brain, run, setting, whole),
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
        episode = replace(episode, brain=run.planner)
    return Played(episode=episode, fault=fault, times_ns=tuple(guard.times_ns))


def _look(brain: object, run: Run, setting: Setting, whole: bool) -> Look:
    # The paper's planner reads bits alone, and they are the same without circles beside them.
    if isinstance(brain, Planner) and setting.perception == "known":
        return look
    # A planner that never reads the sectors may say so, and is spared what they cost.
    return setting.look(run.seed, sectors=whole or getattr(brain, "reads_sectors", True))
