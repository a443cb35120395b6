# SPDX-License-Identifier: Apache-2.0
"""Benchmark for docs/benchmark.md: every suite, planner, perception and ingredient, and its cost.

Every suite in the open: places (rooms, barn-like, crowd) only if named by --suite.

    pip install -e .[orca]
    python bench/benchmark.py --worlds 10000     # the whole thing; some hours on two cores
    python bench/benchmark.py --out DIR          # small; continues where it was interrupted

Every sweep has a directory below --out, which `mfba show` reads. The optima of a suite have
another, since they do not depend on any planner. The figures also go to docs/benchmark.json, and
from there into the table of the README.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from benchmark_costs import measure_costs, measure_rates
from benchmark_page import PER_MINUTE, render
from benchmark_pictures import write_pictures
from benchmark_results import FILE, facts, to_json, with_table
from benchmark_runs import HEADLINE, Counts, Results, print_line

from mfba_planner.core.output_files import new_run_directory
from mfba_planner.evaluation.study.compute_chunks import initialize_worker
from mfba_planner.evaluation.suites import suite, suite_names

ROOT = Path(__file__).parents[1]
IN_THE_OPEN = [name for name in suite_names() if suite(name).in_the_open]
RATE_WORLDS = 2000  # runs by which episodes per minute are measured
BEGIN_MARK, END_MARK = "<!-- generated: begin -->\n", "<!-- generated: end -->\n"


@contextmanager
def _pool(workers: int) -> Iterator[Executor | None]:
    """One pool for all sweeps: starting one for each would take longer than many of them."""
    if workers == 1:
        yield None
        return
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(workers, context, initializer=initialize_worker)
    try:
        yield pool
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def arguments() -> argparse.ArgumentParser:
    """Scale, output, workers."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument(
        "--worlds", type=int, default=20, metavar="N",
        help=f"of paper, predictive, orca and dwa in {', '.join(HEADLINE)}; seeds of each of the "
        "paper's cases, 1000 at most (default: 20)",
    )  # fmt: skip
    parser.add_argument(
        "--first", type=int, default=0, metavar="N", help="first world of every suite (default: 0)"
    )
    parser.add_argument("--others", type=int, metavar="N", help="in other suites (default: all)")
    parser.add_argument(
        "--few", type=int, metavar="N",
        help="of other planners and of ingredients (default: a tenth of --worlds)",
    )  # fmt: skip
    parser.add_argument(
        "--seen", type=int, metavar="N", help="of other perceptions (default: as --few)"
    )
    parser.add_argument(
        "--suite",
        action="append",
        choices=suite_names(),
        help="only this; may be repeated (default: those in the open)",
    )
    parser.add_argument("--rounds", type=int, default=200, help="of the measurement of cost")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--out", type=Path, metavar="DIR", help="directory to make or to go on in")
    parser.add_argument(
        "--docs", type=Path, default=ROOT / "docs", metavar="DIR",
        help="where benchmark.md, benchmark.json and images/ are; README.md is beside this "
        "directory (default: the project's)",
    )  # fmt: skip
    return parser


def main(args: list[str] | None = None) -> None:
    """Make all and write the page."""
    found = arguments().parse_args(args)
    if min(found.worlds, found.others or 2, found.few or 2, found.seen or 2) < 2:
        arguments().error("--worlds, --others, --few, --seen: give at least 2")
    if found.first < 0:
        arguments().error("--first: give at least 0")
    few = found.few or max(2, found.worlds // 10)
    counts = Counts(
        worlds=found.worlds,
        others=found.others or found.worlds,
        few=few,
        perception_worlds=found.seen or few,
    )
    suites = [name for name in suite_names() if name in (found.suite or IN_THE_OPEN)]
    out = found.out or new_run_directory(stem="benchmark")
    target = found.docs / "benchmark.md"
    _between(target.read_text(encoding="utf-8"), "")  # before the work is done
    print_line(f"results go to {out}")
    with _pool(found.workers) as executor:
        results = Results(out, found.workers, executor, found.first)
        results.make_all(suites, counts)
        worlds = min(counts.worlds, RATE_WORLDS)
        rates = measure_rates(tuple(PER_MINUTE), worlds, found.workers, executor)
    costs = measure_costs(found.rounds)
    images = found.docs / "images"
    images.mkdir(exist_ok=True)
    examples = write_pictures(results, suites, counts, costs, images)
    text = render(results, suites, counts, costs, rates, examples, _command(found))
    target.write_text(_between(target.read_text(encoding="utf-8"), text), encoding="utf-8")
    figures = facts(results, suites, counts, _command(found))
    (found.docs / FILE).write_text(to_json(figures), encoding="utf-8")
    readme = found.docs.absolute().parent / "README.md"
    if readme.is_file():
        readme.write_text(with_table(readme.read_text(encoding="utf-8"), figures), "utf-8")
    print(text)


def _command(found: argparse.Namespace) -> str:
    words = [f"--worlds {found.worlds}"]
    given = ("first", "others", "few", "seen", "out")
    words += [f"--{k} {v}" for k in given if (v := getattr(found, k))]
    words += [f"--suite {name}" for name in found.suite or ()]
    words += [f"--rounds {found.rounds}", f"--workers {found.workers}"]
    return " ".join(["python bench/benchmark.py", *words])


def _between(text: str, generated: str) -> str:
    before, _, rest = text.partition(BEGIN_MARK)
    _, found, after = rest.partition(END_MARK)
    if not found:
        raise SystemExit(
            f"benchmark.md: lacks the lines {BEGIN_MARK.strip()} and {END_MARK.strip()}"
        )
    return before + BEGIN_MARK + generated + END_MARK + after


if __name__ == "__main__":
    main()
