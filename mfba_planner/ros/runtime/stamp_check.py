# SPDX-License-Identifier: Apache-2.0
"""Whether the stamp of an input can be true: against the node's clock, or the other inputs.

Real time only; no ROS here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from ...core.planner_types import NANO

ODOM = "odom"  # the other inputs are compared with it, and it with any of them
_YEAR_S = 365.25 * 86400.0
SAME_CLOCK_S = 3600.0  # stamps nearer than this to the node's clock are meant to be of that clock

OVERLOAD_S = 60.0  # no overloaded machine delays a message by more


class StampVerdict(NamedTuple):
    """Why a stamp is refused, "" if it is not.

    is_ordered: the stamp may take its place among the others; False for one that would make all
    later messages look old. restarted: the stamps of this input have gone back, as when a bag
    starts again, and what was kept of older messages is worthless.
    """

    fault: str = ""
    is_ordered: bool = True
    restarted: bool = False


@dataclass(slots=True)
class _Received:
    """The newest message of one input; accepted_ns is the newest stamp that was not refused."""

    stamp_ns: int = -1
    arrived_s: float = 0.0
    is_on_clock: bool = False
    accepted_ns: int = -1


class StampCheck:
    """Refuses stamps that are late, in the future, or not set.

    If the newest stamp of any input is within SAME_CLOCK_S of the node's clock, all are of that
    clock, and none may differ from it by more than the limit. If none is, the inputs have a
    clock of their own (a simulation or a replay without use_sim_time): then odometry and the
    other inputs may not differ from each other by more than the limit.
    """

    def __init__(self) -> None:
        """Start with nothing received."""
        self._inputs: dict[str, _Received] = {}
        self.latencies_s: dict[str, float] = {}  # of the newest of each input, by the clock

    @property
    def note(self) -> str:
        """What to warn of: that no input has the node's clock, "" otherwise."""
        if not self._inputs or any(each.is_on_clock for each in self._inputs.values()):
            return ""
        behind_s = max(self.latencies_s.values(), key=abs)
        return (
            f"stamps are {_difference(behind_s)} the node's clock, so only arrival times tell "
            "their age; synchronise the clocks, or in simulation and replay set use_sim_time"
        )

    def check(
        self, name: str, stamp_ns: int, clock_ns: int, now_s: float, limit_s: float
    ) -> StampVerdict:
        """Check one message's stamp; clock_ns is the node's time, now_s of a steady clock."""
        if stamp_ns <= 0:
            return StampVerdict(
                f"{name} stamp is {stamp_ns * NANO:g} s: not set; let the driver set it",
                is_ordered=False,
            )
        if clock_ns == 0:
            return StampVerdict(
                f"{name} cannot be dated: use_sim_time is true, but /clock sends nothing; "
                "publish /clock, or set use_sim_time to false",
                is_ordered=False,
            )
        latency_s = (clock_ns - stamp_ns) * NANO
        own = self._inputs.setdefault(name, _Received())
        own.stamp_ns, own.arrived_s = stamp_ns, now_s
        own.is_on_clock = abs(latency_s) <= SAME_CLOCK_S
        self.latencies_s[name] = latency_s
        if any(each.is_on_clock for each in self._inputs.values()):
            refused = _against_clock(name, latency_s, limit_s)
        else:
            refused = self._against_others(name, own, limit_s)
        return refused or _accept(own, limit_s)

    def _against_others(self, name: str, own: _Received, limit_s: float) -> StampVerdict | None:
        """One that agrees with no other input; which may be the one at fault, if it is behind."""
        limit_ns, now_s = round(limit_s / NANO), own.arrived_s
        others = {
            other: each
            for other, each in self._inputs.items()
            if (name == ODOM) != (other == ODOM) and now_s - each.arrived_s <= limit_s
        }
        known_ns = [
            stamp_ns
            for each in others.values()
            for stamp_ns in (each.stamp_ns, each.accepted_ns)
            if stamp_ns >= 0
        ]
        if not others or any(abs(own.stamp_ns - known) <= limit_ns for known in known_ns):
            return None
        follows = own.accepted_ns >= 0 and 0 <= own.stamp_ns - own.accepted_ns <= limit_ns
        if follows and own.stamp_ns > max(each.accepted_ns for each in others.values()):
            return None  # the others have fallen behind
        other, each = next(iter(others.items()))
        behind_s = (each.stamp_ns - own.stamp_ns) * NANO
        return StampVerdict(
            f"{name} stamp is {_difference(behind_s)} that of {other} "
            f"(input_timeout_s={limit_s:g}); synchronise the clocks of the two",
            is_ordered=False,
        )


def _accept(own: _Received, limit_s: float) -> StampVerdict:
    # Against the node's clock, stamps cannot go back by more unless that clock did.
    restarted = own.stamp_ns < own.accepted_ns - 2.0 * limit_s / NANO
    own.accepted_ns = own.stamp_ns if restarted else max(own.stamp_ns, own.accepted_ns)
    return StampVerdict(restarted=restarted)


def _against_clock(name: str, latency_s: float, limit_s: float) -> StampVerdict | None:
    if abs(latency_s) <= limit_s:
        return None
    late = latency_s > 0.0
    if abs(latency_s) > OVERLOAD_S:
        more = ", or in simulation and replay set use_sim_time"
    else:
        more = ", or relieve the machine" if late else ""
    return StampVerdict(
        f"{name} stamp is {_difference(latency_s)} the node's clock "
        f"(input_timeout_s={limit_s:g}); synchronise the clocks{more}",
        is_ordered=late,
    )


def _difference(behind_s: float) -> str:
    return f"{_duration(abs(behind_s))} {'behind' if behind_s > 0.0 else 'ahead of'}"


def _duration(seconds: float) -> str:
    """A duration with a unit that suits it."""
    for unit_s, unit in ((_YEAR_S, "years"), (86400.0, "days"), (3600.0, "h"), (60.0, "min")):
        if seconds >= 2.0 * unit_s:
            return f"{seconds / unit_s:.1f} {unit}"
    return f"{seconds:.2f} s"
