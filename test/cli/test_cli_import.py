# SPDX-License-Identifier: Apache-2.0
"""`mfba import`: files written, what is lost, failures counted, nothing half-written."""

from pathlib import Path

import pytest

from mfba_planner import cli
from mfba_planner.entry_points import run_and_return_exit_code
from mfba_planner.scenarios.scenario_files import load_scenario

Capture = pytest.CaptureFixture[str]
CYLINDER = """<model name='c'><pose>1 5 0.5 0 0 0</pose><link name='l'><collision name='c'>
<geometry><cylinder><radius>0.1</radius><length>1</length></cylinder></geometry>
</collision></link></model>"""
WORLD = f"<sdf version='1.6'><world name='w'>{CYLINDER}<actor name='a'/></world></sdf>"


def mfba(*args: str) -> int:
    return run_and_return_exit_code(lambda: cli.main(list(args)), "mfba")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    made = tmp_path / "worlds"
    made.mkdir()
    for k in range(3):
        (made / f"world_{k}.world").write_text(WORLD, encoding="utf-8")
    return made


def test_a_folder_becomes_scenarios(folder: Path, capsys: Capture) -> None:
    assert mfba("import", "worlds", "--out", "out", "--robot-radius", "0.3") == 0
    out = capsys.readouterr().out.splitlines()
    assert [line.removeprefix("worlds/world_0.world and 2 more: lost: ") for line in out[:2]] == [
        "the heading +y at the start: scenarios begin with +x",
        "1 x <actor> of a, which is not in the file",
    ]
    assert out[-1] == "wrote out: 3 scenarios of 3 files"
    scenario = load_scenario("out/world_2.yaml")
    assert (scenario.name, scenario.robot_radius_m) == ("world_2", 0.3)


def test_refused_files_are_named_and_counted(folder: Path, capsys: Capture) -> None:
    (folder / "world_1.world").write_text("no", encoding="utf-8")
    assert mfba("import", "worlds", "--out", "out") == 1
    out, err = capsys.readouterr()
    assert out.splitlines()[-1] == "wrote out: 2 scenarios of 2 files"
    first, last = err.splitlines()
    assert first.startswith("refused: worlds/world_1.world: not XML")
    assert last == "mfba: 1 of 3 files refused, see above; mend or leave out"
    assert sorted(p.name for p in Path("out").iterdir()) == ["world_0.yaml", "world_2.yaml"]


def test_nothing_is_written_where_nothing_is_imported(folder: Path, capsys: Capture) -> None:
    for path in folder.iterdir():
        path.write_text("", encoding="utf-8")
    assert mfba("import", "worlds", "--out", "out") == 1
    assert capsys.readouterr().err.endswith(
        "mfba: none of 3 files was imported, see above; nothing is written\n"
    )
    assert not Path("out").exists()


def test_an_existing_directory_is_left_alone(folder: Path, capsys: Capture) -> None:
    assert mfba("import", "worlds", "--out", "worlds") == 1
    assert "worlds: exists and is not empty; choose another --out" in capsys.readouterr().err
    assert mfba("import", "worlds/world_1.world") == 0
    assert Path("runs/import-001/world_1.yaml").is_file()


@pytest.mark.parametrize(
    ("args", "reason"),
    [
        (["none.world"], "none.world: no such file"),
        (["worlds", "--format", "gazeb"], "did you mean 'gazebo'"),
        (["worlds", "--fps", "0"], "fps=0.0: out of range"),
        (["worlds", "--start", "nan", "0"], "start_m=[nan, 0.0]: not finite"),
    ],
)
def test_mistakes_give_one_line(
    args: list[str], reason: str, folder: Path, capsys: Capture
) -> None:
    assert mfba("import", *args) == 1
    out, err = capsys.readouterr()
    assert reason in err
    assert (out, err.count("\n")) == ("", 1)
