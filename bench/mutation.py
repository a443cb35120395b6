# SPDX-License-Identifier: Apache-2.0
"""Mutation test: change one operator, number or statement at a time; list what no test notices.

    .venv/bin/python bench/mutation.py                              # every module in TESTS
    .venv/bin/python bench/mutation.py planning/gap_vector --jobs 2 # one of them

A developer's tool, not part of the suite. Each mutant runs in a forked process of its own;
no file is changed. A survivor is a missing test, or a change without an effect.
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
PACKAGE = ROOT / "mfba_planner"
# By module, as a path below mfba_planner/: its test files below test/, the closest first.
TESTS = {
    "swarm/bat_swarm": [
        "swarm/test_bat_swarm", "core/test_option_specs", "planning/test_algorithm_1",
        "simulation/test_episode",
    ],
    "swarm/bat_params": ["core/test_option_specs", "swarm/test_bat_swarm"],
    "swarm/swarm_iteration": ["swarm/test_bat_swarm", "planning/test_algorithm_1"],
    "swarm/search_region": ["swarm/test_bat_swarm", "planning/test_algorithm_1"],
    "swarm/objective_failures": ["swarm/test_bat_swarm"],
    "swarm/batched_swarms": ["swarm/test_batched_swarms"],
    "swarm/optimizer": ["swarm/test_optimizer"],
    "optimizers/baselines": ["optimizers/test_baselines"],
    "optimizers/registry": ["optimizers/test_registry"],
    "perception/sensory_vector": [
        "perception/test_sensory_vector", "core/test_option_specs",
        "planning/test_algorithm_1", "simulation/test_episode",
    ],
    "planning/gap_vector": [
        "planning/test_gap_vector", "planning/test_algorithm_1", "simulation/test_episode",
    ],
    "planning/algorithm_1": [
        "planning/test_algorithm_1", "core/test_option_specs", "simulation/test_episode",
    ],
    "simulation/obstacle_motion": [
        "simulation/test_scenario_and_motion", "simulation/test_episode",
    ],
    "simulation/scenario": ["simulation/test_scenario_and_motion", "simulation/test_episode"],
    "simulation/run_episode": ["simulation/test_episode", "planning/test_algorithm_1"],
    "evaluation/metrics": ["simulation/test_episode"],
    "core/geometry": [
        "core/test_geometry", "simulation/test_scenario_and_motion",
        "perception/test_sensory_vector", "planning/test_gap_vector",
        "planning/test_algorithm_1", "simulation/test_episode",
    ],
    "core/option_specs": ["core/test_option_specs"],
}  # fmt: skip
SLOW = "not 200_seeds and not fig_1_runs_both"
TIMEOUT_S = 120
MEMORY = 2 * 2**30  # bytes; a mutant may allocate without end

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
OPPOSITES = {
    "min": "max", "max": "min", "cos": "sin", "sin": "cos", "floor": "ceil", "ceil": "floor",
    "any": "all", "all": "any",
}  # fmt: skip


def mutants(tree: ast.Module) -> Iterator[tuple[int, str, ast.Module]]:
    """Yield (line, what was changed, changed tree), one change each."""
    skipped = {id(node) for root in _annotations(tree) for node in ast.walk(root)}
    for index, node in enumerate(ast.walk(tree)):
        for change in _changes(node) if id(node) not in skipped else ():
            mutant = copy.deepcopy(tree)
            target: Any = next(n for i, n in enumerate(ast.walk(mutant)) if i == index)
            before = ast.unparse(target).split("\n")[0]
            change(target)
            after = ast.unparse(target).split("\n")[0]
            yield target.lineno, f"{before}  ->  {after}", ast.fix_missing_locations(mutant)


def _annotations(tree: ast.Module) -> Iterator[ast.AST]:
    """Yield type annotations and decorators: changing them has no effect on values."""
    for node in ast.walk(tree):
        yield from getattr(node, "decorator_list", [])
        for name in ("annotation", "returns"):
            if getattr(node, name, None) is not None:
                yield getattr(node, name)


def _changes(node: ast.AST) -> Iterator[Any]:
    """Yield functions that each break one thing in a node of this shape."""
    if isinstance(node, ast.Compare):
        for index, op in enumerate(node.ops):
            for other in SWAPS[type(op)]:
                yield lambda n, i=index, o=other: n.ops.__setitem__(i, o())
    elif isinstance(node, (ast.BinOp, ast.BoolOp, ast.AugAssign)):
        for other in SWAPS.get(type(node.op), []):
            yield lambda n, o=other: setattr(n, "op", o())
    elif isinstance(node, ast.UnaryOp):
        yield lambda n: _replace(n, n.operand)
    elif isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
        if isinstance(node.value, bool):
            yield lambda n: setattr(n, "value", not n.value)
        else:
            yield lambda n: setattr(n, "value", n.value + 1)
            yield lambda n: setattr(n, "value", n.value / 2 if n.value % 2 else n.value // 2 - 1)
    elif isinstance(node, ast.Call):
        name = node.func.attr if isinstance(node.func, ast.Attribute) else ""
        name = node.func.id if isinstance(node.func, ast.Name) else name
        if name in OPPOSITES:
            yield lambda n: _rename(n.func, OPPOSITES[name])
    elif isinstance(node, (ast.If, ast.IfExp, ast.While)):
        yield lambda n: setattr(n, "test", ast.UnaryOp(ast.Not(), n.test))
    elif isinstance(node, (ast.FunctionDef, ast.For, ast.With)):
        for index, line in enumerate(node.body):
            docstring = isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant)
            if isinstance(line, (ast.Assign, ast.AugAssign, ast.Expr)) and not docstring:
                yield lambda n, i=index: _delete(n, i)


def _replace(node: Any, other: ast.AST) -> None:
    node.__class__ = other.__class__
    node.__dict__ = other.__dict__


def _rename(function: Any, name: str) -> None:
    setattr(function, "attr" if isinstance(function, ast.Attribute) else "id", name)


def _delete(node: Any, index: int) -> None:
    node.lineno = node.body[index].lineno
    node.body[index] = ast.Pass()


class _MutantImporter(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Imports one module from a tree instead of from its file."""

    def __init__(self, name: str, path: Path, tree: ast.Module) -> None:
        self.name, self.path, self.tree = name, path, tree

    def find_spec(self, name: str, path: Any, target: Any = None) -> Any:
        """The spec of the one module; None for any other."""
        if name != self.name:
            return None
        return importlib.machinery.ModuleSpec(name, self, origin=str(self.path))

    def exec_module(self, module: ModuleType) -> None:
        """Run the mutant."""
        exec(compile(self.tree, str(self.path), "exec"), module.__dict__)


