# SPDX-License-Identifier: Apache-2.0
"""The bat swarm: BA (eq. 3-9) and MFBA (eq. 10), ask/tell, with the paper's gaps as options."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from numpy.random import Generator

from .errors import ConfigError, InputError
from .options import check, option

Vector = list[float]


class Algorithm(Enum):
    """Which law draws beta of eq. 4."""

    BA = "ba"
    MFBA = "mfba"


class Velocity(Enum):
    """Eq. 5 as printed flies away from the best; the literature's sign flies towards it."""

    TOWARDS_BEST = "towards_best"
    AS_PRINTED = "as_printed"


class Schedule(Enum):
    """Eq. 10's t: t/T stays in [0, 1] as eq. 4 demands; the raw t is what is printed."""

    NORMALIZED = "normalized"
    RAW = "raw"


class Bounds(Enum):
    """Whether a bat that leaves the search region is put back onto its edge."""

    CLAMP = "clamp"
    NONE = "none"


class Epsilon(Enum):
    """Whether epsilon of eq. 7 is drawn per coordinate or once for all of them."""

    PER_COORDINATE = "per_coordinate"
    SCALAR = "scalar"


class Initial(Enum):
    """Eq. 3 with the sign that lands inside the box, or as printed (mirrored outside)."""

    INSIDE = "inside"
    AS_PRINTED = "as_printed"


class Walk(Enum):
    """Where the local walk of eq. 7 starts: the best ever seen, or the bat itself."""

    BEST = "best"
    SELF = "self"


@dataclass(frozen=True, slots=True, kw_only=True)
class BatParams:
    """Constants of section 6.2 and the reading `robust` of what the paper leaves open."""

    algorithm: Algorithm = option(Algorithm.MFBA, "beta is random (ba) or follows eq. 10 (mfba)")
    population: int = option(5, "number of bats", minimum=2, maximum=10_000)
    iterations: int = option(5, "iterations T of one run", minimum=1, maximum=1_000_000)
    a0: float = option(1.0, "initial loudness A_i(0)", minimum=0.0, maximum=100.0)
    r0: float = option(0.5, "initial pulse rate r_i(0)", minimum=0.0, maximum=1.0)
    alpha: float = option(0.98, "loudness decay of eq. 8", minimum=0.0, maximum=1.0)
    gamma: float = option(0.8, "pulse rate growth of eq. 9", minimum=0.0, maximum=100.0)
    f_min: float = option(0.0, "lowest frequency of eq. 4", minimum=0.0, maximum=1000.0)
    f_max: float = option(10.0, "highest frequency of eq. 4", minimum=0.0, maximum=1000.0)
    sigma: float = option(
        0.3, "scale of the local walk of eq. 7", unit="of x", minimum=0.0, maximum=1e6
    )
    rho: float = option(0.01, "rho of eq. 10", minimum=0.0, maximum=100.0)
    velocity: Velocity = option(Velocity.TOWARDS_BEST, "sign of eq. 5")
    schedule: Schedule = option(Schedule.NORMALIZED, "t of eq. 10: t/T or the raw t")
    bounds: Bounds = option(Bounds.CLAMP, "what happens at the edge of the search region")
    epsilon: Epsilon = option(Epsilon.PER_COORDINATE, "how epsilon of eq. 7 is drawn")
    initial: Initial = option(Initial.INSIDE, "sign of eq. 3")
    walk: Walk = option(Walk.BEST, "start of the local walk of eq. 7")

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)
        if self.f_min > self.f_max:
            raise ConfigError(
                f"f_min={self.f_min:g}: above f_max={self.f_max:g}; give f_min <= f_max"
            )


class Region(Protocol):
    """Where the bats search."""

    def span(self) -> tuple[Vector, Vector]:
        """Return x_min and x_max of eq. 3, d floats each."""

    def clamp(self, x: Vector) -> Vector:
        """Return x, or the point of the edge that replaces an x outside."""


