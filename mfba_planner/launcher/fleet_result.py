# SPDX-License-Identifier: Apache-2.0
"""The result of a fleet's run: table, a JSON file per robot, picture, success or error."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from ..core.errors import MfbaError
from ..evaluation.metrics import evaluate
from ..recording.decisions_without_inputs import print_omissions
from ..recording.local_maps import read_local_maps
from ..recording.read_episode import read_recording
from ..report.fleet_table import fleet_text, why_no_success
from .run_state import Run


def finish_fleet_run(run: Run, failure: str = "") -> None:
    """Print the table, write NAME.json for each robot and run.png.

    Raises MfbaError for a run without success, unless `failure` names another error already.
    Raises BagError for a bag that lacks a robot's decisions or was not closed, and OutputError, in
    the end, for a file that cannot be written.
    """
    from ..report.fleet_figure import draw_fleet
    from ..report.result_json import result_to_dict, write_result

    directory, config = run.directory, run.request.config
    recording = read_recording(directory.bag)
    print_omissions(directory.bag, recording.omitted)
    runs = recording.episodes
    results = [evaluate(episode) for episode in runs.values()]
    extra = {"fleet_seed": config.seed, "wall_s": run.wall_s, "failure": failure or None}
    writers: list[Callable[[], None]] = []
    for name, episode in runs.items():
        left_out = {"left_out": recording.omitted[name]} if name in recording.omitted else {}
        data = result_to_dict(episode, extra | left_out)
        writers.append(partial(write_result, directory.path / f"{name}.json", data))
    if run.request.picture:
        writers.append(partial(draw_fleet, config.scenario, config.seed, runs, directory.picture))
    directory.complete(writers, lambda: print(fleet_text(list(runs), results), end=""))
    if failure:
        return
    if run.request.view:
        from ..report.rerun_viewer import show

        show(list(runs.items()), list(runs), read_local_maps(directory.bag, runs))
    if why := why_no_success(results):
        raise MfbaError(f"{directory.path}: {why}")
