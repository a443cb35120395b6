# SPDX-License-Identifier: Apache-2.0
"""docs/life-of-a-tick.md: every file and function that it names is there."""

import re

import pytest
from import_graph import PACKAGE, tree_of
from project import ROOT

PAGE = (ROOT / "docs/life-of-a-tick.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| [a-z ]+ \| `([\w/]+\.py)` \| `([\w.]+)` \|", PAGE, re.MULTILINE)


def functions(file: str) -> set[str]:
    """The functions and methods of a file, methods as Class.method."""
    found = set()
    for node in tree_of(PACKAGE / file).body:
        names = [child.name for child in getattr(node, "body", []) if hasattr(child, "name")]
        if hasattr(node, "name"):
            found |= {node.name, *(f"{node.name}.{name}" for name in names)}
    return found


@pytest.mark.parametrize(("file", "function"), ROWS)
def test_a_step_is_a_function_of_its_file(file: str, function: str) -> None:
    assert function in functions(file)


def test_every_row_of_the_tables_is_a_step() -> None:
    rows = re.findall(r"^\| (?!step|---)", PAGE, re.MULTILINE)
    assert len(rows) == len(ROWS) > 20


def test_functions_in_the_text_exist() -> None:
    text = re.sub(r"^\|.*$", "", PAGE, flags=re.MULTILINE)
    everywhere = {
        f for path in PACKAGE.rglob("*.py") for f in functions(str(path.relative_to(PACKAGE)))
    }
    named = re.findall(r"`([A-Z]\w+\.\w+)`", text)
    assert named
    assert set(named) <= everywhere