@dataclass(frozen=True, slots=True)
class Box:
    """Axis-aligned box [lower, upper], d floats each; raises ConfigError if empty or infinite."""

    lower: tuple[float, ...]
    upper: tuple[float, ...]

    def __post_init__(self) -> None:
        """Refuse a box in which nothing can be searched."""
        if not self.lower or len(self.lower) != len(self.upper):
            raise ConfigError(
                f"box of {len(self.lower)} lower and {len(self.upper)} upper bounds: "
                "give d >= 1 of each"
            )
        for low, high in zip(self.lower, self.upper):
            if not (math.isfinite(low) and math.isfinite(high) and low <= high):
                raise ConfigError(f"bounds [{low}, {high}]: give finite lower <= upper")

    def span(self) -> tuple[Vector, Vector]:
        """The box itself."""
        return list(self.lower), list(self.upper)

    def clamp(self, x: Vector) -> Vector:
        """Each coordinate is cut to its interval."""
        return [min(high, max(low, v)) for v, low, high in zip(x, self.lower, self.upper)]


@dataclass(frozen=True, slots=True)
class Disc:
    """Disc in the plane: the points a robot can reach in one step."""

    radius: float
    center: tuple[float, float] = (0.0, 0.0)

    def span(self) -> tuple[Vector, Vector]:
        """The disc's bounding square."""
        (cx, cy), r = self.center, self.radius
        return [cx - r, cy - r], [cx + r, cy + r]

    def clamp(self, x: Vector) -> Vector:
        """A point outside is drawn back along its radius."""
        (cx, cy), (px, py) = self.center, x
        dx, dy = px - cx, py - cy
        norm = math.sqrt(dx * dx + dy * dy)
        if norm <= self.radius:
            return x
        scale = self.radius / norm
        return [cx + dx * scale, cy + dy * scale]