class _FewExamples:
    """A pytest plugin: few hypothesis examples, always the same, and no shrinking."""

    def pytest_configure(self) -> None:
        """Load the profile; called after conftest.py, which loads another."""
        phases = (Phase.explicit, Phase.generate)
        settings.register_profile(
            "mutation", max_examples=40, derandomize=True, database=None, deadline=None,
            phases=phases,
        )  # fmt: skip
        settings.load_profile("mutation")


def module_path(module: str) -> Path:
    """The file of a module given as in TESTS, such as `planning/gap_vector`."""
    return PACKAGE / f"{module}.py"


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
    path, name = module_path(module), f"mfba_planner.{module.replace('/', '.')}"
    sys.path.insert(0, str(ROOT))
    sys.meta_path.insert(0, _MutantImporter(name, path, tree))
    files = [str(ROOT / "test" / f"{test}.py") for test in TESTS[module]]
    arguments = ["-x", "-q", "--assert=plain", "-p", "no:cacheprovider", "-k", SLOW]
    code = 1
    try:
        code = int(pytest.main([*arguments, *files], plugins=[_FewExamples(), *plugins]))
    finally:
        os._exit(code)


def _survivors(module: str, trees: Sequence[ast.Module], jobs: int) -> list[bool]:
    """Whether the tests pass, for each tree; `jobs` processes at a time."""
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
    parser.add_argument(
        "modules", nargs="*", default=list(TESTS), metavar="module", help=", ".join(TESTS)
    )
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args(argv)
    for module in options.modules:
        if module not in TESTS:
            parser.error(f"{module}: no such module; give one of {', '.join(TESTS)}")
    table = []
    for module in options.modules:
        tree = ast.parse(module_path(module).read_text())
        if _survivors(module, [tree], 1) != [True]:
            print(f"{module}: its tests fail without any mutation; fix them first")
            return 1
        found = list(mutants(tree))
        alive = _survivors(module, [mutant for _, _, mutant in found], options.jobs)
        for (line, change, _), survived in zip(found, alive):
            if survived:
                print(f"{module}.py:{line}: {change}", flush=True)
        table.append((module, len(found), sum(alive)))
    for module, count, left in table:
        print(f"{module:26} {count:5} mutants, {left:3} survived", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
