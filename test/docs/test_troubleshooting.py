# SPDX-License-Identifier: Apache-2.0
"""docs/troubleshooting.md quotes the messages of the code, and all those of a start."""

import ast
import re
from collections.abc import Iterator

import pytest
from project import ROOT

PACKAGE = ROOT / "mfba_planner"
PAGE = (ROOT / "docs/troubleshooting.md").read_text(encoding="utf-8")
OURS, _, OF_MIDDLEWARE = PAGE.partition("## Lines of the middleware")
# The first cell of a table's row, if it is a message.
MESSAGE = re.compile(r"^\| `(.+?)`[^`|]*\|", re.MULTILINE)
QUOTED = MESSAGE.findall(OURS)
# Whatever these raise or note has its line on the page.
OF_A_START = (
    "core/broken_library.py",
    "core/required_packages.py",
    "core/standard_streams.py",
    "entry_points.py",
    "launcher/ros_domain.py",
    "launcher/ros_environment.py",
    "ros/log_directory.py",
    "ros/require_ros.py",
    "ros/runtime/environment_notes.py",
)


def literals(module: str) -> Iterator[str]:
    """The texts of a module with `…` for each value; a docstring is none."""
    tree = ast.parse((PACKAGE / module).read_text(encoding="utf-8"))
    docstrings = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef))
        and node.body
        and isinstance(node.body[0], ast.Expr)
    }
    inside = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr)
              for part in ast.walk(node) if part is not node}  # fmt: skip
    for node in ast.walk(tree):
        if id(node) in docstrings or id(node) in inside:
            continue
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value
        elif isinstance(node, ast.JoinedStr):
            yield "".join(
                str(part.value) if isinstance(part, ast.Constant) else "…" for part in node.values
            )


CODE = [
    text
    for path in sorted(PACKAGE.rglob("*.py"))
    for text in literals(str(path.relative_to(PACKAGE)))
]


def fixed(text: str) -> list[str]:
    """The fixed parts of a message, without the names of variables."""
    parts = [part.strip(" :;()=") for part in text.split("…")]
    return [part for part in parts if len(part) > 3]


def test_the_page_quotes_many_messages() -> None:
    assert len(QUOTED) > 30


@pytest.mark.parametrize("message", QUOTED)
def test_a_quoted_message_is_in_the_code(message: str) -> None:
    # Names of variables and numbers are values in the code: only texts of several words count.
    parts = [part for part in fixed(message) for part in part.split("; ") if " " in part]
    parts = parts or fixed(message)
    assert parts
    for part in parts:
        words = re.sub(r"^\S*=|\b\d+\b", "…", part)
        assert any(all(p in text for p in fixed(words)) for text in CODE), part


@pytest.mark.parametrize("module", OF_A_START)
def test_every_message_of_a_start_is_on_the_page(module: str) -> None:
    # A message has a remedy or a reason, after a semicolon or a colon.
    texts = [text for text in literals(module) if re.search(r"[;:] [\w…(]|cannot", text)]
    messages = [text for text in texts if fixed(text)]
    assert messages
    for message in messages:
        longest = max(fixed(message), key=len)
        remedy = longest.split("; ")[-1].replace("`fastdds shm clean`", "")
        assert remedy.strip(" (") in PAGE.replace("…", ""), message
