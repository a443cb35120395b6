# SPDX-License-Identifier: Apache-2.0
"""`mfba sweep`: run planners in a suite of worlds; writes a table, a report; needs no ROS."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..core.argument_parser import Parser
from ..core.errors import MfbaError
from ..core.option_specs import Scalar, flatten
from ..core.output_files import new_run_directory, write_same
from ..evaluation.study.compute_chunks import check_workers
from ..evaluation.suites import suite_names
from ..evaluation.suites.scenario_suite import are_files, read_scenario_files
from ..evaluation.sweep.run_sweep import SweepResult, open_store, sweep
from ..evaluation.sweep.sweep_chunks import chunks_of
from ..evaluation.sweep.sweep_spec import (
    DEFAULT_PERCEPTION,
    PATIENCE_S,
    PERCEPTIONS,
    SweepSpec,
    default_setting,
    own_preset,
)
from ..evaluation.sweep.table import kinds_of, write
from ..evaluation.sweep.table_columns import COLUMNS, SCENARIO, TIMINGS
from ..launcher.set_option import (
    add_optimizer_argument,
    add_set_argument,
    robot_changes,
    settings_of,
    with_settings,
)
from ..perception.sensory_vector import SensorParams
from ..planning.planner_factory import DEFAULT_METHOD
from ..planning.planner_registry import PLANNERS
from ..simulation.lidar_perception import OWN_ROBOT
from .support.study_progress import add_study_arguments, executor_at, print_status, progress

WORLDS = 100  # of a built-in suite
_DESCRIPTION = """Run planners in the worlds of a suite and compare them.

A suite is built in, or your own: a directory of scenario files, or a list of them. Their worlds
are numbered from 0, sorted by file name.

