# SPDX-License-Identifier: Apache-2.0
"""mfba decide: decisions on recordings of other robots, and every command on what it writes."""

import csv
import json
import math
import re
import sys
from pathlib import Path

import pytest
import yaml
from edited_bags import rewrite
from foreign_bags import START_NS, TICK_NS, drive, goal, odom, scan, steps, transform, wall, write
from recorded_bags import FOREIGN
from rosbags.rosbag2 import StoragePlugin

from mfba_planner import cli
from mfba_planner.core.errors import BagError, ConfigError, MfbaError
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.configuration_attachment import read_configuration
from mfba_planner.recording.read_episode import read_recording
from mfba_planner.recording.read_perceived import read_perceived
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.episode import Outcome
from mfba_planner.verification.verify_bag import verify

Capture = pytest.CaptureFixture[str]
DIGEST = re.compile(r"decided: (\d+) decisions, digest ([0-9a-f]{64})")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run directory of the shipped recording of another simulator: moving people."""
    out = tmp_path_factory.mktemp("decided") / "run"
    assert cli.main(["decide", str(FOREIGN), "--out", str(out)]) == 0
    return out


def decide(path: Path, *options: str) -> int:
    return cli.main(["decide", str(path), *options])


def test_the_output_names_inputs_robot_and_planner(tmp_path: Path, capsys: Capture) -> None:
    path = write(tmp_path / "bag", drive(), storage=StoragePlugin.SQLITE3)
    assert decide(path, "--robot-radius", "0.2", "--speed", "0.5", "--seed", "7") == 0
    out = capsys.readouterr().out
    assert out.startswith(
        "recording: scan /scan, odometry /odom in 'odom', goal (5, 0)\n"
        "robot:     radius 0.2 m, omnidirectional, 0.5 m/s, steps of 0.08 m; planner predictive, "
        "seed 7\n"
    )
    assert DIGEST.search(out)
    decide(path, "--planner", "paper", "--goal", "1", "2", "--set", "robot.drive=differential")
    out = capsys.readouterr().out
    assert "goal (1, 2)" in out
    assert "differential" in out
    assert "planner mfba" in out


def test_the_run_is_an_episode_of_the_recorded_path(run: Path) -> None:
    with BagReader(FOREIGN) as reader:
        recorded = {round(m.message.pose.pose.position.x, 9) for m in reader.decoded(["/odom"])}
    recording = read_recording(run)
    (episode,) = recording.episodes.values()
    assert len(episode.ticks) == 133
    assert {round(tick.pose.x, 9) for tick in episode.ticks} <= recorded
    assert episode.time_s(episode.ticks[0].stamp_ns) == 0.0
    assert episode.outcome is Outcome.INTERRUPTED
    assert episode.scenario.goal_m == episode.ticks[-1].goal
    (perceived,) = read_perceived(run, recording.episodes).values()
    assert len(perceived) == 133
    assert all(len(moment.points_m) for moment in perceived)


def test_every_command_reads_the_run(run: Path, tmp_path: Path, capsys: Capture) -> None:
    assert sorted(path.name for path in run.iterdir()) == [
        "bag", "report.html", "result.json", "run.png",
    ]  # fmt: skip
    found = json.loads((run / "result.json").read_text())["digest"]
    assert cli.main(["digest", str(run)]) == 0
    assert capsys.readouterr().out == f"{found}  {run}\n"
    assert cli.main(["verify", str(run)]) == 0
    assert f"identical, 133 decisions, digest {found}" in capsys.readouterr().out
    assert cli.main(["info", str(run)]) == 0
    info = capsys.readouterr().out
    assert found in info
    # One name in all of them: that of the recording.
    name = json.loads((run / "result.json").read_text())["scenario"]
    assert name == FOREIGN.name
    assert f"\n{name}, predictive, seed 0, recording driver\n" in info
    (episode,) = read_recording(run / "bag").episodes.values()
    assert episode.scenario.name == name
    table = tmp_path / "table.csv"
    assert cli.main(["export", str(run), str(table)]) == 0
    with table.open() as file:
        assert len(list(csv.DictReader(file))) == 133
    for command, name in (("picture", "a.png"), ("report", "a.html")):
        options = [] if command == "picture" else ["--out"]
        assert cli.main([command, str(run), *options, str(tmp_path / name)]) == 0
    assert cli.main(["view", str(run), "--save", str(tmp_path / "a.rrd")]) == 0


def test_the_page_holds_scans_and_moving_tracks(run: Path) -> None:
    text = (run / "report.html").read_text()
    found = re.search(r'<script[^>]*type="application/json"[^>]*>(.*?)</script>', text, re.DOTALL)
    assert found
    (shown,) = json.loads(found[1])["runs"]
    assert len(shown["perceived"]) == 133
    moving = [
        track for moment in shown["perceived"] for track in moment["tracks"] if any(track[3:])
    ]
    assert len(moving) > 200
    assert all(moment["points"] for moment in shown["perceived"])


def test_what_if_is_a_second_run(run: Path, tmp_path: Path, capsys: Capture) -> None:
    other = tmp_path / "other"
    assert decide(FOREIGN, "--robot-radius", "0.5", "--out", str(other)) == 0
    assert cli.main(["diff", str(run), str(other)]) == 1
    assert "first difference at tick" in capsys.readouterr().out


def test_options_that_contradict_are_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "bag", drive())
    for given, setting in (
        (["--speed", "0.5"], "planner.speed_mps=0.6"),
        (["--planner", "paper"], "planner.method=predictive"),
    ):
        line = f"{' '.join(given)}: --set {setting}; leave one of them out"
        with pytest.raises(ConfigError, match=f"^{line}$"):
            decide(path, *given, "--set", setting)


def test_a_misspelt_name_in_a_parameter_file_is_named(tmp_path: Path, capsys: Capture) -> None:
    path = write(tmp_path / "bag", drive())
    params = tmp_path / "params.yaml"
    params.write_text(
        "planner: {ros__parameters: {spede_mps: 0.2, speed_mps: 0.5, use_sim_time: true}}\n"
    )
    assert decide(path, "--params-file", str(params)) == 0
    assert capsys.readouterr().err == (
        f"note: --params-file {params}: spede_mps: no such parameter of planner or "
        "virtual_sensor; `planner --help` and `virtual_sensor --help` list them\n"
    )


def test_the_parameter_file_of_the_nodes_is_taken(tmp_path: Path, capsys: Capture) -> None:
    path = write(tmp_path / "bag", drive())
    params = tmp_path / "params.yaml"
    params.write_text(
        "/**:\n  ros__parameters:\n    robot_radius_m: 0.25\n"
        "/**/planner:\n  ros__parameters:\n    method: paper\n    seed: 5\n"
        "    bat:\n      rho: 0.02\n"
        "virtual_sensor:\n  ros__parameters:\n    sensing_range_m: 0.7\n"
    )
    assert decide(path, "--params-file", str(params)) == 0
    out = capsys.readouterr().out
    assert "radius 0.25 m" in out
    assert "planner mfba, seed 5" in out
    assert (
        decide(path, "--params-file", str(params), "--seed", "6", "--planner", "predictive") == 0
    )
    assert "planner predictive, seed 6" in capsys.readouterr().out
    for text, reason in (
        ("other:\n  ros__parameters:\n    a: 1\n", "no parameters of planner or virtual_sensor"),
        ("- 1\n", "not a mapping"),
        ("{", "not YAML"),
        ("planner:\n  ros__parameters:\n    speed_mps: fast\n", "speed_mps='fast': give a number"),
    ):
        params.write_text(text)
        with pytest.raises(ConfigError, match=reason):
            decide(path, "--params-file", str(params))
    with pytest.raises(ConfigError, match="no such file or directory; give a file such as"):
        decide(path, "--params-file", str(tmp_path / "none"))


def test_a_recording_of_our_nodes_verifies_with_its_parameters_or_given_ones(
    run: Path, tmp_path: Path, capsys: Capture
) -> None:
    with BagReader(run) as reader:
        nodes = read_configuration(reader)["nodes"]
    assert "world_sim" not in nodes
    params = tmp_path / "params.yaml"
    params.write_text(
        yaml.safe_dump({name: {"ros__parameters": values} for name, values in nodes.items()})
    )
    with pytest.raises(ConfigError, match="contains its parameters already; leave it out"):
        cli.main(["verify", str(run), "--params-file", str(params)])
    bare = rewrite(run / "bag", tmp_path / "bare", lambda m: m, configure=lambda _: None)
    with pytest.raises(BagError, match="`mfba verify --params-file FILE`, or use `mfba decide`"):
        cli.main(["verify", str(bare)])
    assert cli.main(["verify", str(bare), "--params-file", str(params)]) == 0
    assert "identical, 133 decisions" in capsys.readouterr().out
    wrong = params.read_text().replace("speed_mps: 0.785", "speed_mps: 0.5")
    assert wrong != params.read_text()
    params.write_text(wrong)
    with pytest.raises(BagError, match="tick 0 is not what the planner decides"):
        cli.main(["verify", str(bare), "--params-file", str(params)])


def test_a_robot_that_reaches_the_goal(tmp_path: Path) -> None:
    path = write(tmp_path / "bag", [*drive(10, [math.inf] * 36), goal(START_NS + 2, 0.1, 0.0)])
    assert decide(path, "--out", str(tmp_path / "run")) == 0
    (episode,) = read_recording(tmp_path / "run").episodes.values()
    assert episode.outcome is Outcome.GOAL_REACHED
    assert verify(tmp_path / "run").is_identical


def test_a_new_goal_resets_the_planner_as_in_the_node(tmp_path: Path) -> None:
    messages = [*drive(20), goal(START_NS + 10 * TICK_NS + 5, 0.0, 5.0)]
    path = write(tmp_path / "bag", messages)
    assert decide(path, "--out", str(tmp_path / "run")) == 0
    report = verify(tmp_path / "run")
    assert report.is_identical
    assert {tick.goal for tick in report.recorded} == {(5.0, 0.0), (0.0, 5.0)}


@pytest.mark.parametrize(
    ("messages", "options", "reason"),
    [
        (drive()[:2], "", "no message of type sensor_msgs/msg/LaserScan"),
        (
            [transform(START_NS), *steps(odom)],
            "",
            "no message of type sensor_msgs/msg/LaserScan; give a recording that holds some",
        ),
        ([*steps(scan)], "", "no message of type nav_msgs/msg/Odometry"),
        (
            [goal(START_NS, 1, 1), transform(START_NS),
             *steps(lambda t: odom(t + 1, time_ns=t + 100 * TICK_NS), scan)],
            "", "nothing was decided: 20 scans before the first odometry: not decided",
        ),
        (drive(20, [math.nan] * 36), "", "no scan could be used, 20 of 20 .*usable range"),
        (drive(), "--scan /other", "--scan /other: no such topic; give one of /scan"),
        (
            drive(), "--scan /odom",
            "--scan /odom: of type nav_msgs/msg/Odometry, not sensor_msgs/msg/LaserScan; "
            "give one of /scan",
        ),
        (drive(), "--set planner.speed=1", "unknown option; did you mean"),
        (drive(), "--planner apf", "invalid choice"),
        (drive(), "--speed fast", "invalid float value"),
    ],
)  # fmt: skip
def test_nothing_decided_and_mistakes_are_errors(
    messages: list,
    options: str,
    reason: str,
    tmp_path: Path,  # type: ignore[type-arg]
) -> None:
    path = write(tmp_path / "bag", messages)
    with pytest.raises(MfbaError, match=reason):
        decide(path, *options.split())


def test_without_ros_only_the_directory_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write(tmp_path / "bag", drive())
    monkeypatch.setitem(sys.modules, "mfba_planner.ros.interface.decisions_to_bag", None)
    assert decide(path) == 0
    with pytest.raises(ConfigError, match="its bag needs ROS 2, which is not installed here"):
        decide(path, "--out", str(tmp_path / "run"))
    assert not (tmp_path / "run").exists()


def test_scans_of_two_lidars_are_merged_and_verified(tmp_path: Path, capsys: Capture) -> None:
    rear = transform(START_NS, child="rear", x=-0.2, yaw=math.pi)
    messages = [transform(START_NS), rear, goal(START_NS, 0.0, 5.0), *steps(odom)]
    for k in range(1, 21):
        for frame in ("laser", "rear"):
            messages.append(scan(START_NS + k * TICK_NS, wall(0), frame=frame))
    path, run = write(tmp_path / "bag", messages), tmp_path / "run"
    assert decide(path, "--out", str(run)) == 0
    computed = re.findall("20 decisions, digest (.*)", capsys.readouterr().out)
    assert cli.main(["verify", str(run)]) == 0
    assert computed[0] in capsys.readouterr().out
    (perceived,) = read_perceived(run, read_recording(run).episodes).values()
    assert len(perceived) == 20
    for found in perceived[1:]:
        assert (found.points_m[:, 0].min(), found.points_m[:, 0].max()) == pytest.approx(
            (-0.8, 0.6), abs=0.01
        )


def test_odometry_on_tf_alone_is_decided_on_and_shown(tmp_path: Path, capsys: Capture) -> None:
    messages = [transform(START_NS), goal(START_NS, 5.0, 0.0)]
    for k in range(1, 21):
        stamp = START_NS + k * TICK_NS
        messages.append(transform(stamp, "odom", "base_link", x=0.01 * k, topic="/tf"))
        messages.append(scan(stamp, wall(90)))
    path, run = write(tmp_path / "bag", messages), tmp_path / "run"
    assert decide(path, "--out", str(run)) == 0
    out = capsys.readouterr().out
    assert out.startswith("recording: scan /scan, odometry /tf in 'odom', goal (5, 0)\n")
    by_topic = write(tmp_path / "by_topic", drive(20))
    assert decide(by_topic) == 0
    assert DIGEST.findall(out) == DIGEST.findall(capsys.readouterr().out) != []
    for command in (["verify", str(run)], ["export", str(run), str(tmp_path / "run.csv")]):
        assert cli.main(command) == 0
    (episode,) = read_recording(run).episodes.values()
    assert episode.ticks[-1].pose.x == pytest.approx(0.2)


def test_where_the_lidar_is_can_be_given(tmp_path: Path, capsys: Capture) -> None:
    """The same as by the recording's transform, and kept for `mfba verify`."""
    mount = transform(START_NS, x=0.1, y=-0.2, yaw=1.0, roll=math.pi)
    messages = [goal(START_NS, 0.0, 5.0), *steps(odom, lambda t: scan(t, wall(0)))]
    by_tf = write(tmp_path / "tf", [mount, *messages])
    given = write(tmp_path / "given", messages)
    options = ["--scan-x", "0.1", "--scan-y", "-0.2", "--scan-yaw", "1.0", "--scan-flipped"]
    assert decide(given, *options, "--out", str(tmp_path / "run")) == 0
    assert decide(by_tf) == 0
    digests = re.findall(r"digest (\w+)", capsys.readouterr().out)
    assert len(digests) == 2
    assert digests[0] == digests[1]
    assert cli.main(["verify", str(tmp_path / "run")]) == 0


