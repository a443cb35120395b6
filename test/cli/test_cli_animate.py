# SPDX-License-Identifier: Apache-2.0
"""`mfba animate`: from a bag or a result to an animation, or one line that says why not."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest
from edited_bags import record
from PIL import Image
from project import ROOT
from trio_scenario import TRIO
from waiting import wait_until

from mfba_planner import cli
from mfba_planner.cli import animate
from mfba_planner.cli.support import progress_bar
from mfba_planner.entry_points import run_and_return_exit_code
from mfba_planner.report.result_json import result_to_dict, write_result
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.scenarios.scenario_json import scenario_to_json
from mfba_planner.simulation.run_episode import run

Capture = pytest.CaptureFixture[str]
QUICK = ("--fps", "2", "--width", "160")


def animated(capsys: Capture, *args: str | Path) -> tuple[int, str, str]:
    code = run_and_return_exit_code(lambda: cli.main(["animate", *map(str, args)]), "mfba")
    return code, *capsys.readouterr()


def refused(capsys: Capture, *args: str | Path) -> str:
    """The one line that a mistake costs; nothing is written."""
    before = sorted(Path.cwd().iterdir())
    code, out, err = animated(capsys, *args)
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert sorted(Path.cwd().iterdir()) == before
    return err


@pytest.fixture(autouse=True)
def _in_an_empty_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "cwd").mkdir()
    monkeypatch.chdir(tmp_path / "cwd")


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of a run without a bag."""
    directory = tmp_path_factory.mktemp("result")
    write_result(directory / "result.json", result_to_dict(run(load_scenario("case1"), seed=4)))
    return directory


@pytest.fixture(scope="module")
def fleet_bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("trio") / "bag", scenario_to_json(TRIO), 5)


def test_a_result_becomes_webp_or_gif_by_the_suffix(capsys: Capture, result: Path) -> None:
    for name, form in (("a.webp", "WEBP"), ("b.gif", "GIF"), ("C.WEBP", "WEBP")):
        assert animated(capsys, result, name, *QUICK) == (0, f"wrote {name}\n", "")
        with Image.open(name) as image:
            assert (image.format, image.width) == (form, 160)
            assert image.n_frames > 10  # type: ignore[attr-defined]
    assert animated(capsys, result / "result.json", "d.webp", *QUICK)[0] == 0
    assert Path("a.webp").read_bytes() == Path("C.WEBP").read_bytes()
    assert Path("a.webp").read_bytes() == Path("d.webp").read_bytes()


def test_the_default_size_is_that_of_a_page(capsys: Capture, result: Path) -> None:
    assert animated(capsys, result, "a.webp", "--fps", "1") == (0, "wrote a.webp\n", "")
    with Image.open("a.webp") as image:
        assert image.width == 640
    assert animated(capsys, result, "b.webp", "--fps", "1", "--max-bytes", "30000")[0] == 0
    assert Path("b.webp").stat().st_size <= 30000 < Path("a.webp").stat().st_size <= 1_500_000


def test_a_faster_animation_has_fewer_frames(capsys: Capture, result: Path) -> None:
    counts = []
    for speed in ("3", "6"):
        assert animated(capsys, result, f"{speed}.webp", *QUICK, "--speed", speed)[0] == 0
        with Image.open(f"{speed}.webp") as image:
            counts.append(image.n_frames)  # type: ignore[attr-defined]
    assert counts[1] == pytest.approx(0.5 * counts[0], abs=1)


def test_a_fleets_bag_shows_all_robots_or_those_that_are_named(
    capsys: Capture, fleet_bag: Path
) -> None:
    named = ("--robot", "a"), ("--robot", "a", "--robot", "c"), ()
    for k, robots in enumerate(named):
        assert animated(capsys, fleet_bag, f"{k}.webp", *QUICK, *robots)[0] == 0
    assert len({Path(f"{k}.webp").read_bytes() for k in range(3)}) == 3
    err = refused(capsys, fleet_bag, "d.webp", "--robot", "d")
    assert "holds no robot d; " in err


def test_mistakes_cost_one_line(capsys: Capture, result: Path) -> None:
    assert refused(capsys, result, "a.mp4") == (
        "mfba: a.mp4: unknown kind of animation; give a name that ends in .webp or .gif\n"
    )
    assert "plain: unknown kind of animation" in refused(capsys, result, "plain")
    assert "OUT" in refused(capsys, result)
    assert "nowhere: does not exist" in refused(capsys, "nowhere", "a.webp")
    foreign = refused(capsys, ROOT / "test/data/rosbag2_foreign_scan", "a.webp")
    assert "was not recorded by mfba" in foreign
    assert "holds one robot's run, and no x" in refused(capsys, result, "a.webp", "--robot", "x")
    for option, value in (
        ("--fps", "0"), ("--fps", "51"), ("--speed", "0"), ("--speed", "nan"), ("--width", "1"),
        ("--max-bytes", "-1"),
    ):  # fmt: skip
        err = refused(capsys, result, "a.webp", option, value)
        assert err.startswith(f"mfba: {option}={value}: out of range; give a number from ")
    assert "--fps: invalid float value: 'x'" in refused(capsys, result, "a.webp", "--fps", "x")
    assert "too few" in refused(capsys, result, "a.webp", *QUICK, "--max-bytes", "1000")


def test_what_is_there_is_not_overwritten(
    capsys: Capture, result: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("a.webp").write_text("mine")
    # At once: no run is read before.
    monkeypatch.setattr(animate, "named_episodes", lambda *_: pytest.fail("read"))
    assert refused(capsys, result, "a.webp") == (
        "mfba: a.webp: already exists and is not overwritten; give another path\n"
    )
    assert Path("a.webp").read_text() == "mine"
    assert "cannot be written" in refused(capsys, result, "no/where.webp")


def test_ctrl_c_leaves_nothing(result: Path) -> None:
    program = subprocess.Popen(
        [Path(sys.executable).parent / "mfba", "animate", result, "a.webp", "--fps", "50"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    wait_until(lambda: any(Path.cwd().iterdir()))
    program.send_signal(signal.SIGINT)
    out, err = program.communicate(timeout=60)
    assert (program.returncode, out, err) == (130, b"", b"")
    assert not list(Path.cwd().iterdir())


def test_a_terminal_sees_progress_when_it_takes_long(
    capsys: Capture, result: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progress_bar, "QUIET_S", 0.0)
    assert animated(capsys, result, "a.webp", *QUICK) == (0, "wrote a.webp\n", "")
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert "drawing" in animated(capsys, result, "b.webp", *QUICK)[2]
    monkeypatch.setattr(progress_bar, "QUIET_S", 1e9)
    assert "drawing" not in animated(capsys, result, "c.webp", *QUICK)[2]
