# SPDX-License-Identifier: Apache-2.0
"""Every `ros2` command of the README and the docs is run: real processes, in the pages' order."""

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
from ros2_session import KINDS, SOON_S, Session, holds, kind_of
from shown_commands import PAGES, ROOT

from mfba_planner.launcher.in_process import run_in_process
from mfba_planner.scenarios.run_config import RunConfig
from mfba_planner.scenarios.scenario_files import load_scenario

# Other people's programs, and who holds us to what is said of them.
MENTIONED = {
    "ros2 bag": "recording/test_bag_writer.py",
    "ros2 bag info": "recording/test_bag_metadata.py",
    "ros2 bag play": "recording/test_qos_profiles.py",
    "ros2 bag record": "recording/test_bag_reader.py",
    "ros2 pkg prefix mfba_planner": "ros/test_viewer_layouts.py",
}
SAID = re.compile(r"\bros2 [a-z]+(?: \w+)*")


def blocks(page: str) -> list[list[list[str]]]:
    """The `ros2` lines of each block of a page that has any, then those within its text."""
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
def test_nothing_of_ros2_is_said_that_is_not_run(name: str) -> None:
    page = PAGES[name]
    for block in blocks(page):
        for words in block:
            kind_of(words)
    fenced = page.replace(outside_fences(page), "")
    in_sh = sum(len(block) for block in blocks(page))
    for said in SAID.findall(outside_fences(page)):
        words = said.split()
        is_kind = any(kind[: len(words) - 1] == tuple(words[1:]) for kind in KINDS)
        assert is_kind or words[1] == "run" or said in MENTIONED, f"{name}: {said}"
    assert in_sh >= len(re.findall(r"^ros2 ", fenced, re.MULTILINE))
    for test in MENTIONED.values():
        assert (ROOT / "test" / test).is_file()


def test_pages_with_ros2_are_found() -> None:
    assert {"README.md", "docs/ros.md", "docs/how-to/robot.md"} <= set(WITH_ROS2)


@pytest.fixture
def home(tmp_path: Path, domain_id: int, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where a reader is: with a bag at the place that pages name, and parameters of one's own."""
    a_part_of_case_1 = replace(load_scenario("case1"), start_m=(9.4, 4.2), goal_m=(9.6, 8.0))
    config = RunConfig(scenario=a_part_of_case_1)
    run_in_process(config, tmp_path / "runs/mine/bag", domain_id=domain_id)
    shipped = yaml.safe_load((ROOT / "config/planner.yaml").read_text(encoding="utf-8"))
    shipped["/**/planner"]["ros__parameters"]["speed_mps"] = 0.3
    (tmp_path / "my_robot.yaml").write_text(yaml.safe_dump(shipped), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def recorded(home: Path) -> list[Path]:
    """The bags that were not there before."""
    return [path for path in (home / "runs").iterdir() if path.name != "mine"]


def _is_kept(session: Session, bag: Path, home: Path, turns: Iterator[int]) -> bool:
    """Whether what the planner says is recorded: it and the recorder may find each other late."""
    session.prove()
    return holds(bag, "/cmd_vel", home / f"saved{next(turns)}")


@pytest.mark.parametrize("name", WITH_ROS2)
def test_the_commands_of_a_page_do_what_it_says(name: str, home: Path, domain_id: int) -> None:
    bag = None
    if name.startswith("docs/how-to/"):
        shown_commands.save(PAGES[name], home)
    with Session(domain_id, home) as session:
        for block in blocks(PAGES[name]):
            for words in block:
                session.do(words)
            session.prove()
        if "recorder" in session.running:
            session.graph.until(lambda: bool(recorded(home)), SOON_S)  # a node is seen before that
            (bag,) = recorded(home)
            session.graph.until(partial(_is_kept, session, bag, home, count()), SOON_S)
        session.end()
    assert bag is None or holds(bag, "/cmd_vel", home / "saved")