Writes a directory: the table (a row per run), timings.csv (computing times; all other files are
the same on every machine), report.md, and the finished chunks of the runs: an interrupted command
continues with --out DIR. `mfba show` explains a run.
"""


_PERCEPTION = """lidar: 360 beams of 3.5 m, as `mfba sim` with robot.lidar.beams=360;
lidar-differential: the same on a differential drive; lidar-realistic: that with errors: ranges
2 cm, odometry 2 cm and 0.02 rad (standard deviations), scans 0.1 s old; known: told the truth,
the circles within SR with their velocities; sectors: the paper's bits only; scan-N: N beams that
see no farther than SR, to hold SR equal; scenario: the robot of each scenario file, as `mfba
sim`"""


def main(args: list[str]) -> int:
    """Run the sweep."""
    parsed = _parser().parse(args)
    check_workers(parsed.workers)
    spec, left_out = _sweep_spec(parsed)
    directory = parsed.out or new_run_directory(stem="sweep")
    store = open_store(directory, spec)
    for line in left_out:
        print_status(f"left out: {line}")
    with executor_at(parsed.scheduler) as executor, progress(chunks_of(spec), directory) as done:
        swept = sweep(
            spec,
            workers=parsed.workers,
            executor=executor,
            store=store,
            done=done,
            warn=print_status,
        )
    names = [f"table.{parsed.format}", "timings.csv"]
    write(directory / names[0], swept.rows, kinds_of(spec))
    write(directory / names[1], swept.timings, TIMINGS)
    useless = _report(swept, directory)
    print(f"wrote {directory}: {', '.join([*names, 'report.md'])}")
    print(f"sorted hash {swept.hash}")
    if left_out:
        raise MfbaError(
            f"{len(left_out)} scenario file{'s' * (len(left_out) > 1)} left out, see above; mend "
            "them and sweep into another --out"
        )
    if useless:
        raise MfbaError("; ".join(useless) + f"; see {directory / 'report.md'} and mfba show")
    return 0


def _parser() -> Parser:
    columns = {**COLUMNS, **SCENARIO, **TIMINGS}
    lines = [f"  {name:<19} {meaning}" for name, (_, meaning) in columns.items()]
    parser = Parser(
        prog="mfba sweep",
        description=_DESCRIPTION,
        epilog="columns of the table, and of timings.csv:\n" + "\n".join(lines),
    )
    parser.add_argument(
        "suite", nargs="+", metavar="SUITE | DIR | FILE",
        help=f"one of {', '.join(suite_names())}; or a directory of scenario files; or files",
    )  # fmt: skip
    parser.add_argument(
        "--worlds", type=int, metavar="N",
        help=f"number of worlds (default: {WORLDS}; of scenario files, all)",
    )  # fmt: skip
    parser.add_argument(
        "--planner", action="append", default=[], metavar="NAME", dest="planners",
        help=f"one of {', '.join(PLANNERS)}, or MODULE:NAME; may be repeated "
        f"(default: {DEFAULT_METHOD.value})",
    )  # fmt: skip
    for name, default, what in (
        ("--first", 0, "number of the first world"),
        ("--seeds", 1, "seeds per world and planner"),
        ("--suite-seed", 0, "seed of all worlds"),
        ("--latency", 0, "latency of the perception, ticks, beside that of lidar-realistic"),
    ):
        parser.add_argument(
            name, type=int, default=default, metavar="N", help=f"{what} (default: {default})"
        )
    parser.add_argument(
        "--perception", choices=PERCEPTIONS, metavar="NAME",
        help=f"{_PERCEPTION} (default: {DEFAULT_PERCEPTION}; of scenario files, {OWN_ROBOT})",
    )  # fmt: skip
    parser.add_argument(
        "--noise",
        type=float,
        default=0.0,
        metavar="M",
        help="standard deviation of ranges (of centres when known), m, beside that of "
        "lidar-realistic",
    )
    parser.add_argument(
        "--no-oracle", action="store_true", help="leave out optimum, gap, SPL and BARN score"
    )
    parser.add_argument(
        "--patience", type=float, default=PATIENCE_S, metavar="S",
        help="wall time, s, after which a run counts as hung (default: 60)",
    )  # fmt: skip
    add_optimizer_argument(parser)
    add_set_argument(parser)
    parser.add_argument(
        "--format", choices=("csv", "parquet"), default="csv", help="format of the table"
    )
    add_study_arguments(parser)
    return parser


def _sweep_spec(parsed: argparse.Namespace) -> tuple[SweepSpec, list[str]]:
    """The sweep, and a line for each scenario file that is left out."""
    name, worlds, left_out = parsed.suite[0], WORLDS, list[str]()
    if are_files(parsed.suite):
        scenarios, left_out = read_scenario_files(parsed.suite)
        name, worlds = scenarios.name, max(1, scenarios.count - max(0, parsed.first))
        setting = default_setting(name, scenarios)
    else:
        setting = default_setting(name)
    default = setting.params
    planners = tuple(parsed.planners or [DEFAULT_METHOD.value])
    robot, settings = robot_changes(settings_of(parsed))
    params, sensor = with_settings(default, SensorParams(), settings)
    # --set overrides every planner's own preset.
    own = {
        name: with_settings(own_preset(name, default), sensor, settings)[0] for name in planners
    }
    spec = SweepSpec(
        suite=name,
        planners=planners,
        worlds=worlds if parsed.worlds is None else parsed.worlds,
        first=parsed.first,
        seeds=parsed.seeds,
        oracle=not parsed.no_oracle,
        setting=replace(
            setting,
            params=params,
            sensor=sensor,
            perception=parsed.perception or setting.perception,
            noise_m=parsed.noise,
            latency_ticks=parsed.latency,
            suite_seed=parsed.suite_seed,
            patience_s=parsed.patience,
            robot=tuple(robot.items()),
        ),
        own={name: preset for name, preset in own.items() if preset != params},
    )
    return spec, left_out


def command_line(spec: SweepSpec) -> str:
    """The shortest `mfba sweep` command line for this sweep."""
    setting, scenarios = spec.setting, spec.setting.scenarios
    default = default_setting(spec.suite, scenarios)
    arguments = ["mfba", "sweep", *(scenarios.sources if scenarios else [spec.suite])]
    for planner in spec.planners:
        arguments += ["--planner", planner]
    if scenarios is None or spec.worlds != scenarios.count - spec.first:
        arguments += ["--worlds", str(spec.worlds)]
    for name, value, unset in (
        ("--first", spec.first, 0),
        ("--seeds", spec.seeds, 1),
        ("--suite-seed", setting.suite_seed, 0),
        ("--perception", setting.perception, default.perception),
        ("--noise", setting.noise_m, 0.0),
        ("--latency", setting.latency_ticks, 0),
        ("--patience", setting.patience_s, PATIENCE_S),
    ):
        if value != unset:
            arguments += [name, str(value)]
    arguments += [] if spec.oracle else ["--no-oracle"]
    changes = {
        f"sensor.{name}": value for name, value in _non_default(setting.sensor, default.sensor)
    }
    for planner in spec.planners:
        params = spec.setting_of(planner).params
        for name, value in _non_default(params, own_preset(planner, default.params)):
            changes[f"planner.{name}"] = value
    changes |= {f"robot.{name}": value for name, value in setting.robot}
    for name, value in changes.items():
        text = str(value).lower() if isinstance(value, bool) else value
        arguments += ["--set", f"{name}={text}"]
    return shlex.join(arguments)


def _non_default(params: Any, default: Any) -> Iterator[tuple[str, Scalar]]:
    """(name, value) of the options that differ from the default."""
    defaults = flatten(default)
    yield from (
        (name, value) for name, value in flatten(params).items() if value != defaults[name]
    )


def _report(swept: SweepResult, directory: Path) -> list[str]:
    """Write and print the report; return a line for each planner that failed in all its runs."""
    from rich.console import Console

    from ..evaluation.sweep.summary import comparisons, planner_summaries
    from ..report.sweep_tables import tables, to_markdown
    from ..report.terminal_output import print_encodable

    spec = swept.spec
    ranking, pairs = planner_summaries(swept.rows, swept.timings), comparisons(swept.rows)
    title = f"{spec.suite}: {spec.worlds} worlds from {spec.first} on, {spec.seeds} seeds each"
    facts = [f"`{command_line(spec)}`", f"sorted hash of the table `{swept.hash}`"]
    write_same(directory / "report.md", to_markdown(ranking, pairs, title, facts).encode())
    console = Console()
    for table in tables(ranking, pairs, title):
        print_encodable(console, lambda encodable, table=table: encodable.print(table))  # type: ignore[misc]
    for one in ranking:
        for reason, count in one.failures:
            print(f"{one.planner} failed in {count} of {one.runs} runs: {reason}")
    return [
        f"{one.planner} failed in each of its {one.runs} runs: {one.failures[0][0]}"
        for one in ranking
        if sum(count for _, count in one.failures) == one.runs
    ]
