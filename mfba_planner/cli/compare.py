# SPDX-License-Identifier: Apache-2.0
"""`mfba compare`: compare optimisers in the same planners, worlds and budgets; needs no ROS."""

from __future__ import annotations

import argparse
import json
import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ..core.argument_parser import Parser
from ..core.errors import ConfigError
from ..core.input_files import read_input
from ..core.option_specs import did_you_mean
from ..core.output_files import new_run_directory, write_same
from ..evaluation.comparison.comparison_groups import Group, groups
from ..evaluation.comparison.comparison_spec import (
    TABLE,
    TIMING_TABLE,
    ComparisonSpec,
    check_optimizers,
    rows_of,
)
from ..evaluation.study.chunk_store import Store
from ..evaluation.study.compute_chunks import check_workers, compute
from ..evaluation.suites import suite, suite_names
from ..evaluation.sweep.run_sweep import PACKAGES
from ..evaluation.sweep.sweep_spec import SweepSpec, default_setting, own_preset
from ..evaluation.sweep.table import sorted_hash, write
from ..launcher.set_option import OPTIMIZER, add_set_argument, with_settings
from ..optimizers.registry import NAMES
from ..paper import optimizers_on_functions
from ..paper.benchmark_functions import FUNCTIONS
from ..paper.optimizers_on_functions import FunctionSpec
from ..perception.sensory_vector import SensorParams
from ..planning.planner_params import Method, PlannerParams
from .support.page_blocks import read_page, replace_file
from .support.study_progress import add_study_arguments, executor_at, print_status, progress

_DESCRIPTION = """Compare optimisers: each searches in the same planners, worlds, seeds and numbers
of evaluations, and on the functions of Table 2.

Writes a directory: table.csv (a row per run) and comparison.json, which are the same for any
number of workers; report.md with verdicts by rule, ranks.png, budgets.png, timings.csv, and the
finished chunks of the runs: an interrupted command continues with --out DIR.

A row is run again, and explained by `mfba show`, after `mfba sweep SUITE --planner PLANNER
--optimizer NAME --set planner.bat.iterations=N --first WORLD --worlds 1`, where N is the budget /
population - 1."""
PATIENCE_S = 600.0
_PICTURES = ("ranks.png", "budgets.png")
_BLOCK = "comparison"  # of a page
_VARIED = ("planner.bat.iterations", OPTIMIZER)  # settings that a comparison varies itself


@dataclass(frozen=True, slots=True, kw_only=True)
class _Size:
    """What is run where the command line does not name it."""

    suites: tuple[str, ...]
    functions: tuple[str, ...]
    planners: tuple[str, ...]
    optimizers: tuple[str, ...]
    budgets: tuple[int, ...]
    worlds: int
    runs: int


_OPTIMIZERS = ("mfba", "ba", "random", "grid", "none", "scipy:differential_evolution")
FULL = _Size(
    suites=("paper", "random-10", "random-20", "random-30", "fast-10", "rooms", "crowd"),
    functions=tuple(FUNCTIONS),
    planners=tuple(method.value for method in Method),
    optimizers=_OPTIMIZERS,
    budgets=(25, 150, 1000),
    worlds=500,
    runs=500,
)
QUICK = _Size(
    suites=("paper", "random-10"),
    functions=("F1", "F5"),
    planners=("paper",),
    optimizers=_OPTIMIZERS,
    budgets=(25, 150),
    worlds=20,
    runs=30,
)


def main(args: list[str]) -> int:
    """Run the comparison."""
    parsed = _parser().parse(args)
    check_workers(parsed.workers)
    spec, functions = _specs(parsed)
    page = None if parsed.update is None else read_page(parsed.update, [_BLOCK])
    directory = parsed.out or new_run_directory(stem="compare")
    in_worlds, on_functions = spec.chunks(), functions.chunks()
    chunks = [*in_worlds, *on_functions]
    facts = {**spec.facts(), **functions.facts()}
    store = Store(directory, chunks, facts, command="mfba compare", packages=(*PACKAGES, "paper"))
    with executor_at(parsed.scheduler) as executor, progress(chunks, directory) as done:
        found = compute(
            chunks, workers=parsed.workers, executor=executor, store=store, done=done,
            warn=print_status,
        )  # fmt: skip
    rows, timings = rows_of(spec, found)
    more_rows, more_timings = optimizers_on_functions.rows_of(on_functions, found)
    rows, timings = rows + more_rows, timings + more_timings
    result = groups(rows, timings, spec.against, oracle=not parsed.no_oracle)
    write(directory / "table.csv", rows, TABLE)
    write(directory / "timings.csv", timings, TIMING_TABLE)
    lines = _facts(spec, functions, parsed, sorted_hash(rows))
    names = _report(result, spec, lines, directory)
    if page is not None:
        _update(parsed.update, page, result, spec, lines, directory)
    print(f"wrote {directory}: {', '.join(['table.csv', 'timings.csv', *names])}")
    print(f"sorted hash {sorted_hash(rows)}")
    return 0


