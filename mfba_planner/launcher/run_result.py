# SPDX-License-Identifier: Apache-2.0
"""The result of one robot's run: printed table, result.json, picture, success or error."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from ..core.errors import MfbaError
from ..core.geometry import distance
from ..evaluation.metrics import Result, evaluate
from ..simulation.episode import Episode, Outcome
from .run_state import Run


@dataclass(frozen=True, slots=True)
class RunResult:
    """A finished run, with or without success."""

    directory: Path
    episode: Episode
    result: Result

    def require_success(self) -> None:
        """Raise MfbaError, with the reason, unless the goal was reached without collision."""
        if not self.result.success:
            raise MfbaError(f"{self.directory}: {why_no_success(self.episode, self.result)}")


def why_no_success(episode: Episode, result: Result) -> str:
    """The reasons why a run has no success, as text."""
    faults = []
    if result.collisions:
        faults.append(f"{result.collisions} collisions")
    if result.outcome is not Outcome.GOAL_REACHED:
        left = distance(episode.ticks[-1].pose.position, episode.scenario.goal_m)
        faults.append(
            f"{left:.2f} m left to the goal after {result.time_s:.2f} s "
            f"(time limit {episode.scenario.time_limit_s:g} s)"
        )
    return f"no success: {', '.join(faults)}; see the picture, or try another --seed"


def finish_run(run: Run, episode: Episode | None, failure: str = "") -> RunResult:
    """Print the table, write result.json and run.png; the episode comes from the bag if None.

    Raises BagError where the bag holds no decision or was not closed, and OutputError, in the end,
    for a file that cannot be written.
    """
    from ..report.result_json import result_to_dict, write_result

    directory = run.directory
    left_out = ""
    if episode is None:
        from ..recording.decisions_without_inputs import print_omissions
        from ..recording.fleet_topics import NO_NAMESPACE
        from ..recording.read_episode import read_recording

        recording = read_recording(directory.bag)
        print_omissions(directory.bag, recording.omitted)
        episode, left_out = (
            recording.episodes[NO_NAMESPACE],
            recording.omitted.get(NO_NAMESPACE, ""),
        )
    result = evaluate(episode)
    speed = result.ticks / run.wall_s if run.wall_s else None
    extra = {"wall_s": run.wall_s, "ticks_per_s": speed, "failure": failure or None}
    extra |= {"left_out": left_out} if left_out else {}
    writers = [partial(write_result, directory.result, result_to_dict(episode, extra))]
    if run.request.picture:
        from ..report.run_figure import draw_run

        writers.append(partial(draw_run, episode, directory.picture))
    directory.complete(writers, partial(show, episode, result, speed))
    return RunResult(directory.path, episode, result)


def show(episode: Episode, result: Result, ticks_per_s: float | None = None) -> None:
    """Print the table: with colours on a terminal, otherwise as plain text."""
    from ..report.result_table import print_result, result_text

    if sys.stdout.isatty():
        from rich.console import Console

        print_result(Console(), episode, result, ticks_per_s)
    else:
        sys.stdout.write(result_text(episode, result, ticks_per_s))
