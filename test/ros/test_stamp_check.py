# SPDX-License-Identifier: Apache-2.0
"""Stamps against the node's clock, or against each other; without ROS."""

import pytest

from mfba_planner.ros.runtime.stamp_check import StampCheck, StampVerdict

SECOND = 10**9
NOW = 1_800_000_000 * SECOND
LIMIT_S = 0.5


class Inputs:
    """A StampCheck with a clock; stamps are seconds relative to `zero_ns`."""

    def __init__(self, zero_ns: int = NOW) -> None:
        self.stamps = StampCheck()
        self.zero_ns, self.now_s = zero_ns, 0.0

    def add(self, name: str, at_s: float) -> StampVerdict:
        stamp_ns = self.zero_ns + round(at_s * SECOND)
        clock_ns = NOW + round(self.now_s * SECOND)
        return self.stamps.check(name, stamp_ns, clock_ns, self.now_s, LIMIT_S)

    def tick(self, at_s: float, *, scan_s: float = 0.0) -> tuple[str, str]:
        """Odometry and a scan, 0.1 s after the last ones; their faults."""
        self.now_s += 0.1
        return self.add("odom", at_s).fault, self.add("scan", at_s + scan_s).fault


def test_within_the_limit_of_the_clock_a_stamp_is_accepted() -> None:
    inputs = Inputs()
    for at_s in (0.0, -0.49, 0.49):
        assert inputs.add("odom", at_s) == StampVerdict()
    assert inputs.stamps.note == ""


@pytest.mark.parametrize(
    ("at_s", "text", "remedy", "is_ordered"),
    [
        (-0.6, "0.60 s behind", "the clocks, or relieve the machine", True),
        (-1800.0, "30.0 min behind", "or in simulation and replay set use_sim_time", True),
        (0.6, "0.60 s ahead of", "synchronise the clocks", False),
        (3600.0, "60.0 min ahead of", "or in simulation and replay set use_sim_time", False),
    ],
)
def test_beyond_the_limit_it_is_refused(
    at_s: float, text: str, remedy: str, is_ordered: bool
) -> None:
    verdict = Inputs().add("odom", at_s)
    text = f"odom stamp is {text} the node's clock (input_timeout_s=0.5); "
    assert verdict.fault.startswith(text)
    assert verdict.fault.endswith(remedy)
    assert (verdict.is_ordered, verdict.restarted) == (is_ordered, False)


def test_one_input_on_the_clock_binds_the_others_to_it() -> None:
    inputs = Inputs()
    inputs.add("odom", 0.0)
    verdict = inputs.add("scan", -40 * 86400.0)
    assert verdict.fault.startswith("scan stamp is 40.0 days behind the node's clock")


@pytest.mark.parametrize("stamp_ns", [0, -SECOND])
def test_a_stamp_that_is_not_set_is_refused(stamp_ns: int) -> None:
    verdict = StampCheck().check("scan", stamp_ns, NOW, 0.0, LIMIT_S)
    assert verdict.fault == f"scan stamp is {stamp_ns // SECOND} s: not set; let the driver set it"
    assert not verdict.is_ordered


def test_a_clock_that_is_set_back_restarts_the_inputs() -> None:
    inputs = Inputs()
    assert not inputs.add("odom", 0.4).restarted
    assert not inputs.add("odom", -0.4).restarted, "as far as the limit allows"
    inputs.now_s = -5.0
    assert inputs.add("odom", -5.0) == StampVerdict(restarted=True)
    assert inputs.add("odom", -4.9) == StampVerdict()


def test_inputs_of_another_clock_are_compared_with_each_other() -> None:
    inputs = Inputs(zero_ns=10 * SECOND)
    assert inputs.tick(0.0) == inputs.tick(0.1) == ("", "")
    assert "years behind the node's clock, so only arrival times" in inputs.stamps.note
    late = inputs.tick(0.2, scan_s=-3.0)
    assert late == (
        "",
        "scan stamp is 3.00 s behind that of odom (input_timeout_s=0.5); synchronise the clocks "
        "of the two",
    )
    assert inputs.tick(0.3) == ("", "")


def test_of_two_inputs_the_one_that_falls_behind_is_refused() -> None:
    inputs = Inputs(zero_ns=10 * SECOND)
    faults = [inputs.tick(0.1 * k, scan_s=-0.05 * k) for k in range(40)]
    assert {odom for odom, _ in faults} == {""}
    assert [bool(scan) for _, scan in faults] == [k > 10 for k in range(40)]


@pytest.mark.parametrize("name", ["odom", "scan"])
def test_a_stray_stamp_of_another_clock_disturbs_no_other(name: str) -> None:
    inputs = Inputs(zero_ns=10 * SECOND)
    inputs.tick(0.0)
    assert "ahead of that of" in inputs.add(name, 1e6).fault
    assert inputs.tick(0.1) == ("", "")


def test_time_may_restart_where_two_inputs_agree_on_it() -> None:
    inputs = Inputs(zero_ns=10 * SECOND)
    inputs.tick(100.0)
    inputs.now_s += 0.1
    assert "behind that of scan" in inputs.add("odom", 1.0).fault
    assert inputs.add("scan", 1.0) == StampVerdict(restarted=True)
    assert inputs.add("odom", 1.1).fault == ""


def test_while_an_input_is_silent_it_is_no_measure_for_the_others() -> None:
    inputs = Inputs(zero_ns=10 * SECOND)
    inputs.tick(0.0)
    for k in range(1, 30):
        inputs.now_s += 0.1
        assert inputs.add("odom", 0.1 * k).fault == ""
    assert inputs.tick(3.0) == ("", "")


def test_any_speed_of_simulated_time_is_accepted() -> None:
    for speed in (0.1, 1.0, 50.0):
        inputs = Inputs(zero_ns=10 * SECOND)
        faults = [inputs.tick(0.1 * speed * k) for k in range(20)]
        assert [scan for _, scan in faults] == [""] * 20, speed
