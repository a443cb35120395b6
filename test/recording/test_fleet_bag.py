# SPDX-License-Identifier: Apache-2.0
"""The commands on a fleet's bag: for all robots, or those named with --robot."""

import csv
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from edited_bags import last_bit, one_changed, parameter_set, record, rewrite, set_field
from pyarrow import parquet
from recorded_bags import FOREIGN
from report_readers import data_of, rows_of
from trio_scenario import TRIO

from mfba_planner import cli
from mfba_planner.core.errors import BagError, ConfigError, InputError
from mfba_planner.core.geometry import distance
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.read_episode import read_episode, read_recording
from mfba_planner.scenarios.scenario_json import scenario_to_json
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.fleet import run_fleet
from mfba_planner.simulation.obstacle_motion import center_at
from mfba_planner.verification.verify_bag import verify, verify_each

Capture = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("trio") / "bag", scenario_to_json(TRIO), 5)


@pytest.fixture(scope="module")
def single_robot_bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("single") / "bag", "empty", 1)


@pytest.fixture(scope="module")
def core() -> dict[str, Episode]:
    return dict(zip("abc", run_fleet(TRIO, seed=5)))


@pytest.fixture(scope="module")
def edited(bag: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy in which the last bit of b's waypoint at tick 1 is changed."""
    change = one_changed("/b/planner/decision", 1, set_field("waypoint", last_bit))
    return rewrite(bag, tmp_path_factory.mktemp("edited") / "bag", change)


def lines(capsys: Capture, *args: str | Path, code: int = 0) -> list[str]:
    assert cli.main([str(arg) for arg in args]) == code
    return capsys.readouterr().out.splitlines()


def test_episodes_equal_those_of_run_fleet(bag: Path, core: dict[str, Episode]) -> None:
    scenario, seed, episodes, omitted = read_recording(bag)
    assert (scenario, seed, list(episodes), omitted) == (TRIO, 5, ["a", "b", "c"], {})
    for name, episode in episodes.items():
        assert digest(episode.ticks) == digest(core[name].ticks)
        assert episode.truth == core[name].truth != ()
        assert episode.scenario == core[name].scenario
        assert episode.seed == core[name].seed
    assert read_recording(bag, ["c"]).episodes == {"c": episodes["c"]}
    assert len(core["b"].ticks) < len(core["a"].ticks) - 3


def test_the_bag_is_read_once_for_any_number_of_robots(
    bag: Path, single_robot_bag: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    passes = []
    decoded = BagReader.decoded

    def counted(self: BagReader, *args: Any, **more: Any) -> Any:
        passes.append(self.path)
        return decoded(self, *args, **more)

    monkeypatch.setattr(BagReader, "decoded", counted)
    read_recording(bag)
    assert passes == [bag] * 2  # decisions, and ground truth, since odometry has noise
    read_recording(single_robot_bag)
    assert passes[2:] == [single_robot_bag]
    cli.main(["verify", str(bag)])
    assert passes[3:] == [bag]


def test_digest_and_info_list_every_robot(
    bag: Path, core: dict[str, Episode], capsys: Capture
) -> None:
    digests = {name: digest(episode.ticks) for name, episode in core.items()}
    assert lines(capsys, "digest", bag) == [f"{d}  {bag} {name}" for name, d in digests.items()]
    assert lines(capsys, "digest", "--robot", "c", bag) == [f"{digests['c']}  {bag} c"]
    output = lines(capsys, "info", bag)
    assert output[-3:] == [f"digest {name} {d}" for name, d in digests.items()]
    rows = [line.split() for line in output[-7:-4]]
    assert [row[:3] for row in rows] == [
        [name, "goal_reached", f"{evaluate(episode).length_m:.3f}"]
        for name, episode in core.items()
    ]


def test_verify_decides_again_for_every_robot(
    bag: Path, core: dict[str, Episode], capsys: Capture
) -> None:
    output = lines(capsys, "verify", bag, "--closed-loop")
    assert [line for line in output if "note: " not in line] == [
        *(
            f"{name}: identical, {len(e.ticks)} decisions, digest {digest(e.ticks)}"
            for name, e in core.items()
        ),
        *(f"{name}: closed loop: identical, {len(e.ticks)} ticks" for name, e in core.items()),
    ]


def test_verify_names_the_robot_that_differs(edited: Path, capsys: Capture) -> None:
    with pytest.raises(
        BagError, match=r"bag: b: not identical: tick 1 is not what .*; see above$"
    ):
        cli.main(["verify", str(edited)])
    output = capsys.readouterr().out.splitlines()
    assert [line.partition(",")[0] for line in output if "identical" in line] == [
        "a: identical", "c: identical",
    ]  # fmt: skip
    assert any(line.startswith("b: first difference at tick 1, stamp ") for line in output)
    assert lines(capsys, "verify", edited, "--robot", "a")[0].startswith("a: identical, ")
    with pytest.raises(BagError, match="b: not identical"):
        cli.main(["verify", str(edited), "--robot", "b"])


def test_verify_names_the_robot_whose_parameters_changed(bag: Path, tmp_path: Path) -> None:
    slower = rewrite(bag, tmp_path / "slower", parameter_set("b/planner", "speed_mps", 0.4))
    notes = {robot: report.notes for robot, report in verify_each(slower).items()}
    before = {robot: report.notes for robot, report in verify_each(bag).items()}
    line = "b/planner: speed_mps changed during the recording; decided again with the values at "
    assert notes == before | {"b": (f"{line}its begin", *before["b"])}


def test_verify_names_the_robot_with_wrong_sectors(
    bag: Path, tmp_path: Path, capsys: Capture
) -> None:
    def move_obstacle(message: Any) -> None:
        message.poses[-1].position.x, message.poses[-1].position.y = -1.5, 0.0

    edited_bag = rewrite(bag, tmp_path / "edited", one_changed("/a/obstacles", 0, move_obstacle))
    with pytest.raises(BagError, match=r"a: not identical: 1 faults, the first: stamp .* /sec"):
        cli.main(["verify", str(edited_bag)])
    assert "a: fault: stamp" in capsys.readouterr().out


def test_what_if_simulates_the_whole_fleet(bag: Path, tmp_path: Path, capsys: Capture) -> None:
    command = ["verify", str(bag), "--set", "planner.step_length_m=0.2"]
    output = lines(capsys, *command, "--robot", "a", "--picture", tmp_path / "a.png")
    params = replace(read_recording(bag).episodes["a"].planner, step_length_m=0.2)
    again = run_fleet(TRIO, seed=5, planner=params)
    assert "a: what if planner.step_length_m=0.2" in output
    assert not any(line.startswith(("b: ", "c: ")) for line in output)
    (length,) = [line.split()[-2] for line in output if " length " in line]
    assert length == f"{evaluate(again[0]).length_m:.3f}"
    assert (tmp_path / "a.png").stat().st_size > 10_000
    output = lines(capsys, *command)
    assert [line[0] for line in output if "what if planner" in line] == ["a", "b", "c"]
    with pytest.raises(ConfigError, match="--picture: it is of one robot's trails; give --robot"):
        cli.main([*command, "--picture", str(tmp_path / "no.png")])


def test_export_has_a_column_for_the_robot(
    bag: Path, core: dict[str, Episode], tmp_path: Path, capsys: Capture
) -> None:
    ticks = sum(len(episode.ticks) for episode in core.values())
    assert lines(capsys, "export", bag, tmp_path / "all.csv")[0].endswith(f": {ticks} rows")
    with (tmp_path / "all.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    keys = [(int(row["stamp_ns"]), row["robot"]) for row in rows]
    assert keys == sorted(keys)
    for name, episode in core.items():
        robot_rows = [row for row in rows if row["robot"] == name]
        assert [float(row["x"]) for row in robot_rows] == [tick.pose.x for tick in episode.ticks]
        assert [row["time_s"] for row in robot_rows] == [
            str((tick.stamp_ns - episode.ticks[0].stamp_ns) * 1e-9) for tick in episode.ticks
        ]
    lines(capsys, "export", bag, tmp_path / "b.parquet", "--robot", "b")
    table = parquet.read_table(tmp_path / "b.parquet")
    assert table.column_names[:2] == ["robot", "stamp_ns"]
    assert set(table["robot"].to_pylist()) == {"b"}
    assert len(table) == len(core["b"].ticks)


def test_diff_compares_robot_by_robot(
    bag: Path, edited: Path, single_robot_bag: Path, capsys: Capture
) -> None:
    assert [line[:12] for line in lines(capsys, "diff", bag, bag)] == [
        f"{name}: identical" for name in "abc"
    ]
    output = lines(capsys, "diff", bag, edited, code=1)
    assert "b: first difference at tick 1:" in output
    assert [line[0] for line in output if ": identical" in line] == ["a", "c"]
    assert len(lines(capsys, "diff", bag, edited, "--robot", "c")) == 1
    with pytest.raises(BagError, match="holds other robots than"):
        cli.main(["diff", str(bag), str(single_robot_bag)])


def test_picture_of_all_and_of_one(bag: Path, tmp_path: Path, capsys: Capture) -> None:
    for name, options in (("all.png", []), ("one.png", ["--robot", "a"])):
        lines(capsys, "picture", bag, tmp_path / name, *options)
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "all.png").read_bytes() != (tmp_path / "one.png").read_bytes()


def test_the_page_is_one_scene(
    bag: Path, core: dict[str, Episode], tmp_path: Path, capsys: Capture
) -> None:
    lines(capsys, "report", bag, "--out", tmp_path / "all.html")
    data = data_of(tmp_path / "all.html")
    assert (data["fleet"], data["worlds"]) == (True, "trio")
    assert [run["name"] for run in data["runs"]] == ["a", "b", "c"]
    assert [run["digest"] for run in data["runs"]] == [digest(e.ticks) for e in core.values()]
    assert len({json.dumps(run["world"]["view"]) for run in data["runs"]}) == 1
    (b,) = (run["world"] for run in data["runs"] if run["name"] == "b")
    assert [obstacle["name"] for obstacle in b["obstacles"]] == ["1", "a", "c"]
    # b has arrived, the others have not.
    longest = max(core.values(), key=lambda episode: len(episode.ticks))
    assert b["times"] == [longest.time_s(tick.stamp_ns) for tick in longest.ticks]
    shown = list(zip(b["obstacles"][1]["x"], b["obstacles"][1]["y"]))
    assert len(shown) == len(longest.ticks)
    for position, pose in zip(shown, core["a"].truth):
        assert distance(position, pose.position) < 1e-3


def test_robots_are_separate_runs_when_named_or_with_other_bags(
    bag: Path, single_robot_bag: Path, tmp_path: Path, capsys: Capture
) -> None:
    two = ["--robot", "c", "--robot", "a"]
    lines(capsys, "report", bag, *two, "--out", tmp_path / "two.html")
    data = data_of(tmp_path / "two.html")
    assert not data["fleet"]
    assert [run["name"] for run in data["runs"]] == ["a", "c"]
    assert data["runs"][0]["world"]["times"] is None
    assert [o["name"] for o in data["runs"][0]["world"]["obstacles"]] == ["1", "b", "c"]
    lines(capsys, "report", bag, single_robot_bag, "--out", tmp_path / "both.html")
    data = data_of(tmp_path / "both.html")
    names = [run["name"] for run in data["runs"]]
    assert names == [
        *(f"{bag.parent.name}.{robot}" for robot in "abc"),
        single_robot_bag.parent.name,
    ]
    with pytest.raises(InputError, match="7 runs: too many"):
        cli.main(
            [
                "report",
                str(bag),
                str(single_robot_bag),
                str(bag),
                "--out",
                str(tmp_path / "no.html"),
            ]
        )


def test_the_viewer_shows_every_robot_in_one_world(
    bag: Path, core: dict[str, Episode], tmp_path: Path, capsys: Capture
) -> None:
    lines(capsys, "view", bag, "--save", tmp_path / "all.rrd")
    rows = rows_of(tmp_path / "all.rrd")
    for name, episode in core.items():
        assert rows[f"/{name}/world/robot"] == rows[f"/{name}/decision"] == len(episode.ticks)
    obstacles = {name: rows[f"/{name}/world/obstacles"] for name in "abc"}
    longest = max(core, key=lambda name: len(core[name].ticks))
    assert obstacles == dict.fromkeys("abc", 0) | {longest: len(core[longest].ticks)}
    lines(capsys, "view", bag, "--robot", "b", "--save", tmp_path / "b.rrd")
    rows = rows_of(tmp_path / "b.rrd")
    assert rows["/b/world/obstacles"] == len(core["b"].ticks)
    assert rows["/a/world/robot"] == 0


COMMANDS = {
    "digest": (), "verify": (), "export": ("x.csv",), "picture": ("x.png",),
    "report": ("--out", "x.html"), "view": ("--save", "x.rrd"), "diff": (),
}  # fmt: skip


@pytest.mark.parametrize("command", COMMANDS)
def test_an_unknown_robot_is_refused_in_one_line(
    command: str,
    bag: Path,
    single_robot_bag: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    for path, name, message in (
        (bag, "bb", "holds no robot bb; did you mean 'b'"),
        (bag, "xyz", "holds no robot xyz; known: a, b, c"),
        (single_robot_bag, "a", "holds one robot's run, and no a; leave out --robot"),
    ):
        bags = [str(path)] * (1 + (command == "diff"))
        with pytest.raises(BagError, match=re.escape(message)):
            cli.main([command, *bags, *COMMANDS[command], "--robot", name])
    assert not list(tmp_path.iterdir())


def test_robot_option_is_refused_for_foreign_recordings(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"--robot: .* was not recorded by mfba"):
        cli.main(["verify", str(FOREIGN), "--robot", "a"])


def test_readers_of_one_robot_refuse_a_fleet_s_bag(bag: Path) -> None:
    for read in (read_episode, verify):
        with pytest.raises(
            BagError, match=r"holds 3 robots, but this reads a bag of one; .*read_recording"
        ):
            read(bag)


def test_sectors_that_are_missing_are_named_with_their_robot(bag: Path, tmp_path: Path) -> None:
    def without_one(messages: list[Any]) -> list[Any]:
        removed = [m for m in messages if m.topic == "/c/sectors"][3]
        return [m for m in messages if m is not removed]

    cut = rewrite(bag, tmp_path / "cut", without_one)
    with pytest.raises(BagError, match=r"cut: c: no sectors at stamp \d+ ns; was the bag edited"):
        read_recording(cut)


def test_the_other_robots_move_as_recorded(bag: Path) -> None:
    """The Episode of one robot has the other robots as moving obstacles."""
    b = read_recording(bag, ["b"]).episodes["b"]
    a = read_recording(bag, ["a"]).episodes["a"]
    assert center_at(b.scenario.obstacles[1], 1e3) == pytest.approx(a.truth[-1].position)