def _parser() -> Parser:
    lines = [f"  {name:<19} {meaning}" for name, (_, meaning) in TABLE.items()]
    parser = Parser(
        prog="mfba compare",
        description=_DESCRIPTION,
        epilog="columns of the table:\n" + "\n".join(lines),
    )
    parser.add_argument(
        "where", nargs="*", metavar="SUITE | FUNCTION",
        help=f"any of {', '.join(suite_names())}, {', '.join(FUNCTIONS)} "
        f"(default: {' '.join((*FULL.suites, *FULL.functions))})",
    )  # fmt: skip
    parser.add_argument(
        "--optimizer", action="append", metavar="NAME", dest="optimizers",
        help=f"{', '.join(NAMES)}, or MODULE:NAME; to be repeated (default: "
        f"{' '.join(FULL.optimizers)})",
    )  # fmt: skip
    parser.add_argument(
        "--against", metavar="NAME",
        help="the optimiser that the others are compared with (default: the first)",
    )  # fmt: skip
    parser.add_argument(
        "--planner", action="append", choices=[method.value for method in Method],
        dest="planners", help="may be repeated (default: both)",
    )  # fmt: skip
    parser.add_argument(
        "--budget", action="append", type=int, metavar="N", dest="budgets",
        help="evaluations per decision, a multiple of the population; may be repeated (default: "
        f"{' '.join(map(str, FULL.budgets))})",
    )  # fmt: skip
    for name, default, what in (
        ("--worlds", FULL.worlds, "worlds per suite"),
        ("--runs", FULL.runs, "seeds per function"),
        ("--first", 0, "number of the first world"),
        ("--seeds", 1, "seeds per world"),
    ):
        parser.add_argument(
            name, type=int, metavar="N", help=f"{what} (default: {default})",
            default=default if name in ("--first", "--seeds") else None,
        )  # fmt: skip
    parser.add_argument(
        "--quick", action="store_true",
        help=f"by default {' '.join((*QUICK.suites, *QUICK.functions))}, planner "
        f"{' '.join(QUICK.planners)}, {QUICK.worlds} worlds, {QUICK.runs} seeds per function, "
        f"budgets {' '.join(map(str, QUICK.budgets))}: about a minute, wide intervals",
    )  # fmt: skip
    parser.add_argument(
        "--no-oracle", action="store_true",
        help="no optimum: losses against the straight line from start to goal",
    )  # fmt: skip
    parser.add_argument(
        "--patience", type=float, default=PATIENCE_S, metavar="S",
        help=f"wall time, s, after which a run counts as hung (default: {PATIENCE_S:g})",
    )  # fmt: skip
    add_set_argument(parser)
    parser.add_argument(
        "--update", type=Path, metavar="PAGE",
        help="also fill the generated block of this Markdown page, and write its pictures into "
        "images/ beside it",
    )  # fmt: skip
    add_study_arguments(parser)
    return parser


def _specs(parsed: argparse.Namespace) -> tuple[ComparisonSpec, FunctionSpec]:
    size = QUICK if parsed.quick else FULL
    for name in parsed.where:
        if name not in (known := [*suite_names(), *FUNCTIONS]):
            raise ConfigError(f"{name!r}: no such suite or function; {did_you_mean(name, known)}")
    for text in parsed.settings:
        if (name := text.partition("=")[0]) in _VARIED:
            option = "--optimizer" if name == OPTIMIZER else "--budget"
            raise ConfigError(f"--set {text}: a comparison varies it; give {option}")
    suites = [name for name in parsed.where if name in suite_names()]
    functions = [name for name in parsed.where if name in FUNCTIONS]
    if not parsed.where:
        suites, functions = list(size.suites), list(size.functions)
    optimizers = tuple(parsed.optimizers or size.optimizers)
    against = parsed.against or optimizers[0]
    check_optimizers(optimizers, against)
    budgets = tuple(parsed.budgets or size.budgets)
    planners = tuple(parsed.planners or size.planners)
    spec = ComparisonSpec(
        sweeps=tuple(_sweep(name, planners, parsed, size) for name in suites),
        optimizers=optimizers,
        budgets=budgets,
        against=against,
    )
    params, _ = with_settings(PlannerParams(), SensorParams(), parsed.settings)
    return spec, FunctionSpec(
        functions=tuple(dict.fromkeys(functions)),
        optimizers=optimizers,
        budgets=budgets,
        seeds=size.runs if parsed.runs is None else parsed.runs,
        bat=params.bat,
        patience_s=parsed.patience,
    )


