# SPDX-License-Identifier: Apache-2.0
"""`mfba show`: explain a run of a sweep with text, pictures and a bag; list failed runs."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..core.argument_parser import Parser
from ..core.errors import InputError
from ..core.output_files import new_run_directory, refuse_existing, write_new
from ..evaluation.oracle import solve
from ..evaluation.sweep.explain_run import contact_index, explain
from ..evaluation.sweep.planner_sandbox import HungError
from ..evaluation.sweep.read_sweep import ReadSweep, read_sweep
from ..evaluation.sweep.single_run import CompletedRun, run_one
from ..evaluation.sweep.sweep_spec import (
    Run,
    Setting,
    SweepSpec,
    default_setting,
    own_preset,
    read_run,
)
from ..evaluation.sweep.table_columns import Row, run_row
from ..launcher.run_directory import RunDirectory
from ..simulation.triggers import with_triggers

_DESCRIPTION = """Repeat a run of a sweep and explain its outcome.

RUN is SUITE/WORLD/PLANNER/SEED or, with a directory of `mfba sweep`, also the number of a row of
its table (from 0); without RUN the failed runs are listed. Without a directory the run has the
default settings of `mfba sweep`."""
LISTED = 20


def main(args: list[str]) -> int:
    """Explain a run, or list the failed runs."""
    parser = Parser(prog="mfba show", description=_DESCRIPTION)
    parser.add_argument("what", nargs="+", metavar="DIR | RUN", help="directory, run, or both")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="directory to create (default: below runs/)"
    )
    parser.add_argument("--no-bag", action="store_true", help="write no bag (a bag needs rclpy)")
    parsed = parser.parse(args)
    arguments = list(parsed.what)
    swept = read_sweep(Path(arguments.pop(0))) if _is_directory(arguments[0]) else None
    if len(arguments) > 1:
        raise InputError(f"{arguments[1]}: one argument too many; give a directory and one run")
    if swept is not None and not arguments:
        return _list_failures(swept)
    return _show_run(swept, arguments[0], parsed.out, bag=not parsed.no_bag)


def _is_directory(argument: str) -> bool:
    return Path(argument).is_dir() or (argument.count("/") != 3 and not argument.isdecimal())


def _list_failures(swept: ReadSweep) -> int:
    failed = [(k, row) for k, row in enumerate(swept.rows) if not row["success"]]
    print(f"{len(failed)} of {len(swept.rows)} runs without success")
    for k, row in failed[:LISTED]:
        name = f"  {row['scenario']}" if "scenario" in row else ""
        print(f"{k:>7}  {Run(*(row[n] for n in Run._fields))}{name}  {_failure_text(row)}")
    if len(failed) > LISTED:
        print(f"{'...':>7}  and {len(failed) - LISTED} more")
    return 0


def _failure_text(row: Row) -> str:
    if row["failure"]:
        return str(row["failure"])
    return f"{row['outcome']}, {row['collisions']} collisions"


def _show_run(swept: ReadSweep | None, argument: str, out: Path | None, *, bag: bool) -> int:
    run, row = _find_run(swept, argument)
    setting = swept.spec.setting_of(run.planner) if swept else _default_setting(run)
    # Raises ConfigError for a bad run.
    SweepSpec(suite=run.suite, planners=(run.planner,), worlds=1, first=run.world, setting=setting)
    directory = refuse_existing(out or new_run_directory(stem="show"))
    with _time_limit(setting.patience_s):
        completed = run_one(run, setting)
    name = f"  {completed.episode.scenario.name}" if setting.scenarios else ""
    lines = [f"{run}{name}", *explain(completed), *_oracle_lines(completed, setting)]
    if swept is not None and swept.code_changed:
        lines.append("note: the code has changed since the sweep; its result may differ")
    if row is not None and not _is_same(row, run_row(run, completed)):
        lines.append("note: the sweep's run had another result; see the row of its table")
    print("\n".join(lines))
    made = RunDirectory(directory)
    with made.discarded_on_error():
        names = _write(directory, run, completed, lines, bag=bag)
    print(f"wrote {directory}: {', '.join(names)}")
    return 0


def _default_setting(run: Run) -> Setting:
    default = default_setting(run.suite)
    return replace(default, params=own_preset(run.planner, default.params))


def _find_run(swept: ReadSweep | None, argument: str) -> tuple[Run, Row | None]:
    """The run, and its row of the table, if any."""
    if swept is None:
        return read_run(argument), None
    if argument.isdecimal():
        if int(argument) >= len(swept.rows):
            raise InputError(f"{argument}: the table has {len(swept.rows)} rows; give 0 or more")
        row = swept.rows[int(argument)]
        return Run(*(row[name] for name in Run._fields)), row
    run = read_run(argument)
    for row in swept.rows:
        if run == tuple(row[name] for name in Run._fields):
            return run, row
    raise InputError(
        f"{argument}: not a run of this sweep; give one of its table, or no directory"
    )


def _is_same(row: Row, made: Row) -> bool:
    return all(repr(row.get(name)) == repr(value) for name, value in made.items())


@contextmanager
def _time_limit(limit_s: float) -> Iterator[None]:
    """Interrupt a planner that hangs; one that hangs in native code needs Ctrl-C."""

    def interrupt(*_: Any) -> None:
        raise HungError(f"hung: no end after {limit_s:g} s of wall time")

    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, limit_s)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _oracle_lines(completed: CompletedRun, setting: Setting) -> Iterator[str]:
    scenario = completed.episode.scenario
    solution = solve(scenario, setting.params.speed_mps)
    length = f", {solution.length_m:.3f} m" if solution.waypoints else ""
    why = ""
    if scenario.robot.footprint_m:
        disc = f"for the disc of {scenario.robot_radius_m:.3g} m around the footprint"
        why = f" ({solution.reason or disc})"
    elif with_triggers(scenario):
        why = f" ({solution.reason})"
    yield f"oracle: {solution.certificate.value} at {solution.speed_mps:g} m/s{length}{why}"


def _write(
    directory: Path, run: Run, completed: CompletedRun, lines: list[str], *, bag: bool
) -> list[str]:
    episode = completed.episode
    names = ["explanation.txt"]
    write_new(directory / names[0], ("\n".join(lines) + "\n").encode())
    if not episode.ticks:
        return names
    from ..report.run_figure import draw_run
    from ..report.tick_figure import tick_png

    draw_run(episode, directory / "run.png")
    index = contact_index(episode)
    index = len(episode.ticks) - 1 if index is None else index
    write_new(directory / "moment.png", tick_png(episode, index, str(run), lines[1:2]))
    names += ["run.png", "moment.png"]
    if bag:
        from ..ros.interface.episode_to_bag import write_episode_bag

        write_episode_bag(episode, directory / "bag", {"planner": run.planner})
        names.append("bag")
    return names
