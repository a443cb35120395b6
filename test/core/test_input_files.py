# SPDX-License-Identifier: Apache-2.0
"""Files of others: regular ones of a bounded size, whichever command reads them."""

import ast
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from project import ROOT

from mfba_planner import cli
from mfba_planner.core import input_files
from mfba_planner.core.input_files import at_most, open_input, read_input, read_input_text
from mfba_planner.entry_points import run_and_return_exit_code
from mfba_planner.scenarios.importers.import_files import import_files
from mfba_planner.scenarios.importers.imported import ImportOptions
from mfba_planner.scenarios.scenario_files import parse_scenario

PACKAGE = ROOT / "mfba_planner"
BAG = ROOT / "test/data/rosbag2_foreign_scan"
# These read what the program itself has written or brings along, or what it has checked before.
OWN_FILES = {
    "core/child_process.py": "/proc",
    "core/input_files.py": "the function that all others call",
    "core/output_files.py": "compares a file it has written",
    "core/standard_streams.py": "/dev/null",
    "entry_points.py": "/dev/null",
    "evaluation/study/chunk_store.py": "its own sources",
    "launcher/console.py": "writes a new log",
    "launcher/node_processes.py": "a pipe of a child",
    "launcher/ros_domain.py": "/proc",
    "recording/atomic_files.py": "writes new files",
    "recording/message_definitions.py": "the interfaces of installed packages",
    "recording/open_storage.py": "writes a temporary file",
    "report/html/page.py": "its own templates",
    "ros/shared_memory.py": "locks files, and reads none",
}
READS = {"read_text", "read_bytes", "fromfile", "genfromtxt", "loadtxt"}
MODULES_THAT_OPEN = {"gzip", "io", "Image", "ElementTree", "np", "zipfile"}


def reading_calls(path: Path) -> Iterator[int]:
    """Lines that open a file by its name: open(), X.open(...) of one, X.read_text()."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.Call):
            continue
        called = node.func
        if isinstance(called, ast.Name) and called.id == "open":
            yield node.lineno
        elif isinstance(called, ast.Attribute):
            owner = called.value.id if isinstance(called.value, ast.Name) else ""
            mode = node.args[0] if node.args else None
            opens = called.attr == "open" and (
                owner == "os" or owner in MODULES_THAT_OPEN or isinstance(mode, ast.Constant)
            )
            if opens or called.attr in READS:
                yield node.lineno


def test_every_other_module_reads_through_it() -> None:
    found = {
        str(path.relative_to(PACKAGE))
        for path in PACKAGE.rglob("*.py")
        if any(True for _ in reading_calls(path))
    }
    found -= {"scenarios/nav2_map.py"}  # Image.open of an open file
    assert found == set(OWN_FILES)
    nav2 = (PACKAGE / "scenarios/nav2_map.py").read_text(encoding="utf-8")
    assert "open_input(path) as file" in nav2
    assert "Image.open(file)" in nav2


@pytest.fixture(params=["device", "fifo"])
def endless(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[[str], Path]:
    """Makes a link to /dev/zero, or a FIFO without a writer, of a given name."""

    def make(name: str) -> Path:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if request.param == "fifo":
            os.mkfifo(path)
        else:
            path.symlink_to("/dev/zero")
        return path

    return make


def test_what_is_no_regular_file_is_refused(endless: Callable[[str], Path]) -> None:
    with pytest.raises(OSError, match="not a regular file"):
        open_input(endless("f"))


def test_a_directory_is_named_as_one(tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError, match="Is a directory"):
        read_input(tmp_path)


def test_a_regular_file_is_read_up_to_its_limit(tmp_path: Path) -> None:
    path = tmp_path / "f"
    path.write_bytes("å\r\nb\rc\n".encode())
    assert read_input_text(path) == path.read_text(encoding="utf-8") == "å\nb\nc\n"
    link = tmp_path / "link"
    link.symlink_to(path)
    assert read_input(link, 8) == path.read_bytes()
    with pytest.raises(OSError, match="more than 0 MB"):
        read_input(path, 7)
    assert at_most(b"12", path, 2) == b"12"


def command_lines(file: str) -> list[tuple[str, list[str]]]:
    """Commands and the name of the file that they are given."""
    return [
        ("f.yaml", ["sim", file]),
        ("f.yaml", ["run", file, "--driver", "core"]),
        ("f.yaml", ["sweep", file]),
        ("f.yaml", ["decide", str(BAG), "--params-file", file]),
        ("f.yaml", ["verify", str(BAG), "--params-file", file]),
        ("f.csv", ["import", file, "--out", "o"]),
        ("f.yaml", ["import", file, "--out", "o"]),
        ("f.txt.gz", ["import", file, "--out", "o"]),
        ("f.json", ["digest", file]),
        ("f.json", ["report", file]),
        ("f.json", ["diff", file, file]),
        ("f.md", ["tables", "--quick", "--update", file]),
        ("f.md", ["compare", "F5", "--quick", "--update", file]),
        ("f.mcap", ["info", file]),
        ("d/metadata.yaml", ["info", "d"]),
        ("d/study.json", ["show", "d"]),
    ]


@pytest.mark.parametrize("number", range(len(command_lines(""))))
def test_every_command_refuses_it_in_one_line(
    number: int, endless: Callable[[str], Path], tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    name, _ = command_lines("")[number]
    endless(name)
    _, command = command_lines(name)[number]
    assert run_and_return_exit_code(lambda: cli.main(command), "mfba") == 1
    lines = capsys.readouterr().err.splitlines()
    assert any("not a regular file" in line or "not a file" in line for line in lines), lines
    assert len(lines) == (2 if command[0] == "import" else 1)


def test_files_that_a_scenario_names(
    endless: Callable[[str], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    start = "name: n\nstart_m: [0, 0]\ngoal_m: [3, 0]\n"
    endless("f")
    (tmp_path / "image.yaml").write_text("image: f\nresolution: 0.1\norigin: [0, 0, 0]\n", "utf-8")
    for keys in ("map: f", "map: image.yaml", "obstacles: [{radius_m: 0.3, trajectory: f}]"):
        scenario = tmp_path / "s.yaml"
        scenario.write_text(start + keys, encoding="utf-8")
        assert run_and_return_exit_code(lambda: cli.main(["sim", str(scenario)]), "mfba") == 1  # noqa: B023
        assert "f: not a regular file; " in capsys.readouterr().err


def test_yaml_has_a_limit_of_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert input_files.MOST_YAML_BYTES < input_files.MOST_BYTES
    text = "#" * (input_files.MOST_YAML_BYTES + 1)
    path = tmp_path / "s.yaml"
    path.write_text(text, encoding="utf-8")
    assert run_and_return_exit_code(lambda: cli.main(["sim", str(path)]), "mfba") == 1
    assert "s.yaml: more than 20 MB; " in capsys.readouterr().err
    (refused,) = import_files([path], ImportOptions())
    assert "more than 20 MB; take a part of the file" in refused.error
    with pytest.raises(Exception, match="inline scenario: more than 20 MB"):
        parse_scenario(text, "inline scenario")