class BatSwarm:
    """One swarm that minimises: `ask()` for n candidates, `tell()` their n values, repeat.

    The first ask returns the initial population of eq. 3, each later one the candidates of
    iteration t = 1, 2, ... (eq. 4-7); tell accepts or refuses them (eq. 8, 9). Synchronous:
    all bats of an iteration see the best of the iterations before.
    """

    __slots__ = (
        "_a",
        "_asked",
        "_r",
        "_rng",
        "_uniforms",
        "_v",
        "_values",
        "_x",
        "best_value",
        "best_x",
        "candidates",
        "horizon",
        "params",
        "region",
        "t",
    )

    def __init__(
        self, params: BatParams, region: Region, rng: Generator, horizon: int | None = None
    ) -> None:
        """Draw the initial population (eq. 3) from rng, the only source of randomness.

        horizon is T of eq. 10 where it is not params.iterations.
        """
        self.params = params
        self.horizon = horizon or params.iterations
        self.region = region
        self.t = 0
        self.best_x: Vector = []
        self.best_value = math.inf
        self._rng = rng
        self._asked = False
        n = params.population
        low, high = region.span()
        d = len(low)
        sign = 1.0 if params.initial is Initial.INSIDE else -1.0
        u = rng.random(n * d).tolist()
        self._x = self._bounded(
            [
                [lo + sign * uj * (hi - lo) for lo, hi, uj in zip(low, high, u[k : k + d])]
                for k in range(0, n * d, d)
            ]
        )
        self._v = [[0.0] * d for _ in range(n)]
        self._a = [params.a0] * n
        self._r = [params.r0] * n
        self._values = [math.inf] * n
        self._uniforms: Vector = []
        self.candidates = list(self._x)

    def ask(self) -> list[Vector]:
        """Return n candidates of d floats; asking twice without tell returns the same ones."""
        if not self._asked:
            self._asked = True
            if self.best_x:
                self.t += 1
                self.candidates = self._fly()
        return self.candidates

    def tell(self, values: Sequence[float]) -> None:
        """Take the n objective values of the candidates last asked for; lower is better.

        Raises InputError for a wrong count; a NaN is never accepted and never the best.
        """
        n = self.params.population
        if len(values) != n:
            raise InputError(f"{len(values)} values told for {n} bats: tell one per candidate")
        if not self._asked:
            raise InputError("tell without ask: call ask() for the next candidates first")
        self._asked = False
        if not self.best_x:
            self.best_x = self.candidates[0]
            self._values = [math.inf if v != v else v for v in values]
        else:
            self._accept(values)
        self._keep_best(self.candidates, values)

    def resettle(self, region: Region, objective: Callable[[Vector], float]) -> None:
        """Draw bats and best into another region and value them again, between tell and ask.

        Raises InputError at any other moment.
        """
        if self._asked or not self.best_x:
            raise InputError("resettle before tell: tell the values of the candidates first")
        self.region = region
        self._x = self._bounded(self._x)
        self._values = [objective(x) for x in self._x]
        self.best_x = self._bounded([self.best_x])[0]
        self.best_value = objective(self.best_x)
        self._keep_best(self._x, self._values)

    def beta(self, u: float) -> float:
        """Beta of eq. 4 from a uniform draw u: u itself (BA), or eq. 10 (MFBA)."""
        return self._betas([u])[0]

    def _betas(self, u: Vector) -> Vector:
        """Beta of every bat; the normalized t stays in [0, 1] beyond iteration T as well."""
        p = self.params
        if p.algorithm is Algorithm.BA:
            return u
        t = min(1.0, self.t / self.horizon) if p.schedule is Schedule.NORMALIZED else self.t
        return [t * math.exp(-p.rho * ui) for ui in u]

    def _fly(self) -> list[Vector]:
        """Candidates of one iteration, eq. 4-7.

        Every bat draws beta, gate, acceptance and d epsilons each time, used or not, so that
        one draw more or less never shifts the others.
        """
        p, best = self.params, self.best_x
        n, d = p.population, len(best)
        stride = 3 + d
        u = self._uniforms = self._rng.random(n * stride).tolist()
        # Eq. 5 with the sign that flies towards the best; the printed one is -f.
        sign = 1.0 if p.velocity is Velocity.TOWARDS_BEST else -1.0
        f_span = p.f_max - p.f_min
        f = [sign * (p.f_min + f_span * beta) for beta in self._betas(u[::stride])]  # eq. 4
        scale = p.sigma * math.fsum(self._a) / n
        from_best = p.walk is Walk.BEST
        per_coordinate = 0 if p.epsilon is Epsilon.SCALAR else 1
        dimensions = range(d)
        candidates = []
        for k, x, v, fi, r in zip(range(0, n * stride, stride), self._x, self._v, f, self._r):
            walk = u[k + 1] > r
            point = []
            for j in dimensions:
                v[j] += (best[j] - x[j]) * fi  # eq. 5
                xj = x[j] + v[j]  # eq. 6
                if walk:
                    epsilon = 2.0 * u[k + 3 + j * per_coordinate] - 1.0
                    xj = (best[j] if from_best else xj) + scale * epsilon  # eq. 7
                point.append(xj)
            candidates.append(point)
        return self._bounded(candidates)

    def _accept(self, values: Sequence[float]) -> None:
        """Take candidates that are not worse, with probability A_i; then eq. 8 and 9."""
        p = self.params
        stride = 3 + len(self.best_x)
        rate = p.r0 * (1.0 - math.exp(-p.gamma * self.t))  # eq. 9
        for i, value in enumerate(values):
            if value <= self._values[i] and self._uniforms[i * stride + 2] < self._a[i]:
                self._x[i] = self.candidates[i]
                self._values[i] = value
                self._a[i] *= p.alpha  # eq. 8
                self._r[i] = rate

    def _keep_best(self, points: list[Vector], values: Sequence[float]) -> None:
        for x, value in zip(points, values):
            if value < self.best_value:
                self.best_x, self.best_value = x, value

    def _bounded(self, points: list[Vector]) -> list[Vector]:
        if self.params.bounds is Bounds.NONE:
            return points
        clamp = self.region.clamp
        return [clamp(x) for x in points]


def minimize(
    objective: Callable[[Vector], float], region: Region, params: BatParams, rng: Generator
) -> BatSwarm:
    """Run one swarm for params.iterations and return it; see best_x and best_value."""
    swarm = BatSwarm(params, region, rng)
    for _ in range(params.iterations + 1):
        swarm.tell([objective(x) for x in swarm.ask()])
    return swarm
