# SPDX-License-Identifier: Apache-2.0
"""Modules, symbols and Python files that README, docs and CONTRIBUTING name exist."""

import re
from importlib import import_module
from importlib.util import find_spec

import pytest
from project import ROOT

TEXTS = {
    str(path.relative_to(ROOT)): path.read_text(encoding="utf-8")
    for path in (
        ROOT / "README.md",
        ROOT / "CONTRIBUTING.md",
        ROOT / "CHANGELOG.rst",
        *sorted(ROOT.glob("docs/**/*.md")),
    )
}
DOTTED = re.compile(r"\bmfba_planner(?:\.\w+)+")
# A Python file or a folder in backticks: `planning/recovery.py`, `data.py`, `swarm/`.
IN_BACKTICKS = re.compile(r"`(?:[^`\s]* )?([\w./-]+\.py|[\w-]+(?:/[\w-]+)*/)`")
OF_THE_READER = {"skirt.py", "my_swarm.py"}  # files that the reader writes
# A class, a constant or a protocol in backticks: `BasePlanner`, `ROUNDS`.
SYMBOL = re.compile(r"`([A-Z]\w{2,})`")
FOLDERS = (
    *("mfba_planner", "bench", "docs", "examples", "launch", "test", "tools", "config", "layout"),
)
EXISTING = [
    f"/{path.relative_to(ROOT)}{'/' if path.is_dir() else ''}"
    for path in (*ROOT.iterdir(), *(p for name in FOLDERS for p in (ROOT / name).rglob("*")))
]
SOURCES = "\n".join(
    path.read_text(encoding="utf-8")
    for path in (ROOT / "setup.py", *sorted((ROOT / "mfba_planner").rglob("*.py")))
)


def resolves(name: str) -> bool:
    """Whether a dotted name is a module, or a module followed by attributes."""
    module, rest = name, list[str]()
    while find_spec_of(module) is None:
        module, _, last = module.rpartition(".")
        rest.insert(0, last)
        if not module:
            return False
    found = import_module(module)
    for attribute in rest:
        if not hasattr(found, attribute):
            return False
        found = getattr(found, attribute)
    return True


def find_spec_of(module: str) -> object | None:
    try:
        return find_spec(module)
    except ModuleNotFoundError:  # a parent is not a package
        return None


def exists(name: str) -> bool:
    """Whether a file or folder of the repository has this path or ends with it."""
    return any(path.endswith(f"/{name}") for path in EXISTING)


@pytest.mark.parametrize("name", TEXTS)
def test_modules_and_symbols_exist(name: str) -> None:
    missing = sorted({found for found in DOTTED.findall(TEXTS[name]) if not resolves(found)})
    assert not missing


@pytest.mark.parametrize("name", TEXTS)
def test_python_files_and_folders_exist(name: str) -> None:
    named = set(IN_BACKTICKS.findall(TEXTS[name])) - OF_THE_READER
    missing = sorted(found for found in named if not exists(found))
    assert not missing


@pytest.mark.parametrize("name", TEXTS)
def test_symbols_occur_in_the_sources(name: str) -> None:
    named = set(SYMBOL.findall(TEXTS[name]))
    missing = sorted(found for found in named if not re.search(rf"\b{found}\b", SOURCES))
    assert not missing


def test_names_are_found_and_wrong_ones_refused() -> None:
    assert sum(len(DOTTED.findall(text)) for text in TEXTS.values()) > 10
    assert sum(len(IN_BACKTICKS.findall(text)) for text in TEXTS.values()) > 20
    assert sum(len(SYMBOL.findall(text)) for text in TEXTS.values()) > 10
    assert resolves("mfba_planner.core.planner_types.PathPlanner")
    assert not resolves("mfba_planner.core.planner_types.Absent")
    assert not resolves("mfba_planner.absent.types")
    assert exists("swarm/bat_swarm.py")
    assert not exists("core/bat_swarm.py")


@pytest.mark.parametrize("name", [name for name in TEXTS if name.startswith("docs/")])
def test_a_page_begins_with_its_readers_and_what_they_can_do_after_it(name: str) -> None:
    generated = name.startswith("docs/reference/")  # lists to look things up
    starts = re.match(r"# .+\n\n\*For [^*]+\sAfter this page you [^*]+\*\n", TEXTS[name])
    assert generated or starts, name
