# SPDX-License-Identifier: Apache-2.0
"""Mutation test of the paper's equations: change each line, name the test that fails.

    .venv/bin/python bench/equations.py          # one change per line
    .venv/bin/python bench/equations.py --all    # every change that bench/mutation.py knows

The lines are those marked `# eq. N` in mfba_planner/swarm: eq. 3-10 for one swarm (two dimensions
unrolled, and any dimension) and again for batched swarms. Exit code 1 if a change goes unnoticed.
"""

from __future__ import annotations

import argparse
import ast
import os
import re
import sys
from collections.abc import Iterator, Sequence
from typing import Any

from mutant_process import module_path, start
from mutants import mutants

MODULES = ("swarm/bat_swarm", "swarm/swarm_iteration", "swarm/batched_swarms")
_DELETED = "the line, deleted"
MARK = re.compile(r"# eq\. (\d+)$")


class _FailureReporter:
    """A pytest plugin that writes the name of each failed test into a pipe."""

    def __init__(self, pipe: int) -> None:
        self.pipe = pipe

    def pytest_runtest_logreport(self, report: Any) -> None:
        """Called by pytest after each phase of a test."""
        if report.failed:
            os.write(self.pipe, f"{report.nodeid.partition('::')[2]}\n".encode())

    def pytest_collectreport(self, report: Any) -> None:
        """Called by pytest where a file of tests cannot even be read."""
        if report.failed:
            os.write(self.pipe, b"(the tests do not load)\n")


def first_failure(module: str, tree: ast.Module) -> str:
    """Name of the test that fails first, "" for none."""
    reading, writing = os.pipe()
    pid = start(module, tree, _FailureReporter(writing))
    os.close(writing)
    with os.fdopen(reading) as lines:
        names = lines.read().split("\n")
    _, status = os.waitpid(pid, 0)
    return names[0] or ("" if status == 0 else "(time or memory ran out)")


def changes(module: str, every: bool) -> Iterator[tuple[int, int, str, ast.Module]]:
    """Yield (equation, line, what was changed, changed tree)."""
    text = module_path(module).read_text()
    marks = {
        number: int(found[1])
        for number, line in enumerate(text.splitlines(), start=1)
        if (found := MARK.search(line))
    }
    chosen: dict[int, tuple[str, ast.Module]] = {}
    for line, change, tree in mutants(ast.parse(text)):
        before, _, after = change.partition("  ->  ")
        deleted = before == after  # of a statement with a body only the head is shown
        if line not in marks:
            continue
        if every:
            yield marks[line], line, _DELETED if deleted else change, tree
        elif line not in chosen or chosen[line][0] == _DELETED:
            chosen[line] = _DELETED if deleted else change, tree
    for line, (change, tree) in chosen.items():
        yield marks[line], line, change, tree


def main(argv: Sequence[str]) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--all", action="store_true", help="every change of every line")
    options = parser.parse_args(argv)
    rows = []
    for module in MODULES:
        for equation, line, change, tree in changes(module, options.all):
            rows.append((equation, f"{module}.py:{line}", change, first_failure(module, tree)))
            print(".", end="", file=sys.stderr, flush=True)
    print("", file=sys.stderr)
    print("| eq. | line | change | first test that fails |\n|---|---|---|---|")
    for equation, location, change, test in sorted(rows, key=lambda row: row[0]):
        print(f"| {equation} | {location} | `{change}` | {test or '**none**'} |")
    missed = [row for row in rows if not row[3]]
    print(f"\n{len(rows)} changes, {len(missed)} unnoticed")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
