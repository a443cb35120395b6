# SPDX-License-Identifier: Apache-2.0
"""From an Order to its exit code: drive, read what was recorded, judge."""

from __future__ import annotations

import sys
from contextlib import closing, suppress

from ..core.errors import BagError, MfbaError
from ..scenarios.run_config import Driver
from ..simulation.episode import Episode
from ..simulation.simulate import simulate
from .console import Screen
from .fleet_result import conclude_fleet
from .run import Attempt
from .run_arguments import Order
from .run_directory import RunDirectory
from .run_result import conclude
from .stop_request import StoppedError, StopRequest


def run(order: Order) -> int:
    """Make the run; return 0 for the goal without collision, 128 + number for a signal.

    Raises MfbaError, in one line, for any other end. A run that never began leaves nothing
    behind; of one that failed later there is whatever could be recorded.
    """
    episode: Episode | None = None
    failure: MfbaError | StoppedError | None = None
    with StopRequest(order.timeout_s) as stop, closing(Screen()) as screen:
        attempt = Attempt(order, RunDirectory(order.out), screen, stop)
        try:
            episode = _drive(attempt)
            failure = attempt.stopped
        except (MfbaError, StoppedError) as error:
            failure = error
        finally:
            if not attempt.has_begun:
                attempt.directory.discard()
    if failure is None:
        _conclude(attempt, episode)
        return 0
    if attempt.has_begun:
        with suppress(BagError):  # nothing to tell of; the failure is told below
            _conclude(attempt, episode, str(failure))
    return _fail(failure, attempt)


def _conclude(attempt: Attempt, episode: Episode | None, failure: str = "") -> None:
    """Leave what is left of a run; judge and show it unless it failed."""
    if attempt.order.config.scenario.robots:
        conclude_fleet(attempt, failure)
        return
    conclusion = conclude(attempt, episode, failure)
    if failure:
        return
    if attempt.order.view:
        from ..report.rerun_viewer import show

        show([(conclusion.directory.name, conclusion.episode)])
    conclusion.judge()


def _drive(attempt: Attempt) -> Episode | None:
    """Let the ordered driver make the run; return the episode where there is no bag."""
    config = attempt.order.config
    if config.driver is Driver.MULTI_PROCESS:
        from .multi_process import run_multi_process

        run_multi_process(attempt)
        return None
    if config.driver is Driver.IN_PROCESS:
        _run_in_process(attempt)
        return None
    attempt.begin()
    episode = simulate(
        config.scenario,
        planner=config.planner,
        sensor=config.sensor,
        seed=config.seed,
        go_on=attempt.go_on,
    )
    attempt.end()
    return episode


def _run_in_process(attempt: Attempt) -> None:
    from .in_process import run_in_process
    from .ros_domain import private_domain

    with private_domain() as domain:
        attempt.wall_s = run_in_process(
            attempt.order.config,
            attempt.directory.bag,
            domain_id=domain,
            timeout_s=attempt.order.timeout_s,
            on_turn=attempt.go_on,
        )


def _fail(failure: MfbaError | StoppedError, attempt: Attempt) -> int:
    """Say why in one line, and where to look; return the exit code unless it is 1."""
    where = f"; what was recorded is in {attempt.directory.path}" if attempt.has_begun else ""
    if isinstance(failure, StoppedError) and failure.exit_code != 1:
        print(f"{failure}{where}", file=sys.stderr)
        return failure.exit_code
    raise MfbaError(f"{failure}{where}") from None