def test_a_failure_leaves_no_directory(tmp_path: Path) -> None:
    other = scan(START_NS + 30 * TICK_NS, wall(0), frame="unknown")
    path = write(tmp_path / "bag", [*drive(20), other])
    with pytest.raises(BagError, match="frame 'unknown': no /tf_static"):
        decide(path, "--out", str(tmp_path / "run"))
    assert not (tmp_path / "run").exists()
    (tmp_path / "run").mkdir()
    with pytest.raises(MfbaError, match="exists and is never overwritten"):
        decide(path, "--out", str(tmp_path / "run"))


def test_decisions_are_those_of_verify(tmp_path: Path, capsys: Capture) -> None:
    path = write(tmp_path / "bag", drive())
    assert decide(path, "--planner", "paper") == 0
    decided = DIGEST.search(capsys.readouterr().out)
    assert cli.main(["verify", str(path)]) == 0
    assert decided
    assert decided[2] in capsys.readouterr().out


def test_long_recordings_are_thinned_for_the_picture_only(
    tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write(tmp_path / "bag", drive(50))
    assert decide(path, "--out", str(tmp_path / "whole")) == 0
    monkeypatch.setattr("mfba_planner.cli.support.decided_run.MOST_DECISIONS", 20)
    capsys.readouterr()
    assert decide(path, "--out", str(tmp_path / "run")) == 0
    out = capsys.readouterr().out
    assert "note: no report.html, as it shows 20 decisions at most; run.png shows every 4th" in out
    one, other = (
        json.loads((tmp_path / name / "result.json").read_text()) for name in ("whole", "run")
    )
    assert one["digest"] == other["digest"]
    assert one["result"] == other["result"]
    (episode,) = read_recording(tmp_path / "run").episodes.values()
    assert digest(episode.ticks) == one["digest"]
