# SPDX-License-Identifier: Apache-2.0
"""Rates, ages and faults of a node's inputs as /diagnostics reports them. No ROS here."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Mapping
from enum import IntEnum
from typing import NamedTuple

from ...core.planner_types import Decision, Mode
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
        """What counts as a change, figures aside."""
        return (self.name, self.level, self.values.get("silent", ""))


class InputRate:
    """When messages of one input were received; now_s is of any steady clock."""

    def __init__(self) -> None:
        """Start with no message."""
        self._times_s: deque[float] = deque(maxlen=WINDOW)
        self._stamp_ns = -1

    def add(self, stamp_ns: int, now_s: float) -> None:
        """A message was accepted; one with the stamp of the last does not count."""
        if stamp_ns != self._stamp_ns:
            self._stamp_ns = stamp_ns
            self._times_s.append(now_s)

    def age_s(self, now_s: float) -> float | None:
        """Age of the newest, None without any."""
        return now_s - self._times_s[-1] if self._times_s else None

    def rate_hz(self, now_s: float) -> float:
        """Messages per second over the last WINDOW; it falls while none is received."""
        if len(self._times_s) < 2:
            return 0.0
        lasted_s = max(now_s, self._times_s[-1]) - self._times_s[0]
        return (len(self._times_s) - 1) / lasted_s if lasted_s > 0.0 else 0.0


class InputHealth:
    """Rate, age and fault of each input of a node."""

    def __init__(self, inputs: tuple[str, ...]) -> None:
        """Start with nothing received on these inputs."""
        self.rates = {name: InputRate() for name in inputs}
        self._faults: dict[str, str] = {}
        self._awaited: dict[str, str] = {}

    @property
    def faults(self) -> tuple[str, ...]:
        """Why the newest of each input is refused, "" if it is not."""
        return tuple(self._faults.values())

    @property
    def kinds_of_fault(self) -> tuple[str, ...]:
        """The faults without their figures: what counts as a change."""
        return tuple(re.sub(r"[\d.]+", "", fault) for fault in self.faults)

    def received(self, name: str, stamp_ns: int, now_s: float) -> None:
        """An input was received."""
        self.rates[name].add(stamp_ns, now_s)

    def set_fault(self, name: str, fault: str) -> None:
        """Why the newest of an input is refused, "" if it is not."""
        self._faults[name] = fault

    def set_awaited(self, name: str, text: str) -> None:
        """That an input is awaited which comes once, "" if it is not."""
        self._awaited[name] = text

    def status(
        self,
        now_s: float,
        timeout_s: float,
        refused: Mapping[str, int],
        note: str = "",
        more: Mapping[str, str] | None = None,
    ) -> Status:
        """The status "inputs": rates, ages, refused messages by kind, and faults.

        note is what to warn of where there is no fault; more are other values.
        """
        fault = next(filter(None, self.faults), "")
        values: dict[str, str] = {}
        silent = {name: text for name, text in self._awaited.items() if text}
        for name, rate in self.rates.items():
            age_s = rate.age_s(now_s)
            if age_s is None:
                silent[name] = f"no {name} yet"
            elif age_s > timeout_s:
                silent[name] = f"{name} stale for {age_s:.2f} s (input_timeout_s={timeout_s:g})"
            values[f"{name}: rate [Hz]"] = f"{rate.rate_hz(now_s):.2f}"
            values[f"{name}: age [s]"] = "never" if age_s is None else f"{age_s:.3f}"
        values |= more or {}
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
        sound = f"{' and '.join(self.rates)} are sound"
        if note:
            return Status("inputs", Level.WARN, f"{sound}, but {note}", values)
        return Status("inputs", Level.OK, sound, values)


def driving_status(
    decision: Decision | None, phase: Phase, state: str, values: Mapping[str, str]
) -> Status:
    """The status "driving": mode and reason of a decision; state is that of the life cycle."""
    fields = {"state": state, "mode": decision.mode.value if decision else "none"}
    fields |= {"recovery": phase.value, **values}
    if state != "active":
        return Status("driving", Level.OK, f"{state}: commands nothing", fields)
    if decision is None:
        return Status("driving", Level.OK, "nothing decided yet", fields)
    level = {Mode.STOPPED: Level.ERROR, Mode.BLOCKED: Level.WARN}.get(decision.mode, Level.OK)
    if phase is Phase.GIVEN_UP:
        level = Level.ERROR
    return Status("driving", level, decision.reason, fields)
