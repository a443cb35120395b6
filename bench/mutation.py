# SPDX-License-Identifier: Apache-2.0
"""Break the core on purpose, one small change at a time, and list what no test notices.

    .venv/bin/python bench/mutation.py                   # every module below
    .venv/bin/python bench/mutation.py gaps --jobs 2     # one of them

A developer's tool, not part of the suite. Each mutant lives in a forked process of its own;
no file is touched. A survivor is a missing test, or a change that changes nothing.
"""

from __future__ import annotations

import argparse
import ast
import copy
import importlib.abc
import importlib.machinery
import os
import resource
import signal
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

# Loaded once, here: a mutant starts with everything but the package itself in memory.
import numpy  # noqa: F401
import pydantic  # noqa: F401
import pytest
import yaml  # noqa: F401
from hypothesis import Phase, settings

ROOT = Path(__file__).resolve().parent.parent
# The tests that look at a module most closely come first.
TESTS = {
    "bat": ["bat", "options", "planner", "episode"],
    "bat_params": ["options", "bat"],
    "flight": ["bat", "planner"],
    "region": ["bat", "planner"],
    "failures": ["bat"],
    "batch": ["batch"],
    "sensing": ["sensing", "options", "planner", "episode"],
    "gaps": ["gaps", "planner", "episode"],
    "world": ["world", "episode"],
    "planner": ["planner", "options", "episode"],
    "geometry": ["geometry", "world", "sensing", "gaps", "planner", "episode"],
    "episode": ["episode", "planner"],
    "metrics": ["episode"],
    "options": ["options"],
}
SLOW = "not 200_seeds and not fig_1_runs_both"
TIMEOUT_S = 120
MEMORY = 2 * 2**30  # of a mutant that never stops to collect things

SWAPS: dict[type, list[type]] = {
    ast.Lt: [ast.LtE, ast.Gt],
    ast.LtE: [ast.Lt, ast.Gt],
    ast.Gt: [ast.GtE, ast.Lt],
    ast.GtE: [ast.Gt, ast.Lt],
    ast.Eq: [ast.NotEq],
    ast.NotEq: [ast.Eq],
    ast.Is: [ast.IsNot],
    ast.IsNot: [ast.Is],
    ast.In: [ast.NotIn],
    ast.NotIn: [ast.In],
    ast.Add: [ast.Sub],
    ast.Sub: [ast.Add],
    ast.Mult: [ast.Div],
    ast.Div: [ast.Mult],
    ast.Mod: [ast.Mult],
    ast.BitOr: [ast.BitAnd],
    ast.BitAnd: [ast.BitOr],
    ast.And: [ast.Or],
    ast.Or: [ast.And],
}
TWINS = {
    "min": "max", "max": "min", "cos": "sin", "sin": "cos", "floor": "ceil", "ceil": "floor",
    "any": "all", "all": "any",
}  # fmt: skip


def mutants(tree: ast.Module) -> Iterator[tuple[int, str, ast.Module]]:
    """Yield (line, what was changed, changed tree), one change each."""
    hints = {id(part) for hint in _annotations(tree) for part in ast.walk(hint)}
    for index, node in enumerate(ast.walk(tree)):
        for change in _changes(node) if id(node) not in hints else ():
            mutant = copy.deepcopy(tree)
            target: Any = next(n for i, n in enumerate(ast.walk(mutant)) if i == index)
            before = ast.unparse(target).split("\n")[0]
            change(target)
            after = ast.unparse(target).split("\n")[0]
            yield target.lineno, f"{before}  ->  {after}", ast.fix_missing_locations(mutant)


def _annotations(tree: ast.Module) -> Iterator[ast.AST]:
    """Types and decorators, which change nothing that a value shows."""
    for node in ast.walk(tree):
        yield from getattr(node, "decorator_list", [])
        for name in ("annotation", "returns"):
            if getattr(node, name, None) is not None:
                yield getattr(node, name)


