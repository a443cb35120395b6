# SPDX-License-Identifier: Apache-2.0
"""`mfba sweep`: a suite of worlds x planners x seeds -> one table and a report; needs no ROS."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..core.argument_parser import Parser
from ..core.options import Scalar, flatten
from ..core.outputs import new_run_directory, write_same
from ..evaluation.study.compute_chunks import check_workers
from ..evaluation.suites import suite_names
from ..evaluation.suites.named_suites import SPEED_MPS
from ..evaluation.sweep.chunks import chunks_of
from ..evaluation.sweep.columns import COLUMNS, TIMINGS
from ..evaluation.sweep.run_sweep import Swept, dask_executor, open_store, sweep
from ..evaluation.sweep.sweep_spec import PATIENCE_S, Setting, SweepSpec, own_preset
from ..evaluation.sweep.table import write
from ..launcher.set_option import add_set_argument, with_settings
from ..perception.sensory_vector import SensorParams
from ..planning.planner_factory import DEFAULT_METHOD
from ..planning.planner_params import PlannerParams
from ..planning.planner_registry import PLANNERS
from ..simulation.planner_observations import NAMES as PERCEPTIONS
from .study_progress import add_work_arguments, progress, say

_DESCRIPTION = """Run planners in the worlds of a suite and tell how good they are.

Everything goes into a directory: the table (a row per run), timings.csv (what the clock said; all
else is the same whoever computes it), report.md, and the finished parts of the runs, so that an
interrupted command goes on where it was when called again with --out. `mfba show` explains a run.
"""


def main(args: list[str]) -> int:
    """Make the sweep."""
    found = _parser().parse(args)
    check_workers(found.workers)
    order = _order(found)
    directory = found.out or new_run_directory(stem="sweep")
    store = open_store(directory, order)
    with _executor(found.scheduler) as executor, progress(chunks_of(order), directory) as done:
        swept = sweep(
            order, workers=found.workers, executor=executor, store=store, done=done, say=say
        )
    names = [f"table.{found.format}", "timings.csv"]
    write(directory / names[0], swept.rows, COLUMNS)
    write(directory / names[1], swept.timings, TIMINGS)
    _report(swept, directory)
    print(f"wrote {directory}: {', '.join([*names, 'report.md'])}")
    print(f"sorted hash {swept.hash}")
    return 0


def _parser() -> Parser:
    lines = [f"  {name:<19} {meaning}" for name, (_, meaning) in {**COLUMNS, **TIMINGS}.items()]
    parser = Parser(
        prog="mfba sweep",
        description=_DESCRIPTION,
        epilog="columns of the table, and of timings.csv:\n" + "\n".join(lines),
    )
    parser.add_argument("suite", metavar="SUITE", help=f"one of {', '.join(suite_names())}")
    parser.add_argument(
        "--planner", action="append", default=[], metavar="NAME", dest="planners",
        help=f"one of {', '.join(PLANNERS)}, or MODULE:NAME; may be repeated "
        f"(default: {DEFAULT_METHOD.value})",
    )  # fmt: skip
    for name, default, what in (
        ("--worlds", 100, "how many worlds"),
        ("--first", 0, "first of them"),
        ("--seeds", 1, "seeds per world and planner"),
        ("--suite-seed", 0, "seed of all worlds"),
        ("--latency", 0, "age of what is perceived, ticks"),
    ):
        parser.add_argument(
            name, type=int, default=default, metavar="N", help=f"{what} (default: {default})"
        )
    parser.add_argument(
        "--perception", choices=PERCEPTIONS, default="known",
        help="sectors: the paper's bits alone; known: circles within SR with velocities; "
        "scan-N: N beams (default: known)",
    )  # fmt: skip
    parser.add_argument(
        "--noise", type=float, default=0.0, metavar="M", help="its standard deviation, m"
    )
    parser.add_argument(
        "--no-oracle", action="store_true", help="leave out the optimum, gap, SPL and BARN score"
    )
    parser.add_argument(
        "--patience", type=float, default=PATIENCE_S, metavar="S",
        help="wall time after which a run counts as hanging (default: 60)",
    )  # fmt: skip
    add_set_argument(parser)
    parser.add_argument("--format", choices=("csv", "parquet"), default="csv", help="of the table")
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="tcp://HOST:PORT of a dask.distributed scheduler"
    )
    add_work_arguments(parser)
    return parser


def _order(found: argparse.Namespace) -> SweepSpec:
    usual, planners = (
        PlannerParams(speed_mps=SPEED_MPS),
        tuple(found.planners or [DEFAULT_METHOD.value]),
    )
    params, sensor = with_settings(usual, SensorParams(), found.settings)
    # What was said on the command line holds for all, whatever a planner is made for.
    own = {
        name: with_settings(own_preset(name, usual), sensor, found.settings)[0]
        for name in planners
    }
    return SweepSpec(
        suite=found.suite,
        planners=planners,
        worlds=found.worlds,
        first=found.first,
        seeds=found.seeds,
        oracle=not found.no_oracle,
        setting=Setting(
            params=params,
            sensor=sensor,
            perception=found.perception,
            noise_m=found.noise,
            latency_ticks=found.latency,
            suite_seed=found.suite_seed,
            patience_s=found.patience,
        ),
        own={name: one for name, one in own.items() if one != params},
    )


@contextmanager
def _executor(scheduler: str | None) -> Iterator[Executor | None]:
    if scheduler is None:
        yield None
        return
    with dask_executor(scheduler) as executor:
        yield executor


def command(order: SweepSpec) -> str:
    """The command that makes this sweep, however it was typed."""
    one, plain = order.setting, Setting()
    words = ["mfba", "sweep", order.suite]
    for planner in order.planners:
        words += ["--planner", planner]
    words += ["--worlds", str(order.worlds)]
    for name, value, default in (
        ("--first", order.first, 0),
        ("--seeds", order.seeds, 1),
        ("--suite-seed", one.suite_seed, 0),
        ("--perception", one.perception, plain.perception),
        ("--noise", one.noise_m, 0.0),
        ("--latency", one.latency_ticks, 0),
        ("--patience", one.patience_s, PATIENCE_S),
    ):
        if value != default:
            words += [name, str(value)]
    words += [] if order.oracle else ["--no-oracle"]
    said = {f"sensor.{name}": value for name, value in _changed(one.sensor, plain.sensor)}
    for planner in order.planners:
        params = order.setting_of(planner).params
        for name, value in _changed(params, own_preset(planner, plain.params)):
            said[f"planner.{name}"] = value
    for name, value in said.items():
        words += ["--set", f"{name}={value}"]
    return shlex.join(words)


def _changed(one: Any, plain: Any) -> Iterator[tuple[str, Scalar]]:
    """Options that are not the usual ones."""
    usual = flatten(plain)
    yield from ((name, value) for name, value in flatten(one).items() if value != usual[name])


def _report(swept: Swept, directory: Path) -> None:
    from rich.console import Console

    from ..evaluation.sweep.summary import comparisons, standings
    from ..report.sweep_tables import tables, to_markdown
    from ..report.terminal_output import print_encodable

    order = swept.order
    found, pairs = standings(swept.rows, swept.timings), comparisons(swept.rows)
    title = f"{order.suite}: {order.worlds} worlds from {order.first} on, {order.seeds} seeds each"
    facts = [f"`{command(order)}`", f"sorted hash of the table `{swept.hash}`"]
    write_same(directory / "report.md", to_markdown(found, pairs, title, facts).encode())
    console = Console()
    for table in tables(found, pairs, title):
        print_encodable(console, lambda encodable, table=table: encodable.print(table))  # type: ignore[misc]
