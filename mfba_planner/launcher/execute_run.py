# SPDX-License-Identifier: Apache-2.0
"""From an Order to its exit code: drive, read what was recorded, judge."""

from __future__ import annotations

import sys
from contextlib import closing, suppress

from ..core.errors import BagError, MfbaError
from ..scenarios.run_config import Driver
from ..simulation.episode import Episode
from ..simulation.simulate import simulate
from .console import RunConsole
from .fleet_result import finish_fleet_run
from .run import Run
from .run_arguments import RunRequest
from .run_directory import RunDirectory
from .run_result import finish_run
from .stop_request import StoppedError, StopRequest


def execute(request: RunRequest) -> int:
    """Make the run; return 0 for the goal without collision, 128 + number for a signal.

    Raises MfbaError, in one line, for any other end. A run that never began leaves nothing
    behind; of one that failed later there is whatever could be recorded.
    """
    episode: Episode | None = None
    failure: MfbaError | StoppedError | None = None
    with StopRequest(request.timeout_s) as stop, closing(RunConsole()) as console:
        run = Run(request, RunDirectory(request.out), console, stop)
        try:
            episode = _drive(run)
            failure = run.stopped
        except (MfbaError, StoppedError) as error:
            failure = error
        finally:
            if not run.has_begun:
                run.directory.discard()
    if failure is None:
        _conclude(run, episode)
        return 0
    if run.has_begun:
        with suppress(BagError):  # nothing to tell of; the failure is told below
            _conclude(run, episode, str(failure))
    return _fail(failure, run)


def _conclude(run: Run, episode: Episode | None, failure: str = "") -> None:
    """Leave what is left of a run; judge and show it unless it failed."""
    if run.request.config.scenario.robots:
        finish_fleet_run(run, failure)
        return
    run_result = finish_run(run, episode, failure)
    if failure:
        return
    if run.request.view:
        from ..report.rerun_viewer import show

        show([(run_result.directory.name, run_result.episode)])
    run_result.judge()


def _drive(run: Run) -> Episode | None:
    """Let the ordered driver make the run; return the episode where there is no bag."""
    config = run.request.config
    if config.driver is Driver.MULTI_PROCESS:
        from .multi_process import run_multi_process

        run_multi_process(run)
        return None
    if config.driver is Driver.IN_PROCESS:
        _run_in_process(run)
        return None
    run.begin()
    episode = simulate(
        config.scenario,
        planner=config.planner,
        sensor=config.sensor,
        seed=config.seed,
        go_on=run.go_on,
    )
    run.end()
    return episode


def _run_in_process(run: Run) -> None:
    from .in_process import run_in_process
    from .ros_domain import private_domain

    with private_domain() as domain:
        run.wall_s = run_in_process(
            run.request.config,
            run.directory.bag,
            domain_id=domain,
            timeout_s=run.request.timeout_s,
            on_turn=run.go_on,
        )


def _fail(failure: MfbaError | StoppedError, run: Run) -> int:
    """Say why in one line, and where to look; return the exit code unless it is 1."""
    where = f"; what was recorded is in {run.directory.path}" if run.has_begun else ""
    if isinstance(failure, StoppedError) and failure.exit_code != 1:
        print(f"{failure}{where}", file=sys.stderr)
        return failure.exit_code
    raise MfbaError(f"{failure}{where}") from None
