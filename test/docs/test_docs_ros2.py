# SPDX-License-Identifier: Apache-2.0
"""Every `ros2` command of README and docs runs as a process, in the sequence of its page."""

import re
import shlex
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import count
from pathlib import Path

import pytest
import shown_commands
import yaml
from ros2_session import KINDS, TIMEOUT_S, Session, holds, kind_of
from shown_commands import PAGES, ROOT

from mfba_planner.launcher.in_process_driver import run_in_process
from mfba_planner.scenarios.run_config import RunConfig
from mfba_planner.scenarios.scenario_files import load_scenario

# Commands of other packages in the text, and the tests of statements about them.
MENTIONED = {
    "ros2 bag": "recording/test_bag_writer.py",
    "ros2 bag convert": "verification/test_verify_bag.py",
    "ros2 bag info": "recording/test_bag_metadata.py",
    "ros2 bag play": "recording/test_bag_qos.py",
    "ros2 bag record": "recording/test_bag_reader.py",
    "ros2 pkg prefix mfba_planner": "ros/test_viewer_layouts.py",
}
IN_TEXT = re.compile(r"\bros2 [a-z]+(?: \w+)*")


def blocks(page: str) -> list[list[list[str]]]:
    """The `ros2` lines of each code block of a page, then those in its text."""
    fences = [
        shown_commands.commands(f"```sh\n{block}```\n")
        for block in shown_commands.blocks(page, "sh")
    ]
    found = [[w for w in block if w[0] == "ros2"] for block in fences]
    inline = [[shlex.split(line)] for line in re.findall(r"`(ros2 run [^`]+)`", page)]
    return [block for block in (*found, *inline) if block]


WITH_ROS2 = [name for name, page in PAGES.items() if blocks(page)]


def outside_fences(page: str) -> str:
    return re.sub(r"^```.*?^```$", "", page, flags=re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("name", PAGES)
def test_every_ros2_command_in_the_text_is_run_or_tested(name: str) -> None:
    page = PAGES[name]
    for block in blocks(page):
        for words in block:
            kind_of(words)
    fenced = page.replace(outside_fences(page), "")
    in_sh = sum(len(block) for block in blocks(page))
    for command in IN_TEXT.findall(outside_fences(page)):
        words = command.split()
        is_kind = any(kind[: len(words) - 1] == tuple(words[1:]) for kind in KINDS)
        assert is_kind or words[1] == "run" or command in MENTIONED, f"{name}: {command}"
    assert in_sh >= len(re.findall(r"^ros2 ", fenced, re.MULTILINE))
    for test in MENTIONED.values():
        assert (ROOT / "test" / test).is_file()


def test_pages_with_ros2_are_found() -> None:
    assert {"README.md", "docs/ros.md", "docs/how-to/robot.md"} <= set(WITH_ROS2)


@pytest.fixture
def directory(tmp_path: Path, domain_id: int, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working directory with the bag and the parameter file that the pages name."""
    short_case_1 = replace(load_scenario("case1"), start_m=(9.4, 4.2), goal_m=(9.6, 8.0))
    config = RunConfig(scenario=short_case_1)
    run_in_process(config, tmp_path / "runs/mine/bag", domain_id=domain_id)
    shipped = yaml.safe_load((ROOT / "config/planner.yaml").read_text(encoding="utf-8"))
    shipped["/**/planner"]["ros__parameters"]["speed_mps"] = 0.3
    (tmp_path / "my_robot.yaml").write_text(yaml.safe_dump(shipped), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def recorded(directory: Path) -> list[Path]:
    """The bags that a page recorded."""
    return [path for path in (directory / "runs").iterdir() if path.name != "mine"]


def _is_recorded(session: Session, bag: Path, directory: Path, numbers: Iterator[int]) -> bool:
    """Whether the bag has commands of the planner; discovery of the recorder may be late."""
    session.check()
    return holds(bag, "/cmd_vel", directory / f"saved{next(numbers)}")


@pytest.mark.parametrize("name", WITH_ROS2)
def test_the_commands_of_a_page_work(name: str, directory: Path, domain_id: int) -> None:
    bag = None
    if name.startswith("docs/how-to/"):
        shown_commands.save(PAGES[name], directory)
    with Session(domain_id, directory) as session:
        for block in blocks(PAGES[name]):
            for words in block:
                session.do(words)
            session.check()
        if "recorder" in session.running:
            # The node is in the graph before its bag exists.
            session.graph.until(lambda: bool(recorded(directory)), TIMEOUT_S)
            (bag,) = recorded(directory)
            session.graph.until(partial(_is_recorded, session, bag, directory, count()), TIMEOUT_S)
        session.end()
    assert bag is None or holds(bag, "/cmd_vel", directory / "saved")
