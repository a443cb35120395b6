# SPDX-License-Identifier: Apache-2.0
"""How a node is, in the words of /diagnostics. No ROS here."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from enum import IntEnum
from typing import NamedTuple

from ...core.types import Decision, Mode
from ...planning.recovery import Phase

WINDOW = 20  # messages over which a rate is taken


class Level(IntEnum):
    """diagnostic_msgs/DiagnosticStatus's levels."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


class Status(NamedTuple):
    """One diagnostic_msgs/DiagnosticStatus."""

    name: str
    level: Level
    message: str
    values: dict[str, str]

    @property
    def summary(self) -> tuple[str, Level, str]:
        """What makes it another status, figures aside."""
        return (self.name, self.level, self.values.get("silent", ""))


class InputRate:
    """When messages of one input came; now_s is of any steady clock."""

    def __init__(self) -> None:
        """Start with none."""
        self._times_s: deque[float] = deque(maxlen=WINDOW)
        self._stamp_ns = -1

    def add(self, stamp_ns: int, now_s: float) -> None:
        """A message was accepted; one with the stamp of the last is no news."""
        if stamp_ns != self._stamp_ns:
            self._stamp_ns = stamp_ns
            self._times_s.append(now_s)

    def age_s(self, now_s: float) -> float | None:
        """Age of the newest, None without any."""
        return now_s - self._times_s[-1] if self._times_s else None

    def rate_hz(self, now_s: float) -> float:
        """Messages per second of late; it falls while none comes."""
        if len(self._times_s) < 2:
            return 0.0
        lasted_s = max(now_s, self._times_s[-1]) - self._times_s[0]
        return (len(self._times_s) - 1) / lasted_s if lasted_s > 0.0 else 0.0


class Health:
    """Joins what is known about inputs and decisions into statuses."""

    def __init__(self, inputs: tuple[str, ...]) -> None:
        """Watch these inputs."""
        self.pulses = {name: InputRate() for name in inputs}
        self._faults: dict[str, str] = {}

    @property
    def faults(self) -> tuple[str, ...]:
        """What is wrong with the newest of each input, "": nothing."""
        return tuple(self._faults.values())

    def heard(self, name: str, stamp_ns: int, now_s: float) -> None:
        """An input came."""
        self.pulses[name].add(stamp_ns, now_s)

    def judged(self, name: str, fault: str) -> None:
        """Why the newest of an input is refused, "": it is sound."""
        self._faults[name] = fault

    def inputs(self, now_s: float, timeout_s: float, refused: Mapping[str, int]) -> Status:
        """Rates, ages and refusals, and what is wrong."""
        fault = next(filter(None, self.faults), "")
        values: dict[str, str] = {}
        silent: dict[str, str] = {}
        for name, rate in self.pulses.items():
            age_s = rate.age_s(now_s)
            if age_s is None:
                silent[name] = f"no {name} yet"
            elif age_s > timeout_s:
                silent[name] = f"{name} stale for {age_s:.2f} s (input_timeout_s={timeout_s:g})"
            values[f"{name}: rate [Hz]"] = f"{rate.rate_hz(now_s):.2f}"
            values[f"{name}: age [s]"] = "never" if age_s is None else f"{age_s:.3f}"
        values["silent"] = " ".join(silent)
        values["input_timeout_s"] = f"{timeout_s:g}"
        values["refused"] = str(sum(refused.values()))
        values |= {f"refused {kind}": str(n) for kind, n in sorted(refused.items())}
        if fault:
            return Status(
                "inputs", Level.ERROR, "; ".join([f"refused: {fault}", *silent.values()]), values
            )
        if silent:
            return Status("inputs", Level.STALE, "; ".join(silent.values()), values)
        return Status("inputs", Level.OK, f"{' and '.join(self.pulses)} are sound", values)


def driving(
    decision: Decision | None, phase: Phase, state: str, values: Mapping[str, str]
) -> Status:
    """What the planner does and why; state is that of its life cycle."""
    told = {"state": state, "mode": decision.mode.value if decision else "none"}
    told |= {"recovery": phase.value, **values}
    if state != "active":
        return Status("driving", Level.OK, f"{state}: commands nothing", told)
    if decision is None:
        return Status("driving", Level.OK, "nothing decided yet", told)
    level = {Mode.STOPPED: Level.ERROR, Mode.BLOCKED: Level.WARN}.get(decision.mode, Level.OK)
    if phase is Phase.GIVEN_UP:
        level = Level.ERROR
    return Status("driving", level, decision.reason, told)
