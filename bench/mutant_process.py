# SPDX-License-Identifier: Apache-2.0
"""The tests of a mutant, in a forked process of its own; no file is changed."""

from __future__ import annotations

import ast
import importlib.abc
import importlib.machinery
import os
import re
import resource
import signal
import sys
from functools import cache
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
_CLOSEST = {
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
    "recording/tick_table": ["cli/test_cli_export"],
    **{
        f"recording/{name}": ["recording/test_bag_formats"]
        for name in ("library_file", "ros1_file", "rosbags_definitions", "sqlite_file")
    },
    "recording/params_file": ["cli/test_cli_decide"],
}  # fmt: skip
# Without processes and DDS, so that a test is a matter of seconds.
_FAST = (
    "core", "swarm", "optimizers", "perception", "planning", "simulation", "scenarios",
    "evaluation", "recording", "verification",
)  # fmt: skip
_MOST_FILES = 5
# Behind the closest: short runs of every kind, which notice what moves a robot.
_RUNS = "simulation/test_stored_runs"
_MOVING = ("swarm", "perception", "planning", "simulation")
SLOW = "not 200_seeds and not fig_1_runs_both"
TIMEOUT_S = 120  # of CPU; a busy machine kills no mutant
MEMORY = (
    8 * 2**30
)  # bytes of addresses, as threads reserve much; a mutant may allocate without end


def module_path(module: str) -> Path:
    """The file of a module given below the package, such as `planning/gap_vector`."""
    return PACKAGE / f"{module}.py"


@cache
def tests_of(module: str) -> tuple[str, ...]:
    """Files below test/ that import the module, the closest first; else those of its importers.

    Closest is a file of the same name, then one of the same room, then the one that imports least.
    Stored runs come last. ValueError for a module that none of them reaches.
    """
    runs = (_RUNS,) if module.startswith(_MOVING) else ()
    found = (*(_CLOSEST.get(module) or _nearest(module)), *runs)
    if not found:
        raise ValueError(f"{module}: no test; name one in _CLOSEST")
    return tuple(dict.fromkeys(found))


def _nearest(module: str) -> list[str]:
    level, known, found = [module], {module}, list[str]()
    while level and not found:
        found = [test for name in level for test in _importing_tests(name)]
        level = [name for one in level for name in _importers(one) if name not in known]
        known.update(level)
    return list(dict.fromkeys(found))[:_MOST_FILES]


def _importing_tests(module: str) -> list[str]:
    room, _, name = module.rpartition("/")
    dotted = room.replace("/", r"\.")
    named = re.compile(
        rf"\bmfba_planner\.{dotted}\.{name}\b|from mfba_planner\.{dotted} import [^\n]*\b{name}\b"
    )
    found = []
    for folder in _FAST:
        for path in sorted((ROOT / "test" / folder).glob("test_*.py")):
            text = path.read_text(encoding="utf-8")
            if named.search(text):
                far = path.stem != f"test_{name}", folder != room.partition("/")[0]
                found.append((*far, text.count("import"), f"{folder}/{path.stem}"))
    return [test for *_, test in sorted(found)]


def _importers(module: str) -> list[str]:
    """The modules of the package that import this one."""
    name = module.rpartition("/")[2]
    named = rf"^ *from [\w.]*\.{name} import|^ *from \.[\w.]* import .*\b{name}\b"
    # Planners and readers of bags are loaded by the name in a string.
    return _that_hold(named) or _that_hold(rf"\"(?:[\w.]*\.)?{name}[:\"]")


def _that_hold(expression: str) -> list[str]:
    """The modules of the package with a match of a regular expression."""
    pattern = re.compile(expression, re.MULTILINE)
    return [
        str(path.relative_to(PACKAGE).with_suffix(""))
        for path in sorted(PACKAGE.rglob("*.py"))
        if pattern.search(path.read_text(encoding="utf-8"))
    ]


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


def start(module: str, tree: ast.Module, *plugins: Any) -> int:
    """Start the tests against a mutant in a process of its own; return its id."""
    pid = os.fork()
    if pid:
        return pid
    resource.setrlimit(resource.RLIMIT_CPU, (TIMEOUT_S, TIMEOUT_S))
    signal.alarm(20 * TIMEOUT_S)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)
    path, name = module_path(module), f"mfba_planner.{module.replace('/', '.')}"
    sys.path.insert(0, str(ROOT))
    sys.meta_path.insert(0, _MutantImporter(name, path, tree))
    files = [str(ROOT / "test" / f"{test}.py") for test in tests_of(module)]
    arguments = ["-x", "-q", "--assert=plain", "-p", "no:cacheprovider", "-k", SLOW]
    code = 1
    try:
        code = int(pytest.main([*arguments, *files], plugins=[_FewExamples(), *plugins]))
    finally:
        os._exit(code)