def _sweep(
    name: str, planners: tuple[str, ...], parsed: argparse.Namespace, size: _Size
) -> SweepSpec:
    """What `mfba sweep` would run in a suite."""
    setting = default_setting(name)
    own = {
        planner: with_settings(
            own_preset(planner, setting.params), SensorParams(), parsed.settings
        )
        for planner in planners
    }
    sensor = own[planners[0]][1]
    return SweepSpec(
        suite=name,
        planners=planners,
        worlds=size.worlds if parsed.worlds is None else parsed.worlds,
        first=parsed.first,
        # The paper's cases are repeated as worlds, each time with the next seed.
        seeds=1 if suite(name).distinct else parsed.seeds,
        oracle=not parsed.no_oracle,
        setting=replace(setting, sensor=sensor, patience_s=parsed.patience),
        own={planner: params for planner, (params, _) in own.items()},
    )


def _facts(
    spec: ComparisonSpec, functions: FunctionSpec, parsed: argparse.Namespace, table_hash: str
) -> list[str]:
    """Lines about what was run, for the report."""
    libraries = spec.facts()["libraries"]
    return [
        f"`{command_line(parsed)}`",
        *(
            f"{sweep.suite}: {sweep.worlds} worlds from {sweep.first} on, {sweep.seeds} "
            f"seed{'s' * (sweep.seeds > 1)} each, perception {sweep.setting.perception}, robot "
            f"{sweep.setting_of(sweep.planners[0]).params.speed_mps:g} m/s"
            for sweep in spec.sweeps
        ),
        *(
            [f"{' '.join(functions.functions)}: {functions.seeds} seeds"]
            if functions.functions
            else []
        ),
        *(f"{name} {version}" for name, version in libraries.items()),
        f"sorted hash of the table `{table_hash}`",
    ]


def _report(
    found: Sequence[Group],
    spec: ComparisonSpec,
    facts: list[str],
    directory: Path,
) -> list[str]:
    """Write report, figures and data; print the verdicts."""
    from ..report import style
    from ..report.comparison_tables import overall, to_json, to_markdown, verdict
    from ..report.figure_sheet import to_bytes
    from ..report.figures.comparison_pictures import draw_budgets, draw_ranks

    with style.context():
        drawn = [to_bytes(draw(found), "png") for draw in (draw_ranks, draw_budgets)]
    title = f"Comparison of {len(spec.optimizers)} optimisers"
    data = json.dumps(to_json(found, spec.against), indent=1, sort_keys=True) + "\n"
    files = {
        "comparison.json": data.encode(),
        **dict(zip(_PICTURES, drawn)),
        "report.md": to_markdown(found, spec.against, title, facts, _PICTURES).encode(),
    }
    for name, content in files.items():
        write_same(directory / name, content)
    for group in found:
        print(f"{group.title}: {verdict(group)}")
    print(overall(found, spec.against))
    return list(files)


def _update(
    path: Path,
    page: str,
    found: Sequence[Group],
    spec: ComparisonSpec,
    facts: list[str],
    directory: Path,
) -> None:
    """Replace the pictures and the generated block of a page."""
    from ..report.comparison_tables import page_block
    from ..report.tables.markdown import fill

    (path.parent / "images").mkdir(exist_ok=True)
    names = []
    for name in _PICTURES:
        names.append(f"images/{path.stem}-{name}")
        replace_file(path.parent / names[-1], read_input(directory / name))
    block = page_block(found, spec.against, facts, names)
    replace_file(path, fill(page, {_BLOCK: block}).encode())


def command_line(parsed: argparse.Namespace) -> str:
    """The command line of these arguments, without workers and directory."""
    words = ["mfba", "compare", *parsed.where]
    words += ["--quick"] * parsed.quick + ["--no-oracle"] * parsed.no_oracle
    for option, values in (
        ("--optimizer", parsed.optimizers),
        ("--against", parsed.against and [parsed.against]),
        ("--planner", parsed.planners),
        ("--budget", parsed.budgets),
        ("--set", parsed.settings),
    ):
        for value in values or ():
            words += [option, str(value)]
    for option, value, unset in (
        ("--worlds", parsed.worlds, None),
        ("--runs", parsed.runs, None),
        ("--first", parsed.first, 0),
        ("--seeds", parsed.seeds, 1),
        ("--patience", parsed.patience, PATIENCE_S),
    ):
        if value != unset:
            words += [option, str(value)]
    return shlex.join(words)
