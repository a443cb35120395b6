# SPDX-License-Identifier: Apache-2.0
"""mfba verify: an unedited bag is identical, and every edit is detected and named."""

import math
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from edited_bags import (
    Edit,
    each_changed,
    last_bit,
    one_changed,
    parameter_set,
    record,
    rewrite,
    set_field,
    swapped,
)

from mfba_planner.core.errors import BagError
from mfba_planner.core.planner_types import Mode
from mfba_planner.recording.file_integrity import check_data
from mfba_planner.recording.from_messages import stamp_ns
from mfba_planner.recording.merge_by_time import RawMessage
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation import run_episode
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.verification.verify_bag import verify

DECISION = "/planner/decision"


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("verified") / "bag", "case2", 4)


def test_an_unedited_bag_is_identical(bag: Path) -> None:
    report = verify(bag)
    assert report.is_identical
    assert (report.faults, report.notes) == ((), ())
    expected = run_episode.run(load_scenario("case2"), seed=4).ticks
    assert report.decided == expected
    assert report.digest == digest(expected)


def test_a_robot_in_lockstep_needs_no_obstacles(bag: Path, tmp_path: Path) -> None:
    """Its nodes without world_sim; a simulated run without them was edited."""

    def without_obstacles(messages: list[RawMessage]) -> list[RawMessage]:
        return [message for message in messages if message.topic != "/obstacles"]

    def without_world(content: Any) -> Any:
        del content["nodes"]["world_sim"]
        return content

    robot = rewrite(bag, tmp_path / "robot", without_obstacles, configure=without_world)
    report = verify(robot)
    assert (report.is_identical, report.faults) == (True, ())
    assert report.digest == verify(bag).digest
    faults = verify(rewrite(bag, tmp_path / "simulated", without_obstacles)).faults
    assert any("/obstacles" in fault for fault in faults)


def flip_range(message: Any) -> None:
    message.ranges[3] = 0.5 if math.isinf(message.ranges[3]) else math.inf


def flip_bit(message: Any) -> None:
    message.data[3] = 1 - message.data[3]


def flip_intensity(message: Any) -> None:
    message.intensities[3] = 1.0 - message.intensities[3]


def nudge_pose(message: Any) -> None:
    position = message.pose.position
    position.y = math.nextafter(position.y, math.inf)


def nudge_odom(message: Any) -> None:
    position = message.pose.pose.position
    position.y = math.nextafter(position.y, math.inf)


def nudge_twist(message: Any) -> None:
    message.linear.x = math.nextafter(message.linear.x, math.inf)


def nudge_obstacle(message: Any) -> None:
    for pose in message.poses:
        pose.position.x += 5.0 if pose.position.x < 6.0 else -5.0


def other(mode: str) -> str:
    return "blocked" if mode != "blocked" else "idle"


def other_bit(bits: str) -> str:
    return bits[:5] + ("1" if bits[5] == "0" else "0") + bits[6:]


@pytest.mark.parametrize(
    ("edit", "named"),
    [
        (one_changed("/sectors", 30, flip_range), "tick 30"),
        (one_changed("/sectors", 30, flip_intensity), "/sectors does not match the decision"),
        (one_changed("/sensory_vector", 30, flip_bit), "/sensory_vector does not match"),
        (one_changed("/odom", 30, nudge_odom), "tick 30"),
        (one_changed("/goal_step", 30, nudge_pose), "/goal_step does not match the decision"),
        (one_changed("/cmd_vel", 30, nudge_twist), "/cmd_vel does not match the decision"),
        (one_changed(DECISION, 30, set_field("waypoint", last_bit)), "tick 30"),
        (one_changed(DECISION, 30, set_field("velocity", last_bit)), "tick 30"),
        (one_changed(DECISION, 30, set_field("pose", lambda p: p.replace(",0.0", ",1e-300"))), ""),
        (one_changed(DECISION, 30, set_field("mode", other)), "tick 30"),
        (one_changed(DECISION, 30, set_field("vs", other_bit)), "tick 30"),
        (one_changed(DECISION, 30, set_field("vg", other_bit)), "tick 30"),
        (one_changed(DECISION, 30, set_field("gap", lambda gap: str(int(gap) + 1))), "tick 30"),
        (
            one_changed(DECISION, 30, set_field("goal", lambda _: "1.0,2.0")),
            "for a goal that was not in any /goal_pose",
        ),
        (one_changed(DECISION, 30, set_field("goal", lambda _: "")), "without the known goal"),
        (one_changed(DECISION, 30, set_field("mode", lambda _: "flying")), "malformed"),
    ],
)
def test_an_edited_message_is_named(bag: Path, tmp_path: Path, edit: Edit, named: str) -> None:
    report = verify(rewrite(bag, tmp_path / "edited", edit))
    assert not report.is_identical
    found = list(report.faults)
    if report.divergence:
        found.append(f"tick {report.divergence.tick}")
    assert any(named in text for text in found), found


def test_sectors_that_do_not_match_the_obstacles_are_named(bag: Path, tmp_path: Path) -> None:
    moved = one_changed("/obstacles", 30, nudge_obstacle)
    found = [verify(rewrite(bag, tmp_path / "edited", moved))]
    assert all("does not match the sensor" in text for text in found[0].faults)


def without(topic: str, *indices: int) -> Edit:
    def edit(messages: list[Any]) -> list[Any]:
        positions = [k for k, message in enumerate(messages) if message.topic == topic]
        removed = {positions[index] for index in indices}
        return [message for k, message in enumerate(messages) if k not in removed]

    return edit


