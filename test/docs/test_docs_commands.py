# SPDX-License-Identifier: Apache-2.0
"""A test or .ci/run runs every command of README and docs, at least in a reduced form."""

import re
from pathlib import Path

import pytest
import shown_commands
from ros2_session import kind_of
from shown_commands import PAGES, REDUCED, ROOT, mfba_arguments

CI = re.findall(r"^make (\w+)$", (ROOT / ".ci/run").read_text(encoding="utf-8"), re.MULTILINE)
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
COLCON = (ROOT / "tools/colcon_check.sh").read_text(encoding="utf-8")
SETUP = (ROOT / "setup.py").read_text(encoding="utf-8")
COMMANDS = [
    (n, w)
    for n, page in PAGES.items()
    for w in shown_commands.commands(page) + shown_commands.inline(page)
]
# docs/test_docs_build.py runs the builder of `make docs`, with the same strictness.
# test_docs_trust measures a command with the configuration of `make coverage`.
BY_TESTS = {
    "docs": "--builder html --nitpicky --fail-on-warning --keep-going",
    "coverage": "--cov-config=tools/coverage.toml",
}


def is_run(words: list[str]) -> bool:
    """Whether a test or .ci/run runs a command; AssertionError for a wrong argument."""
    program, *rest = words
    if mfba_arguments(words) is not None:
        return True  # by test_readme, test_docs_build and the tests in test_docs_build.OWN_TESTS
    if program == "ros2":
        return bool(kind_of(words))  # by test_docs_ros2
    if program == "python":
        return " ".join(words) in REDUCED or shown_commands.reduced(words) != words
    if program == "make":
        return rest[0] in CI or BY_TESTS[rest[0]] in MAKEFILE
    return sets_up_a_workspace(words)


def sets_up_a_workspace(words: list[str]) -> bool:
    """Whether `make colcon` runs it, which builds, sources and checks the installation."""
    program, *rest = words
    assert "colcon" in CI
    assert "tools/colcon_check.sh" in MAKEFILE
    if program == "pip":
        assert rest[0] == "install"
        return all(f'"{name}>=' in SETUP for name in rest[1:])
    if program == "colcon":
        assert (rest[0], rest[-1]) == ("build", "mfba_planner")
        return '/bin/colcon" --log-base "$base/log" build' in COLCON
    if program == "source":
        return rest == ["install/setup.bash"] and 'source "$prefix/../setup.bash"' in COLCON
    return words in (["cd", "~/ws"], ["ln", "-s", "~/mfba_planner", "src/"])


@pytest.mark.parametrize("name", PAGES)
def test_every_command_of_a_page_is_run(name: str) -> None:
    for page, words in COMMANDS:
        if page == name:
            assert is_run(words), f"{name}: {' '.join(words)}: no test runs it"


def test_commands_are_found_and_every_reduced_one_is_shown() -> None:
    lines = {" ".join(words) for _, words in COMMANDS}
    assert len(lines) > 60
    assert {"make demo", "make test", "python bench/robots.py"} <= lines
    assert not set(REDUCED) - lines


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("python bench/robots.py", "360 beams, sectors        3 of 3 "),
        (
            "python bench/kidnapped.py --graph 5",
            "arrived 1 of 1, without contact 1, noticed 1; graph: 1 of 1 ",
        ),
        ("python bench/fleet.py", "1 of 1"),
        ("python bench/startup.py --rounds 3", "--help "),
        ("python bench/startup.py --imports verify", " ms "),
        ("python bench/graph_speed.py --pairs 3", "CPU    bare step "),
        ("python bench/tracking.py --seeds 30", "| decision with tracking |"),
        ("python bench/static_map.py --worlds 5", "| fast-20 |"),
        ("python bench/tracking.py --memory 100000", "| 20 |"),
    ],
)
def test_scripts_behind_tables_of_pages_run(line: str, expected: str, tmp_path: Path) -> None:
    assert expected in shown_commands.script(shown_commands.reduced(line.split()), tmp_path)
