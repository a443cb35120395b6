# SPDX-License-Identifier: Apache-2.0
"""Execute a RunRequest: run a driver, read the recording, write the result, exit code."""

from __future__ import annotations

import sys
from contextlib import closing

from ..core.errors import BagError, MfbaError, OutputError
from ..scenarios.run_config import Driver
from ..simulation.episode import Episode
from ..simulation.run_episode import simulate
from .console import RunConsole
from .forked_process import ForkServer
from .run_arguments import RunRequest
from .run_directory import RunDirectory
from .run_result import finish_run
from .run_state import Run
from .stop_request import StoppedError, StopRequest


def execute(request: RunRequest, fork_server: ForkServer | None = None) -> int:
    """Make the run; return 0 for the goal without collision, 128 + number for a signal.

    fork_server starts the nodes of the multi-process driver; None: one that ends with the run.
    Raises MfbaError, in one line, for any other end. A run that fails before its start leaves no
    files; one that fails later leaves what was recorded.
    """
    episode: Episode | None = None
    failure: MfbaError | StoppedError | None = None
    with StopRequest(request.timeout_s) as stop, closing(RunConsole()) as console:
        run = Run(request, RunDirectory(request.out), console, stop)
        try:
            episode = _run_driver(run, fork_server)
            failure = run.stopped
        except (MfbaError, StoppedError) as error:
            failure = error
        finally:
            if not run.has_started:
                run.directory.discard()
    if failure is None:
        _finish(run, episode)
        return 0
    if run.has_started:
        try:
            _finish(run, episode, str(failure))
        except BagError:
            pass  # nothing recorded; the failure is reported below
        except OutputError as error:
            print(f"note: {error}")
    return _fail(failure, run)


def _finish(run: Run, episode: Episode | None, failure: str = "") -> None:
    """Write the results of a run; check the outcome and open the viewer unless it failed."""
    if run.request.config.scenario.robots:
        from .fleet_result import finish_fleet_run

        finish_fleet_run(run, failure)
        return
    run_result = finish_run(run, episode, failure)
    if failure:
        return
    if run.request.view:
        from ..recording.fleet_topics import NO_NAMESPACE
        from ..recording.local_maps import NO_MAPS, read_local_maps
        from ..report.rerun_viewer import show

        name, maps = run_result.directory.name, NO_MAPS
        if episode is None:
            maps = {name: read_local_maps(run.directory.bag, [NO_NAMESPACE])[NO_NAMESPACE]}
        show([(name, run_result.episode)], maps=maps)
    run_result.require_success()


def _run_driver(run: Run, fork_server: ForkServer | None) -> Episode | None:
    """Run the requested driver; return the episode where no bag is written."""
    config = run.request.config
    if config.driver is Driver.MULTI_PROCESS:
        from .multi_process_driver import run_multi_process

        with fork_server or ForkServer() as server:
            run_multi_process(run, server)
        return None
    if config.driver is Driver.IN_PROCESS:
        _run_in_process(run)
        return None
    run.start()
    episode = simulate(
        config.scenario,
        planner=config.planner,
        sensor=config.sensor,
        seed=config.seed,
        go_on=run.should_continue,
    )
    run.end()
    return episode


def _run_in_process(run: Run) -> None:
    from ..ros import require_ros  # noqa: F401  (before rclpy, which would exit by itself)
    from .in_process_driver import run_in_process
    from .ros_domain import private_domain

    with private_domain(run.console.print_line) as domain:
        run.wall_s = run_in_process(
            run.request.config,
            run.directory.bag,
            domain_id=domain,
            timeout_s=run.request.timeout_s,
            on_turn=run.should_continue,
        )


def _fail(failure: MfbaError | StoppedError, run: Run) -> int:
    """Report the failure and the directory; return the exit code. Raises MfbaError for 1."""
    location = f"; what was recorded is in {run.directory.path}" if run.has_started else ""
    if isinstance(failure, StoppedError) and failure.exit_code != 1:
        print(f"{failure}{location}", file=sys.stderr)
        return failure.exit_code
    raise MfbaError(f"{failure}{location}") from None
