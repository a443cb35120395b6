# SPDX-License-Identifier: Apache-2.0
"""One bat swarm, BA (eq. 3-9) or MFBA (eq. 10), with an ask/tell interface; minimize()."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from numpy.random import Generator

from ..core.errors import InputError
from .bat_params import (
    Acceptance,
    Algorithm,
    BatParams,
    Bounds,
    Epsilon,
    Initial,
    Schedule,
    Step,
    Update,
    Velocity,
    Walk,
)
from .objective_failures import Failures, each
from .search_region import Box, Disc, Region, Vector
from .swarm_iteration import BatMotion, Pair

__all__ = [
    "Acceptance", "Algorithm", "BatParams", "BatSwarm", "Bounds", "Box", "Disc", "Epsilon",
    "Failures", "Initial", "Region", "Schedule", "Step", "Update", "Vector", "Velocity", "Walk",
    "draws_per_bat", "minimize",
]  # fmt: skip

DRAWN_AHEAD = 2**14  # most uniforms drawn in one block


def draws_per_bat(params: BatParams, d: int) -> int:
    """Uniforms of one bat in one iteration: beta, walk, acceptance, d epsilons, 2 for a pair."""
    return 3 + d + (2 if params.step is Step.PAIR else 0)


class BatSwarm:
    """One swarm that minimizes: `ask()` for n candidates, `tell()` their n values, repeat.

    The first ask returns the initial population of eq. 3, each later one the candidates of
    iteration t = 1, 2, ... (eq. 4-7); tell accepts or refuses them (eq. 8, 9). Synchronous:
    all bats of an iteration use the best of the previous iterations. best_x and best_value are
    the best so far; failures counts the values that were not finite numbers.
    """

    __slots__ = (
        "_a",
        "_accept_draws",
        "_accept_start",
        "_ahead",
        "_always_update",
        "_asked",
        "_draw_iterators",
        "_is_ba",
        "_iteration",
        "_limit",
        "_normalized",
        "_pair_draws",
        "_paired",
        "_per_coordinate",
        "_r",
        "_rng",
        "_scale",
        "_stride",
        "_v",
        "_values",
        "_x",
        "best_value",
        "best_x",
        "candidates",
        "failures",
        "horizon",
        "params",
        "region",
        "t",
    )  # fmt: skip

    def __init__(
        self,
        params: BatParams,
        region: Region,
        rng: Generator,
        horizon: int | None = None,
        *,
        ahead: int = 1,
    ) -> None:
        """Draw the initial population (eq. 3) from rng, the only source of randomness.

        horizon is T of eq. 10 (default: params.iterations). The draws of iterations up to `ahead`
        are taken in blocks: faster, with the same result.
        """
        self.params = params
        self.horizon = horizon or params.iterations
        self.region = region
        low, high = region.span()
        d = len(low)
        self._iteration = BatMotion.of(params, region).iteration(d)
        self.t = 0
        self.best_x: Vector = []
        self.best_value = math.inf
        self.failures = Failures()
        self._rng = rng
        self._ahead = ahead
        self._asked = False
        n = params.population
        sign = 1.0 if params.initial is Initial.INSIDE else -1.0
        sides = [(lo, sign * (hi - lo)) for lo, hi in zip(low, high)]
        self._x = self._bounded(
            [
                [lo + uj * side for uj, (lo, side) in zip(u, sides)]  # eq. 3
                for u in rng.random((n, d)).tolist()
            ]
        )
        self._stride = draws_per_bat(params, d)
        self._per_coordinate = params.epsilon is Epsilon.PER_COORDINATE
        self._paired = params.step is Step.PAIR
        self._is_ba = params.algorithm is Algorithm.BA
        self._normalized = params.schedule is Schedule.NORMALIZED
        self._always_update = params.update is Update.ALWAYS
        self._limit = None if params.acceptance is Acceptance.OWN else params.acceptance
        self._v = [[0.0] * d for _ in range(n)]
        self._a = [params.a0] * n
        self._scale = params.sigma * math.fsum(self._a) / n  # of eq. 7
        self._r = [params.r0] * n
        self._values = [math.inf] * n
        self._accept_draws: Vector = []  # acceptance draws of the current block of iterations
        self._accept_start = 0  # index of this iteration's first one
        self._draw_iterators: list[Iterator[float]] = []
        self._pair_draws: list[Iterator[float]] = []
        self.candidates = list(self._x)

    def ask(self) -> list[Vector]:
        """Return n candidates of d floats; a second call without tell() returns the same ones."""
        if not self._asked:
            self._asked = True
            if self.best_x:
                self.t += 1
                self.candidates = self._iterate()
        return self.candidates

    def tell(self, values: Sequence[Any]) -> None:
        """Take the n objective values of the last candidates; lower is better.

        A value that is not a finite number (an exception stands for a call that raised) is
        counted in failures. It never becomes the best, and only +inf can be accepted. Raises
        InputError for a wrong count.
        """
        n = self.params.population
        if len(values) != n:
            raise InputError(f"{len(values)} values for {n} bats: give one per candidate")
        if not self._asked:
            raise InputError("tell() without ask(): call ask() for the next candidates first")
        self._asked = False
        try:
            total = sum(values)
        except Exception:  # a value is not a number
            total = None
        finite = type(total) is float and total - total == 0.0
        if not finite:  # or the sum has overflowed
            values = [self.failures.number(v, x) for v, x in zip(values, self.candidates)]
        if not self.best_x:
            self.best_x = self.candidates[0]
            self._values = [math.inf if v != v else v for v in values]
        else:
            self._accept(values)
        if not finite:
            self._keep_best(self.candidates, values)
        elif (least := min(values)) < self.best_value:
            self.best_x, self.best_value = self.candidates[values.index(least)], least

    def change_region(self, region: Region, objective: Callable[[Vector], float]) -> None:
        """Clamp bats and best into another region, evaluate them again; between tell and ask only.

        Raises InputError between ask and tell, and before the first tell.
        """
        if self._asked or not self.best_x:
            raise InputError(
                "change_region() before tell(): give the values of the candidates first"
            )
        self.region = region
        self._iteration = BatMotion.of(self.params, region).iteration(len(self.best_x))
        self._x = self._bounded(self._x)
        self._values = [objective(x) for x in self._x]
        self.best_x = self._bounded([self.best_x])[0]
        self.best_value = objective(self.best_x)
        self._keep_best(self._x, self._values)

    def beta(self, u: float) -> float:
        """Beta of eq. 4 from a uniform draw u: u itself (BA), or eq. 10 (MFBA)."""
        return self._time() * self._beta_factors([u])[0]

    def _time(self) -> float:
        """The t of eq. 10; normalized, it stays 1 beyond iteration T."""
        if self._is_ba:
            return 1.0
        if not self._normalized:
            return self.t
        t = self.t / self.horizon
        return t if t < 1.0 else 1.0

    def _beta_factors(self, u: Vector) -> Vector:
        """Beta divided by t, for each draw."""
        if self._is_ba:
            return u
        exp, rate = math.exp, -self.params.rho
        return [exp(rate * ui) for ui in u]  # eq. 10

    def _draw(self) -> None:
        """Draw the uniforms of the next iterations, one iterator per purpose.

        Every bat draws all its uniforms in each iteration, used or not, so that no option
        shifts the draws of the others. Each iterator gives one value per bat and iteration.
        """
        n, d, stride = self.params.population, len(self.best_x), self._stride
        count = max(1, min(self._ahead - self.t + 1, DRAWN_AHEAD // (n * stride)))
        u = self._rng.random((count * n, stride)).T.tolist()
        # One epsilon per coordinate, or the first one for all.
        epsilons = u[3 : 3 + d] if self._per_coordinate else u[3:4] * d
        self._draw_iterators = list(map(iter, (self._beta_factors(u[0]), u[1], *epsilons)))
        if self._paired:
            self._pair_draws = [iter(u[3 + d]), iter(u[4 + d])]
        self._accept_draws = u[2]
        self._accept_start = 0

    def _iterate(self) -> list[Vector]:
        """Candidates of one iteration, eq. 4-7."""
        p = self.params
        self._accept_start += p.population
        if self._accept_start >= len(self._accept_draws):
            self._draw()
        pairs = self._pairs(*self._pair_draws) if self._paired else None
        bats = zip(self._x, self._v, self._r, *self._draw_iterators)
        return self._iteration(bats, self._time(), self.best_x, self._scale, pairs)

    def _pairs(self, ones: Iterator[float], others: Iterator[float]) -> list[Pair]:
        """For every bat, the positions of two different bats picked at random."""
        x = self._x
        n = len(x)
        picked = ((int(one * n), int(other * (n - 1))) for _, one, other in zip(x, ones, others))
        return [(x[a], x[(a + 1 + b) % n]) for a, b in picked]

    def _accept(self, values: Sequence[float]) -> None:
        """Accept candidates that are good enough, with probability A_i; then eq. 8 and 9."""
        p, own, a = self.params, self._values, self._a
        draws, start = self._accept_draws, self._accept_start
        limits = own
        if self._limit is not None:
            limit = self.best_value if self._limit is Acceptance.BEST else math.inf
            limits = [limit] * len(own)
        always = changed = self._always_update
        rate = p.r0 * (1.0 - math.exp(-p.gamma * self.t))  # eq. 9
        for i, value in enumerate(values):
            if value <= limits[i] and draws[start + i] < a[i]:
                self._x[i] = self.candidates[i]
                own[i] = value
            elif not always:
                continue
            changed = True
            a[i] *= p.alpha  # eq. 8
            self._r[i] = rate
        if changed:
            self._scale = p.sigma * math.fsum(a) / p.population

    def _keep_best(self, points: list[Vector], values: Sequence[float]) -> None:
        best = self.best_value
        for x, value in zip(points, values):
            if value < best:
                self.best_x, self.best_value = x, value
                best = value

    def _bounded(self, points: list[Vector]) -> list[Vector]:
        if self.params.bounds is Bounds.NONE:
            return points
        return [self.region.clamp(x) for x in points]


def minimize(
    objective: Callable[[Vector], float], region: Region, params: BatParams, rng: Generator
) -> BatSwarm:
    """Run one swarm for params.iterations and return it; see best_x, best_value and failures.

    Single failures of the objective are counted and the run continues. Raises InputError if
    every call raised or returned no number.
    """
    swarm = BatSwarm(params, region, rng, ahead=params.iterations)
    ask, tell, evaluate = swarm.ask, swarm.tell, each(objective)
    for _ in range(params.iterations + 1):
        tell(evaluate(ask()))
    if swarm.failures.broken == params.population * (params.iterations + 1):
        raise InputError(
            f"objective failed at all {swarm.failures.broken} points ({swarm.failures}); "
            "give a function that returns one number"
        )
    return swarm
