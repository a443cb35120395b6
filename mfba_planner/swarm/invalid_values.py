# SPDX-License-Identifier: Apache-2.0
"""Values of an objective that are no numbers: named and counted, so that the run goes on."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any


@dataclass(slots=True)
class Failures:
    """How often an objective failed, by name, and the first failure with its point."""

    counts: dict[str, int] = field(default_factory=dict)
    first: str = ""
    broken: int = 0  # raised, or returned what is no number at all

    def number(self, value: Any, x: object) -> float:
        """Return the value as a float; what is no finite number is counted.

        +inf stays what it is, the worst of all; NaN stands for everything else.
        """
        name, number = _judge(value)
        if name:
            self.counts[name] = self.counts.get(name, 0) + 1
            self.broken += name not in ("NaN", "inf", "-inf")
            reason = f"{name} ({value})" if isinstance(value, Exception) else name
            self.first = self.first or f"{reason} at {x}"
        return number

    def __bool__(self) -> bool:
        """Tell whether anything has failed."""
        return bool(self.counts)

    def __str__(self) -> str:
        """One line: how many of what, and the first."""
        if not self:
            return "no failures"
        parts = ", ".join(f"{count} x {name}" for name, count in self.counts.items())
        return " ".join(f"{parts}; first: {self.first}".split())


def _judge(value: Any) -> tuple[str, float]:
    """Name of a failure ("" for none) and the number that stands for the value."""
    if isinstance(value, BaseException):
        return f"raised {type(value).__name__}", math.nan
    shape = getattr(value, "shape", ())
    if shape != () or isinstance(value, (str, bytes)):
        what = f"array of shape {shape}" if shape else type(value).__name__
        return f"returned {what}", math.nan
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        return f"returned {type(value).__name__}", math.nan
    if math.isfinite(number):
        return "", number
    if number == math.inf:
        return "inf", number
    return "-inf" if number == -math.inf else "NaN", math.nan
