# SPDX-License-Identifier: Apache-2.0
"""Importing files: formats by ending, names, limits; one bad file stops none of the others."""

import gzip
from pathlib import Path

import pytest
from test_gazebo_world import cylinder, world

from mfba_planner.core.errors import ConfigError
from mfba_planner.scenarios.importers import import_files as module
from mfba_planner.scenarios.importers.import_files import files_in, import_files
from mfba_planner.scenarios.importers.imported import ImportOptions
from mfba_planner.scenarios.scenario_files import parse_scenario

GOOD = world(cylinder("1 5 0.5 0 0 0"))


def write(folder: Path, name: str, text: str = GOOD) -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_an_imported_file_is_a_scenario(tmp_path: Path) -> None:
    path = write(tmp_path, "world_7.world")
    (found,) = import_files([path], ImportOptions())
    assert (found.error, len(found.lost), list(found.texts)) == ("", 1, ["world_7"])
    scenario = parse_scenario(found.texts["world_7"], "x")
    assert scenario.name == "world_7"
    assert scenario.obstacles[0].center_m == (1.0, 5.0)
    assert found.texts["world_7"].startswith("# imported by `mfba import` from world_7.world\n")


def test_a_bad_file_stops_none_of_the_others(tmp_path: Path) -> None:
    paths = [
        write(tmp_path, "a.world", "<sdf>"),
        write(tmp_path, "b.world"),
        write(tmp_path, "c.world", world(cylinder("-2.25 3.1 0.5 0 0 0"))),
        write(tmp_path, "d.txt"),
    ]
    (tmp_path / "e.world").write_bytes(b"\xff\xfe\x00")
    found = list(import_files([*paths, tmp_path / "e.world"], ImportOptions()))
    assert [bool(result.error) for result in found] == [True, False, True, True, True]
    assert "a.world: <sdf> without" in found[0].error or "not XML" in found[0].error
    assert "the robot starts" in found[2].error
    assert "inside obstacle 1" in found[2].error
    assert "e.world: not a text file" in found[4].error
    assert all("\n" not in result.error for result in found)


def test_two_files_of_one_name(tmp_path: Path) -> None:
    (tmp_path / "x").mkdir()
    paths = [write(tmp_path, "a.world"), write(tmp_path / "x", "a.world")]
    first, second = import_files(paths, ImportOptions())
    assert not first.error
    assert "name 'a' is that of another file as well" in second.error


def test_a_packed_file_and_a_given_format(tmp_path: Path) -> None:
    packed = tmp_path / "p.world.gz"
    packed.write_bytes(gzip.compress(GOOD.encode()))
    other = write(tmp_path, "q.xml")
    assert [list(r.texts) for r in import_files([packed], ImportOptions())] == [["p"]]
    (refused,) = import_files([other], ImportOptions())
    assert "ending '.xml' is that of no format; give --format" in refused.error
    (found,) = import_files([other], ImportOptions(), "gazebo")
    assert list(found.texts) == ["q"]
    with pytest.raises(ConfigError, match="did you mean 'gazebo'"):
        list(import_files([other], ImportOptions(), "gazeboo"))


def test_a_huge_file_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_BYTES", 2_000_000)
    bomb = tmp_path / "p.world.gz"
    bomb.write_bytes(gzip.compress(b" " * 3_000_000))
    (found,) = import_files([bomb], ImportOptions())
    assert "more than 2 MB; give a readable file, or a part" in found.error
    bomb.write_bytes(gzip.compress(GOOD.encode())[:40])
    (found,) = import_files([bomb], ImportOptions())
    assert "not a text file; give a readable file" in found.error


def test_files_of_a_directory_are_sorted_and_others_left(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no file in it ends with"):
        files_in([tmp_path])
    with pytest.raises(ConfigError, match="none: no such file"):
        files_in([tmp_path / "none"])
    for name in ("b.world", "a.sdf", "README.md"):
        write(tmp_path, name)
    assert [path.name for path in files_in([tmp_path])] == ["a.sdf", "b.world"]
    assert files_in([tmp_path / "README.md"]) == [tmp_path / "README.md"]  # named by the user


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"robot_radius_m": 0.0}, "robot_radius_m=0: out of range"),
        ({"time_limit_s": float("nan")}, "time_limit_s=nan: out of range"),
        ({"start_m": (0.0, float("inf"))}, "start_m=.*not finite"),
        ({"fps": 0.0}, "fps=0.0: out of range"),
        ({"count": 0}, "count=0: out of range"),
    ],
)
def test_bad_options(options: dict[str, object], reason: str) -> None:
    with pytest.raises(ConfigError, match=reason):
        ImportOptions(**options)  # type: ignore[arg-type]
