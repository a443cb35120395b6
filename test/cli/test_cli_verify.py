# SPDX-License-Identifier: Apache-2.0
"""`mfba digest`, `mfba verify` and `mfba diff` on the command line."""

import json
from pathlib import Path

import pytest
from edited_bags import last_bit, one_changed, record, rewrite, set_field

from mfba_planner import cli
from mfba_planner.core.errors import BagError, ConfigError, OutputError
from mfba_planner.report.result_json import result_to_dict, write_result
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation import run_episode
from mfba_planner.simulation.decision_digest import digest


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("cli") / "bag", "case1", 2)


EXPECTED = digest(run_episode.run(load_scenario("case1"), seed=2).ticks)


def test_digest_of_a_bag_and_of_a_result(
    bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    result = tmp_path / "result.json"
    write_result(result, result_to_dict(run_episode.run(load_scenario("case1"), seed=2)))
    assert cli.main(["digest", str(bag), str(result)]) == 0
    assert capsys.readouterr().out == f"{EXPECTED}  {bag}\n{EXPECTED}  {result}\n"


@pytest.mark.parametrize("command", [["sim", "empty"], ["run", "empty", "--driver", "core"]])
def test_digest_of_a_run_directory_without_a_bag(
    command: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "run"
    assert cli.main([*command, "--out", str(run)]) == 0
    capsys.readouterr()
    assert cli.main(["digest", str(run), str(run / "result.json")]) == 0
    of_directory, of_file = capsys.readouterr().out.splitlines()
    found = json.loads((run / "result.json").read_text("utf-8"))["digest"]
    assert of_directory == f"{found}  {run}"
    assert of_file == f"{found}  {run / 'result.json'}"


@pytest.mark.parametrize(
    "command",
    [["info"], ["verify"], ["export", "x.csv"], ["picture", "x.png"], ["recover", "x"],
     ["diff", "run"], ["decide"]],
)  # fmt: skip
def test_commands_that_need_a_bag_name_those_for_a_result(
    command: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli.main(["sim", "empty", "--out", "run"]) == 0
    name, *more = command
    with pytest.raises(BagError, match=r"^run: has no bag, only result.json, .*or use digest, r"):
        cli.main([name, "run", *more])


def test_a_result_without_digest_is_refused(tmp_path: Path) -> None:
    result = tmp_path / "result.json"
    data = result_to_dict(run_episode.run(load_scenario("case1")))
    del data["digest"]
    result.write_text(json.dumps(data))
    with pytest.raises(Exception, match="digest is missing; give a result"):
        cli.main(["digest", str(result)])


def test_verify_an_unchanged_bag(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["verify", str(bag), "--closed-loop"]) == 0
    ticks = len(run_episode.run(load_scenario("case1"), seed=2).ticks)
    assert capsys.readouterr().out == (
        f"identical, {ticks} decisions, digest {EXPECTED}\nclosed loop: identical, {ticks} ticks\n"
    )


def test_verify_names_the_first_tick_that_differs(
    bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    change = one_changed("/planner/decision", 7, set_field("waypoint", last_bit))
    edited = rewrite(bag, tmp_path / "edited", change)
    with pytest.raises(
        BagError, match=rf"^{edited}: not identical: tick 7 is not what the planner decides; .*"
    ):
        cli.main(["verify", str(edited)])
    out = capsys.readouterr().out
    assert "first difference at tick 7, stamp" in out
    marked = [line.split()[1] for line in out.splitlines() if line.startswith("> ")]
    assert marked == ["waypoint"]


def test_closed_loop_finds_a_world_that_was_not_simulated(
    bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each decision is the planner's, but the robot did not follow it."""
    from mfba_planner.recording.bag_reader import BagReader

    with BagReader(bag) as reader:
        end = reader.end_ns or 0

    def only_half(messages: list) -> list:  # type: ignore[type-arg]
        latched = [m for m in messages if m.topic == "/goal_pose"]
        return latched + [m for m in messages if m.log_time_ns > end // 2]

    late = rewrite(bag, tmp_path / "late", only_half)
    with pytest.raises(BagError, match="tick 0 differs from the simulated world"):
        cli.main(["verify", str(late), "--closed-loop"])
    assert "note: the recording starts at stamp" in capsys.readouterr().out


def test_what_if(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = tmp_path / "what_if.png"
    arguments = ["verify", str(bag), "--set", "planner.speed_mps=0.5", "--picture", str(picture)]
    assert cli.main(arguments) == 0
    out = capsys.readouterr().out
    assert "what if planner.speed_mps=0.5" in out
    assert "> length" in out
    assert picture.read_bytes().startswith(b"\x89PNG")
    with pytest.raises(OutputError, match="already exists"):
        cli.main(arguments)


def test_what_if_nothing_changes(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["verify", str(bag), "--set", "planner.input_timeout_s=0.5"]) == 0
    assert capsys.readouterr().out.endswith("no decision differs\n")


def test_wrong_arguments_are_refused(bag: Path) -> None:
    with pytest.raises(ConfigError, match=r"did you mean 'planner\.speed_mps'"):
        cli.main(["verify", str(bag), "--set", "planner.speed=1"])
    with pytest.raises(ConfigError, match=r"^--picture: there is one trail only"):
        cli.main(["verify", str(bag), "--picture", "x.png"])
    with pytest.raises(BagError):
        cli.main(["verify", "no/such/bag"])


def test_diff(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["diff", str(bag), str(bag)]) == 0
    assert EXPECTED in capsys.readouterr().out
    edited = rewrite(
        bag, tmp_path / "edited", one_changed("/planner/decision", 9, set_field("vs", flipped))
    )
    assert cli.main(["diff", str(bag), str(edited)]) == 1
    out = capsys.readouterr().out
    assert "first difference at tick 9:" in out
    assert "> vs" in out


def flipped(bits: str) -> str:
    return ("1" if bits[0] == "0" else "0") + bits[1:]


def test_diff_of_runs_of_unequal_length(
    bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shorter = rewrite(bag, tmp_path / "shorter", lambda messages: messages[:300])
    assert cli.main(["diff", str(bag), str(shorter)]) == 1
    assert "(ended before)" in capsys.readouterr().out
