# SPDX-License-Identifier: Apache-2.0
"""Mutation test: change one operator, number or statement at a time; list what no test notices.

    .venv/bin/python bench/mutation.py --out runs/mutation.jsonl              # all five rooms
    .venv/bin/python bench/mutation.py --sample 100 --budget 600              # a random sample
    .venv/bin/python bench/mutation.py planning/gap_vector swarm --jobs 2     # module, room

A developer's tool, not part of the suite. Each mutant runs in a forked process of its own; no
file is changed. With --out a run that was stopped goes on where it was, and only what has changed
is run again. A survivor is a missing test, or a change without an effect.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

from mutant_process import PACKAGE, module_path, start
from mutants import Change, mutant, sites
from mutation_results import Fate, Result, append, digests, read_results, table

ROOMS = ("swarm", "perception", "planning", "simulation", "recording")


def modules_of(names: Sequence[str]) -> list[str]:
    """The modules of rooms and modules, sorted. ValueError for a name that is neither."""
    found = set()
    for name in names:
        if module_path(name).is_file():
            found.add(name)
        elif (PACKAGE / name).is_dir():
            paths = (PACKAGE / name).rglob("*.py")
            files = [path for path in paths if path.name != "__init__.py"]
            found |= {str(path.relative_to(PACKAGE).with_suffix("")) for path in files}
        else:
            raise ValueError(f"{name}: no module or room below mfba_planner/")
    return sorted(found)


@cache
def _tree(module: str) -> ast.Module:
    return ast.parse(module_path(module).read_text(encoding="utf-8"))


@cache
def _sites(module: str) -> list[tuple[int, Change]]:
    return list(sites(_tree(module)))


class _Processes:
    """Mutants that run, at most so many at a time."""

    def __init__(self) -> None:
        self._running: dict[int, Result] = {}

    def __len__(self) -> int:
        return len(self._running)

    def add(self, module: str, number: int) -> None:
        """Start the tests of a mutant."""
        line, change, tree = mutant(_tree(module), *_sites(module)[number])
        source, tests = digests(module)
        self._running[start(module, tree)] = Result(
            module=module, number=number, line=line, change=change, fate=Fate.SURVIVED,
            source=source, tests=tests,
        )  # fmt: skip

    def wait(self) -> Result:
        """The next result."""
        pid, status = os.wait()
        result = self._running.pop(pid)
        if status == 0:
            return result
        # pytest's own exit codes; the alarm and the kernel end a process by a signal.
        return replace(result, fate=Fate.KILLED if os.WIFEXITED(status) else Fate.TIMEOUT)


def _passes(module: str) -> bool:
    """Whether the tests of a module pass without a mutation."""
    _, status = os.waitpid(start(module, _tree(module)), 0)
    return status == 0


def main(argv: Sequence[str]) -> int:
    """Print the survivors and the scores; 1 where tests fail without a mutation, or below."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("names", nargs="*", default=list(ROOMS), help="rooms or modules")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--sample", type=int, help="so many mutants, drawn at random")
    parser.add_argument("--seed", type=int, default=0, help="of the sample and the sequence")
    parser.add_argument(
        "--budget", type=float, default=1e9, help="start no mutant after so many s"
    )
    parser.add_argument("--out", type=Path, help="file of results, kept and resumed")
    parser.add_argument("--at-least", type=float, default=0.0, help="score in percent that passes")
    options = parser.parse_args(argv)
    try:
        modules = modules_of(options.names)
    except ValueError as error:
        parser.error(str(error))
    every = [(module, number) for module in modules for number in range(len(_sites(module)))]
    random.Random(options.seed).shuffle(every)
    chosen = every[: options.sample]
    print(f"{len(chosen)} of {len(every)} mutants of {len(modules)} modules", flush=True)
    known = read_results(options.out) if options.out else {}
    results = {key: known[key] for key in chosen if key in known}
    faulty = _run([key for key in chosen if key not in results], results, options)
    print("\n".join(table(results.values())))
    if len(results) < len(chosen):
        print(f"{len(chosen) - len(results)} were not run; give --out and run again")
    for module in faulty:
        print(f"{module}: its tests fail without any mutation; fix them first")
    killed = sum(result.fate is not Fate.SURVIVED for result in results.values())
    return int(bool(faulty) or 100.0 * killed < options.at_least * len(results))


def _run(
    keys: Sequence[tuple[str, int]],
    results: dict[tuple[str, int], Result],
    options: argparse.Namespace,
) -> set[str]:
    """Run mutants until the budget is spent; return the modules whose tests fail without one."""
    deadline = time.monotonic() + options.budget
    waiting, running = list(reversed(keys)), _Processes()
    passes: dict[str, bool] = {}
    while waiting or len(running):
        while waiting and len(running) < options.jobs:
            if time.monotonic() > deadline:
                waiting.clear()
                break
            module, number = waiting.pop()
            if module not in passes:
                # Alone: os.wait() would take it for a mutant.
                while len(running):
                    _keep(running.wait(), results, options.out)
                passes[module] = _passes(module)
            if passes[module]:
                running.add(module, number)
        if len(running):
            _keep(running.wait(), results, options.out)
    return {module for module, passed in passes.items() if not passed}


def _keep(result: Result, results: dict[tuple[str, int], Result], path: Path | None) -> None:
    results[result.module, result.number] = result
    if path:
        append(path, result)
    if result.fate is Fate.SURVIVED:
        print(f"{result.module}.py:{result.line}: {result.change}", flush=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
