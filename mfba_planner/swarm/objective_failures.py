# SPDX-License-Identifier: Apache-2.0
"""Objective values that are not finite numbers, and calls that raise: classified and counted."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from .search_region import Vector

Evaluate = Callable[[list[Vector]], Sequence[Any]]


@dataclass(slots=True)
class Failures:
    """How often an objective failed, by kind of failure, and the first failure with its point."""

    counts: dict[str, int] = field(default_factory=dict)
    first: str = ""
    broken: int = 0  # raised, or returned something that is not a number

    def number(self, value: Any, x: object) -> float:
        """Return the value as a float; count it if it is not a finite number.

        +inf is returned as it is, any other failure as NaN.
        """
        name, number = _classify(value)
        if name:
            self.counts[name] = self.counts.get(name, 0) + 1
            self.broken += name not in ("NaN", "inf", "-inf")
            reason = f"{name} ({value})" if isinstance(value, Exception) else name
            self.first = self.first or f"{reason} at {x}"
        return number

    def __bool__(self) -> bool:
        """Whether any value has failed."""
        return bool(self.counts)

    def __str__(self) -> str:
        """One line: the counts, and the first failure."""
        if not self:
            return "no failures"
        counts = ", ".join(f"{count} x {name}" for name, count in self.counts.items())
        return " ".join(f"{counts}; first: {self.first}".split())


def each(objective: Callable[[Vector], float]) -> Evaluate:
    """An objective of one point as one of many; for a call that raises the value is its error."""

    def value(x: Vector) -> Any:
        try:
            return objective(x)
        except Exception as error:
            return error

    def evaluate(points: list[Vector]) -> list[Any]:
        values: list[Any] = []
        try:
            for x in points:
                values.append(objective(x))  # keeps the values before an exception
        except Exception as error:
            values.append(error)
            values += [value(x) for x in points[len(values) :]]
        return values

    return evaluate


def _classify(value: Any) -> tuple[str, float]:
    """Name of the failure ("" for none) and the number that replaces the value."""
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