def without_tick(index: int) -> Edit:
    def edit(messages: list[Any]) -> list[Any]:
        times = sorted({message.log_time_ns for message in messages})
        return [message for message in messages if message.log_time_ns != times[index]]

    return edit


def twice(topic: str, index: int) -> Edit:
    def edit(messages: list[Any]) -> list[Any]:
        position = [k for k, m in enumerate(messages) if m.topic == topic][index]
        return [*messages[: position + 1], messages[position], *messages[position + 1 :]]

    return edit


@pytest.mark.parametrize(
    ("edit", "named"),
    [
        (without_tick(20), "1 ticks are missing between"),
        (without("/sectors", 20), "no /sectors"),
        (without("/odom", 20), "no /odom"),
        (without(DECISION, 20), "no /planner/decision"),
        (without("/cmd_vel", 20), "/cmd_vel: "),
        (without("/sensory_vector", 20), "/sensory_vector: "),
        (swapped("/odom", 20), "/odom: stamp "),
        (swapped(DECISION, 20), "/planner/decision: stamp "),
    ],
)
def test_missing_and_reordered_messages_are_named(
    bag: Path, tmp_path: Path, edit: Edit, named: str
) -> None:
    report = verify(rewrite(bag, tmp_path / "edited", edit))
    assert not report.is_identical
    assert any(named in fault for fault in report.faults), report.faults


def test_a_stamp_between_two_ticks_is_named(bag: Path, tmp_path: Path) -> None:
    """For a tick without a swarm, whose random numbers depend on the stamp."""
    ticks = verify(bag).recorded
    stamp = next(t.stamp_ns for t in ticks if t.mode is Mode.OBSTACLE_AVOIDANCE)

    def later(_: str, message: Any) -> Any:
        if hasattr(message, "header") and stamp_ns(message.header.stamp) == stamp:
            message.header.stamp.nanosec += 1
        return message

    report = verify(rewrite(bag, tmp_path / "edited", each_changed(later)))
    assert report.divergence is None
    tick_ns = ticks[1].stamp_ns - ticks[0].stamp_ns
    assert f"stamp {stamp + 1} ns: not {tick_ns} ns after the last tick" in report.faults


def test_a_repeated_message_is_noted_but_is_no_fault(bag: Path, tmp_path: Path) -> None:
    report = verify(rewrite(bag, tmp_path / "edited", twice("/odom", 20)))
    assert report.is_identical
    assert report.notes == ("/odom: 1 repeated messages, all identical",)


def test_an_interrupted_recording_is_checked_up_to_its_end(bag: Path, tmp_path: Path) -> None:
    def cut(messages: list[Any]) -> list[Any]:
        return messages[: len(messages) // 2]

    report = verify(rewrite(bag, tmp_path / "edited", cut))
    assert report.divergence is None
    assert 20 < len(report.decided) < 40


def test_the_configuration_is_in_the_attachment_and_in_latched_topics(
    bag: Path, tmp_path: Path
) -> None:
    plain = rewrite(bag, tmp_path / "plain", list, configure=lambda _: None)
    assert verify(plain).is_identical


def test_a_bag_without_any_configuration_is_refused(bag: Path, tmp_path: Path) -> None:
    def edit(messages: list[RawMessage]) -> list[RawMessage]:
        return [message for message in messages if not message.topic.endswith("/parameters")]

    plain = rewrite(bag, tmp_path / "plain", edit, configure=lambda _: None)
    with pytest.raises(BagError, match="has no mfba_planner/configuration"):
        verify(plain)


def test_any_flipped_bit_on_the_disk_is_detected(bag: Path, tmp_path: Path) -> None:
    (source,) = bag.glob("*.mcap")
    data = bytearray(source.read_bytes())
    copy = tmp_path / source.name
    rng = np.random.default_rng(1)
    for offset in rng.integers(len(data), size=100).tolist():
        bit = 1 << int(rng.integers(8))
        data[offset] ^= bit
        copy.write_bytes(data)
        with pytest.raises(BagError):
            verify(copy)
        data[offset] ^= bit
    copy.write_bytes(data)
    assert verify(copy).is_identical


def test_an_index_with_a_wrong_offset_is_named(bag: Path, tmp_path: Path) -> None:
    """The last bytes: start of the summary, of its offsets, CRC, eight bytes of magic."""
    (source,) = bag.glob("*.mcap")
    content = bytearray(source.read_bytes())
    offset = len(content) - 8 - 4 - 8 - 8
    (start,) = struct.unpack_from("<Q", content, offset)
    struct.pack_into("<Q", content, offset, start - 1)
    path = tmp_path / source.name
    path.write_bytes(content)
    assert check_data(source)
    with pytest.raises(BagError, match="data section does not end at the position in its index"):
        check_data(path)


def test_verify_does_not_change_the_bag(bag: Path) -> None:
    before = {path: path.read_bytes() for path in bag.iterdir()}
    verify(bag)
    assert {path: path.read_bytes() for path in bag.iterdir()} == before


def test_parameters_that_changed_during_the_recording_are_named(bag: Path, tmp_path: Path) -> None:
    """As after `ros2 param set /planner speed_mps 0.4`: the node publishes them again."""

    report = verify(rewrite(bag, tmp_path / "edited", parameter_set("planner", "speed_mps", 0.4)))
    assert report.is_identical
    assert report.notes == (
        "planner: speed_mps changed during the recording; decided again with the values at its "
        "begin",
    )
    assert verify(bag).notes == ()
