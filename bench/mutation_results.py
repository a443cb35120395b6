# SPDX-License-Identifier: Apache-2.0
"""Results of mutants in a file, a line of JSON each, so that a run can be stopped and resumed."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from enum import Enum
from functools import cache
from pathlib import Path

from mutant_process import ROOT, module_path, tests_of


class Fate(str, Enum):
    """What became of a mutant."""

    KILLED = "killed"
    TIMEOUT = "time or memory ran out"
    SURVIVED = "survived"


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """The fate of one mutant; number counts the mutants of its module."""

    module: str
    number: int
    line: int
    change: str
    fate: Fate
    source: str
    tests: str


@cache
def digests(module: str) -> tuple[str, str]:
    """Digests of a module's source and of its tests."""
    tests = [(ROOT / "test" / f"{name}.py").read_bytes() for name in tests_of(module)]
    source = hashlib.sha256(module_path(module).read_bytes()).hexdigest()[:12]
    return source, hashlib.sha256(b"".join(tests)).hexdigest()[:12]


def read_results(path: Path) -> dict[tuple[str, int], Result]:
    """What still holds of a file: of the same source, and of a survivor with the same tests."""
    found = {}
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
        values = json.loads(line)
        result = Result(**{**values, "fate": Fate(values["fate"])})
        if not module_path(result.module).exists():
            continue
        source, tests = digests(result.module)
        if result.source == source and (result.fate is not Fate.SURVIVED or result.tests == tests):
            found[result.module, result.number] = result
    return found


def append(path: Path, result: Result) -> None:
    """Add a result to the file."""
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(asdict(result)) + "\n")


def table(results: Iterable[Result]) -> list[str]:
    """Each survivor, and per room how many were found."""
    results = sorted(results, key=lambda result: (result.module, result.line, result.number))
    lines = [
        f"{result.module}.py:{result.line}: {result.change}"
        for result in results
        if result.fate is Fate.SURVIVED
    ]
    count = Counter(result.module.partition("/")[0] for result in results)
    left = Counter(r.module.partition("/")[0] for r in results if r.fate is Fate.SURVIVED)
    for room, of in [*sorted(count.items()), ("all", count.total())]:
        survived = left.total() if room == "all" else left[room]
        share = 100.0 * (of - survived) / max(of, 1)
        lines.append(f"{room:12} {of:5} mutants, {survived:4} survived, score {share:.1f} %")
    return lines