def _changes(node: ast.AST) -> Iterator[Any]:
    """Yield functions that each break one thing in a node of this shape."""
    if isinstance(node, ast.Compare):
        for place, op in enumerate(node.ops):
            for other in SWAPS[type(op)]:
                yield lambda n, p=place, o=other: n.ops.__setitem__(p, o())
    elif isinstance(node, (ast.BinOp, ast.BoolOp, ast.AugAssign)):
        for other in SWAPS.get(type(node.op), []):
            yield lambda n, o=other: setattr(n, "op", o())
    elif isinstance(node, ast.UnaryOp):
        yield lambda n: _become(n, n.operand)
    elif isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
        if isinstance(node.value, bool):
            yield lambda n: setattr(n, "value", not n.value)
        else:
            yield lambda n: setattr(n, "value", n.value + 1)
            yield lambda n: setattr(n, "value", n.value / 2 if n.value % 2 else n.value // 2 - 1)
    elif isinstance(node, ast.Call):
        name = node.func.attr if isinstance(node.func, ast.Attribute) else ""
        name = node.func.id if isinstance(node.func, ast.Name) else name
        if name in TWINS:
            yield lambda n: _rename(n.func, TWINS[name])
    elif isinstance(node, (ast.If, ast.IfExp, ast.While)):
        yield lambda n: setattr(n, "test", ast.UnaryOp(ast.Not(), n.test))
    elif isinstance(node, (ast.FunctionDef, ast.For, ast.With)):
        for place, line in enumerate(node.body):
            docstring = isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant)
            if isinstance(line, (ast.Assign, ast.AugAssign, ast.Expr)) and not docstring:
                yield lambda n, p=place: _delete(n, p)


def _become(node: Any, other: ast.AST) -> None:
    node.__class__ = other.__class__
    node.__dict__ = other.__dict__


def _rename(function: Any, name: str) -> None:
    setattr(function, "attr" if isinstance(function, ast.Attribute) else "id", name)


def _delete(node: Any, place: int) -> None:
    node.lineno = node.body[place].lineno
    node.body[place] = ast.Pass()


class _Mutated(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Imports one module from a tree instead of from its file."""

    def __init__(self, name: str, path: Path, tree: ast.Module) -> None:
        self.name, self.path, self.tree = name, path, tree

    def find_spec(self, name: str, path: Any, target: Any = None) -> Any:
        """Answer for the one module."""
        if name != self.name:
            return None
        return importlib.machinery.ModuleSpec(name, self, origin=str(self.path))

    def exec_module(self, module: ModuleType) -> None:
        """Run the mutant."""
        exec(compile(self.tree, str(self.path), "exec"), module.__dict__)


class _Quick:
    """Few, always the same examples, and no time spent on making a failure pretty."""

    def pytest_configure(self) -> None:
        """Come after conftest.py, which loads a profile of its own."""
        phases = (Phase.explicit, Phase.generate)
        settings.register_profile(
            "mutation", max_examples=40, derandomize=True, database=None, deadline=None,
            phases=phases,
        )  # fmt: skip
        settings.load_profile("mutation")


def start(module: str, tree: ast.Module, *plugins: Any) -> int:
    """Start the tests against a mutant in a process of its own; return its id."""
    pid = os.fork()
    if pid:
        return pid
    signal.alarm(TIMEOUT_S)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)
    path = ROOT / "mfba_planner" / "core" / f"{module}.py"
    sys.path.insert(0, str(ROOT))
    sys.meta_path.insert(0, _Mutated(f"mfba_planner.core.{module}", path, tree))
    files = [str(ROOT / "test" / f"test_core_{name}.py") for name in TESTS[module]]
    arguments = ["-x", "-q", "--assert=plain", "-p", "no:cacheprovider", "-k", SLOW]
    code = 1
    try:
        code = int(pytest.main([*arguments, *files], plugins=[_Quick(), *plugins]))
    finally:
        os._exit(code)


def _survivors(module: str, trees: Sequence[ast.Module], jobs: int) -> list[bool]:
    """Tell for each tree whether the tests pass, so many at a time."""
    alive, waiting = [False] * len(trees), list(range(len(trees)))
    running: dict[int, int] = {}
    while waiting or running:
        while waiting and len(running) < jobs:
            index = waiting.pop(0)
            running[start(module, trees[index])] = index
        pid, status = os.wait()
        alive[running.pop(pid)] = status == 0
    return alive


def main(argv: Sequence[str]) -> int:
    """Print the survivors of each module, and a table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("modules", nargs="*", default=list(TESTS), metavar="module")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args(argv)
    table = []
    for module in options.modules:
        tree = ast.parse((ROOT / "mfba_planner" / "core" / f"{module}.py").read_text())
        if _survivors(module, [tree], 1) != [True]:
            print(f"{module}: its tests fail without any mutation; mend them first")
            return 1
        found = list(mutants(tree))
        alive = _survivors(module, [mutant for _, _, mutant in found], options.jobs)
        for (line, change, _), survived in zip(found, alive):
            if survived:
                print(f"{module}.py:{line}: {change}", flush=True)
        table.append((module, len(found), sum(alive)))
    for module, count, left in table:
        print(f"{module:10} {count:5} mutants, {left:3} survived", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
