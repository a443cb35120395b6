# SPDX-License-Identifier: Apache-2.0
"""One word for one thing: words that must not come back as parts of identifiers."""

import io
import keyword
import re
import subprocess
import tokenize
from collections.abc import Iterator

import pytest
from project import ROOT

# What each of them was used for, and the word of the field instead.
REPLACED = {
    "brain": "planner",
    "told": "command, parameters",
    "seat": "robot interface",
    "seats": "robots",
    "company": "fleet interface",
    "letterbox": "polled subscription",
    "letterboxes": "polled subscriptions",
    "letter": "serialized message",
    "letters": "serialized messages",
    "errand": "goal id",
    "errands": "goal queue",
    "sight": "scan sync, observation",
    "pace": "tick control",
    "survey": "parameter client",
    "crew": "node processes",
    "attempt": "run",
    "conclusion": "run result",
    "screen": "console",
    "leash": "child process",
    "guarded": "supervised planner",
    "caution": "speed limit",
    "seen": "observed",
    "flight": "iteration",
    "legs": "segments",
    "conduct": "contacts and clearances",
    "doubt": "standard deviation, uncertainty, reason",
    "doubts": "standard deviations",
    "evidence": "tick records",
    "mounting": "extrinsics",
    "scratch": "redecide",
    "keeper": "worker",
    "guard": "sandbox",
    "deadman": "command timeout",
    "whoever": "the obstacle that, the node that",
    "nobody": "no obstacle, no subscriber",
    "say": "publish, print",
    "heard": "received",
    "hang": "unsubscribe",
    "way": "path, candidate",
    "ways": "paths, candidates",
    "who": "robot, node, obstacle",
}
# How often a recovery is tried, `recovery.attempts`; and an option, --seen.
ALLOWED = {
    ("bench/benchmark.py", "seen"),
    ("mfba_planner/planning/recovery.py", "attempt"),
    ("test/planning/test_recovery.py", "attempt"),
    # rclpy's names of guard conditions
    ("mfba_planner/ros/runtime/node_executor.py", "_guard"),
    ("mfba_planner/ros/runtime/node_executor.py", "_take_guard_condition"),
    ("mfba_planner/ros/runtime/node_executor.py", "add_guard_condition"),
    ("mfba_planner/ros/runtime/node_executor.py", "guards"),
    ("mfba_planner/ros/runtime/node_executor.py", "num_guard_conditions"),
}


def parts(identifier: str) -> list[str]:
    """The words of a snake_case or CamelCase name, in lower case."""
    return [part.lower() for part in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", identifier)]


def identifiers() -> Iterator[tuple[str, str]]:
    """(file, identifier) of every Python file and every file name of the project."""
    listed = subprocess.run(
        ["git", "ls-files", "*.py"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    for name in listed.stdout.split():
        for part in name.removesuffix(".py").split("/"):
            yield name, part
        text = (ROOT / name).read_text(encoding="utf-8")
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            if token.type == tokenize.NAME and not keyword.iskeyword(token.string):
                yield name, token.string


@pytest.fixture(scope="module")
def used() -> dict[str, set[str]]:
    """Each word that identifiers are made of, and where."""
    found: dict[str, set[str]] = {}
    for name, identifier in identifiers():
        if (name, identifier) not in ALLOWED:
            for part in parts(identifier):
                found.setdefault(part, set()).add(f"{name}: {identifier}")
    return found


@pytest.mark.parametrize("word", REPLACED)
def test_a_replaced_word_is_in_no_identifier(word: str, used: dict[str, set[str]]) -> None:
    found = sorted(used.get(word, ()))
    assert not found, f"{word}: write {REPLACED[word]}"


def test_names_are_taken_apart_and_found(used: dict[str, set[str]]) -> None:
    assert parts("ScanSync_of2_SR") == ["scan", "sync", "of", "sr"]
    assert {"planner", "episode", "sectors"} <= set(used)
