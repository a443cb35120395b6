# SPDX-License-Identifier: Apache-2.0
"""The benchmark functions F1-F6 of Table 2: formulas, search ranges, minima and minimizers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from ..core.errors import ConfigError
from ..swarm.search_region import Box

Point = tuple[float, ...]
Coordinates = Sequence[Any]  # d floats, or d arrays of one shape
STEEPNESS = 10  # m of Table 2


@dataclass(frozen=True, slots=True)
class Function:
    """A row of Table 2; kind: U (unimodal) or M (multimodal); dimension None: any d >= 1.

    terms(x, m) is the formula for floats (m = math) and for arrays (m = numpy). It multiplies
    instead of calling pow, so the two differ only in the last bit of sin, cos and exp.
    """

    key: str
    title: str
    formula: str
    kind: str
    lower: float
    upper: float
    terms: Callable[[Coordinates, Any], Any]
    positions: Callable[[int], tuple[Point, ...]]
    dimension: int | None = None

    def __call__(self, x: Sequence[float]) -> float:
        """Value at one point of d floats."""
        return float(self.terms(x, math))

    def batch(self, x: np.ndarray) -> np.ndarray:
        """Values of shape (...) at points of shape (..., d); NaN where not defined."""
        with np.errstate(over="ignore", invalid="ignore"):
            value: np.ndarray = self.terms([x[..., j] for j in range(x.shape[-1])], np)
        return value

    def box(self, d: int = 2) -> Box:
        """Search range in d dimensions; ConfigError for a d the function does not have."""
        self._check(d)
        return Box((self.lower,) * d, (self.upper,) * d)

    def minimizers(self, d: int = 2) -> tuple[Point, ...]:
        """All points of the search range with the minimum value."""
        self._check(d)
        return self.positions(d)

    def minimum(self, d: int = 2) -> float:
        """Least value in the search range."""
        return self(self.minimizers(d)[0])

    def _check(self, d: int) -> None:
        if self.dimension not in (None, d):
            raise ConfigError(f"{self.key} ({self.title}): d={d}; it has d = {self.dimension}")
        if d < 1:
            raise ConfigError(f"{self.key} ({self.title}): d={d}; give d >= 1")


def _total(terms: Iterable[Any]) -> Any:
    """Sum from left to right: since Python 3.12 sum() compensates floats, but not arrays."""
    total: Any = 0.0
    for term in terms:
        total = total + term
    return total


def _sphere(x: Coordinates, _: Any) -> Any:
    return _total(v * v for v in x)


def _easom(x: Coordinates, m: Any) -> Any:
    a, b = x[0] - math.pi, x[1] - math.pi
    return -m.cos(x[0]) * m.cos(x[1]) * m.exp(-(a * a) - b * b)


def _three_hump_camel(x: Coordinates, _: Any) -> Any:
    a, b = x[0], x[1]
    a2 = a * a
    return 2.0 * a2 - 1.05 * (a2 * a2) + a2 * a2 * a2 / 6.0 + a * b + b * b


def _booth(x: Coordinates, _: Any) -> Any:
    a, b = x[0] + 2.0 * x[1] - 7.0, 2.0 * x[0] + x[1] - 5.0
    return a * a + b * b


def _rastrigin(x: Coordinates, m: Any) -> Any:
    return 10.0 * len(x) + _total(v * v - 10.0 * m.cos(2.0 * math.pi * v) for v in x)


def _michalewicz(x: Coordinates, m: Any) -> Any:
    return -_total(_ridge(i, v, m) for i, v in enumerate(x, start=1))


def _ridge(i: int, v: Any, m: Any) -> Any:
    """Term i of F6, sin(v) sin^(2 m)(i v^2 / pi), by repeated squaring."""
    power, factor, left = 1.0, m.sin(i * (v * v) / math.pi), 2 * STEEPNESS
    while left:
        if left % 2:
            power = power * factor
        factor, left = factor * factor, left // 2
    return m.sin(v) * power


@cache
def _maximizer(i: int) -> float:
    """Maximizer of term i of F6 in [0, pi]; a local one is near each sin(i v^2 / pi) = 1 or -1."""
    return max(
        (_refine(i, math.pi * math.sqrt((k + 0.5) / i)) for k in range(i)),
        key=lambda v: _ridge(i, v, math),
    )


def _refine(i: int, v: float) -> float:
    """Newton's method on the slope of log(sin v) + 2 m log |sin(i v^2 / pi)|, starting from v."""
    for _ in range(50):
        w, dw = i * v * v / math.pi, 2.0 * i * v / math.pi
        slope = 1.0 / math.tan(v) + 2 * STEEPNESS * dw / math.tan(w)
        curvature = (
            -1.0 / math.sin(v) ** 2
            + 2 * STEEPNESS * (2.0 * i / math.pi) / math.tan(w)
            - 2 * STEEPNESS * (dw / math.sin(w)) ** 2
        )
        v -= slope / curvature
    return v


def _origin(d: int) -> tuple[Point, ...]:
    return ((0.0,) * d,)


def _maximizers(d: int) -> tuple[Point, ...]:
    return (tuple(_maximizer(i) for i in range(1, d + 1)),)


_ROWS = (
    Function("F1", "Sphere", "Σ xᵢ²", "U", -5.12, 5.12, _sphere, _origin),
    Function(
        "F2",
        "Easom",
        "-cos(x₁) cos(x₂) exp(-(x₁ - π)² - (x₂ - π)²)",
        "U",
        -100.0,
        100.0,
        _easom,
        lambda _: ((math.pi, math.pi),),
        2,
    ),
    Function(
        "F3",
        "Three Hump Camel",
        "2 x₁² - 1.05 x₁⁴ + x₁⁶/6 + x₁ x₂ + x₂²",
        "M",
        -5.0,
        5.0,
        _three_hump_camel,
        _origin,
        2,
    ),
    Function(
        "F4",
        "Booth",
        "(x₁ + 2 x₂ - 7)² + (2 x₁ + x₂ - 5)²",
        "U",
        -10.0,
        10.0,
        _booth,
        lambda _: ((1.0, 3.0),),
        2,
    ),
    Function(
        "F5", "Rastrigin", "10 d + Σ (xᵢ² - 10 cos(2π xᵢ))", "M", -5.12, 5.12, _rastrigin, _origin
    ),
    Function(
        "F6",
        "Michalewicz",
        "-Σ sin(xᵢ) sin²ᵐ(i xᵢ²/π), m = 10",
        "M",
        0.0,
        math.pi,
        _michalewicz,
        _maximizers,
    ),
)
FUNCTIONS: dict[str, Function] = {row.key: row for row in _ROWS}
