# SPDX-License-Identifier: Apache-2.0
"""Many independent swarms on arrays, with the same results as bat_swarm.py bit by bit.

Every run has its own generator and draws the same numbers as bat_swarm.py. Operations that could
differ in the last bit are done as there: exp by the math module (numpy's differs for 5 % of the
arguments), and the mean loudness rounded once, as by fsum. So an objective with equal bits gives
results with equal bits. Runs whose generators would be in the same state may share one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from ..core.errors import InputError
from .bat_swarm import (
    Acceptance,
    Algorithm,
    BatParams,
    Bounds,
    Box,
    Disc,
    Epsilon,
    Initial,
    Schedule,
    Step,
    Update,
    Velocity,
    Walk,
    draws_per_bat,
)

Array = np.ndarray
Objective = Callable[[Array], Array]

_SCALE, _LARGEST = 2.0**60, 2.0**63
CACHED_BATS = 8192  # bats iterated at once: their arrays fit into a processor's cache
DRAWN = 2**20  # most uniforms in memory


@dataclass(frozen=True, slots=True)
class BatchResult:
    """Results of R runs: best_value (R,), best_x (R, d), history (R, T + 1) of the best so far.

    failures (R,) counts the values of a run that were not finite.
    """

    best_value: Array
    best_x: Array
    history: Array
    failures: Array


def minimize_batch(
    objective: Objective, region: Box | Disc, params: BatParams, rngs: Sequence[Generator]
) -> BatchResult:
    """Run one swarm per generator; objective takes points (..., d) and returns values (...).

    Raises InputError for an objective that raises or returns another shape.
    """
    runs, d = len(rngs), len(region.span()[0])
    result = BatchResult(
        best_value=np.empty(runs),
        best_x=np.empty((runs, d)),
        history=np.empty((runs, params.iterations + 1)),
        failures=np.zeros(runs, dtype=np.int64),
    )
    at_once = max(1, CACHED_BATS // params.population)
    for start in range(0, runs, at_once):
        rows = slice(start, start + at_once)
        swarms = Swarms(objective, region, params, rngs[rows])
        result.history[rows] = swarms.run()
        result.best_value[rows] = swarms.best_value
        result.best_x[rows] = swarms.best_x.T
        result.failures[rows] = swarms.failures
    return result


class Swarms:
    """R swarms of n bats; coordinates come first: x and v are (d, R, n), best_x is (d, R).

    candidates (d, R, n) are those of the last iteration.
    """

    def __init__(
        self,
        objective: Objective,
        region: Box | Disc,
        params: BatParams,
        rngs: Sequence[Generator],
        shared: Sequence[int] | None = None,
    ) -> None:
        """Take one generator per run, or fewer: run i then uses generator number shared[i]."""
        self.objective, self.region, self.params, self.rngs = objective, region, params, rngs
        self.runs = len(rngs if shared is None else shared)
        # A single generator for all runs needs no index: numpy broadcasts its draws.
        self.shared = None if shared is None or len(rngs) == 1 else np.array(shared)
        self.d = len(region.span()[0])
        self.stride = draws_per_bat(params, self.d)

    def _start(self) -> None:
        """Draw and evaluate the first population."""
        n, d, runs, params = self.params.population, self.d, self.runs, self.params
        sign = 1.0 if params.initial is Initial.INSIDE else -1.0
        u = np.empty((len(self.rngs), n, d))
        for row, rng in zip(u, self.rngs):
            rng.random(out=row)
        if self.shared is not None:
            u = u[self.shared]
        self.x = np.empty((d, runs, n))
        for j, (low, high) in enumerate(zip(*self.region.span())):
            self.x[j] = low + sign * u[:, :, j] * (high - low)  # eq. 3
        self._bound(self.x)
        self.candidates = self.x.copy()
        self.v = np.zeros((d, runs, n))
        self.a = np.full((runs, n), params.a0)
        self.r = np.full((runs, n), params.r0)
        self.failures = np.zeros(runs, dtype=np.int64)
        self.row = np.arange(runs)
        self._average()
        values = self._value()
        self.values = _numbers(values)
        self.best_x = self.x[:, :, 0].copy()
        self.best_value = np.full(runs, math.inf)
        self._keep_best(values)

    def run(self) -> Array:
        """Run T iterations; best values (R, T + 1), first those of the initial population."""
        p = self.params
        history = np.empty((self.runs, p.iterations + 1))
        with np.errstate(over="ignore", invalid="ignore"):
            self._start()
            history[:, 0] = self.best_value
            done = 0
            per_iteration = len(self.rngs) * p.population * self.stride
            while done < p.iterations:
                count = min(p.iterations - done, max(1, DRAWN // per_iteration))
                for u in self._draw(count):
                    done += 1
                    self.candidates = self._iterate(u, done)
                    values = self._value()
                    self._accept(values, u[2], done)
                    self._keep_best(values)
                    history[:, done] = self.best_value
        return history

    def _draw(self, count: int) -> Array:
        """Uniforms of the next iterations, (count, stride, R or 1, n), as in bat_swarm.py."""
        n, stride = self.params.population, self.stride
        u = np.empty((count, stride, len(self.rngs), n))
        for i, rng in enumerate(self.rngs):
            u[:, :, i] = rng.random((count, n, stride)).transpose(0, 2, 1)
        return u if self.shared is None else u[:, :, self.shared]

    def _betas(self, u: Array, t: int) -> Array:
        p = self.params
        if p.algorithm is Algorithm.BA:
            return u
        t_eq_10 = min(1.0, t / p.iterations) if p.schedule is Schedule.NORMALIZED else t
        exponents = (-p.rho * u).ravel().tolist()
        betas = np.fromiter(map(math.exp, exponents), float, len(exponents))
        return t_eq_10 * betas.reshape(u.shape)  # eq. 10

    def _iterate(self, u: Array, t: int) -> Array:
        """Candidates (d, R, n) of iteration t, eq. 4-7, from its uniforms (stride, R, n)."""
        p = self.params
        sign = 1.0 if p.velocity is Velocity.TOWARDS_BEST else -1.0
        f = sign * (p.f_min + (p.f_max - p.f_min) * self._betas(u[0], t))  # eq. 4
        walk = u[1] > self.r
        scale = self.loudness[:, None]
        pair = self._pairs(u[-2], u[-1]) if p.step is Step.PAIR else None
        x, v, best = self.x, self.v, self.best_x[:, :, None]
        if p.inertia != 1.0:
            v *= p.inertia
        v += (best - x) * f  # eq. 5
        moved = x + v  # eq. 6
        epsilon = 2.0 * (u[3:4] if p.epsilon is Epsilon.SCALAR else u[3 : 3 + self.d]) - 1.0
        if pair:
            one, other = (np.take_along_axis(x, bats[None], axis=2) for bats in pair)
            epsilon = epsilon * (other - one)
        candidates = (best if p.walk is Walk.BEST else moved) + scale * epsilon  # eq. 7
        np.copyto(candidates, moved, where=~walk)
        self._bound(candidates)
        return candidates

    def _pairs(self, ones: Array, others: Array) -> tuple[Array, Array]:
        """For every bat, the numbers (R, n) of two different bats picked at random."""
        n = self.params.population
        a = (ones * n).astype(np.int64)
        return a, (a + 1 + (others * (n - 1)).astype(np.int64)) % n

    def _value(self) -> Array:
        """The objective at the candidates as (R, n) values."""
        points = self.candidates.transpose(1, 2, 0)
        try:
            values = np.array(self.objective(points), dtype=float)
        except Exception as error:
            raise InputError(
                f"objective raised {type(error).__name__} ({error}) at points of shape "
                f"{points.shape}; give a function of points (..., d)"
            ) from error
        if values.shape != points.shape[:-1]:
            raise InputError(
                f"objective returned shape {values.shape} for points of shape {points.shape}; "
                f"return {points.shape[:-1]}"
            )
        finite = np.isfinite(values)
        self.finite = bool(finite.all())
        if not self.finite:
            self.failures += np.count_nonzero(~finite, axis=1)
            values[values == -math.inf] = math.nan
        return values

    def _accept(self, values: Array, accept_draw: Array, t: int) -> None:
        """Accept candidates that are good enough, with probability A_i; then eq. 8 and 9."""
        p = self.params
        limit: Array | float = self.values
        if p.acceptance is not Acceptance.OWN:
            limit = self.best_value[:, None] if p.acceptance is Acceptance.BEST else math.inf
        accepted = (values <= limit) & (accept_draw < self.a)
        np.copyto(self.x, self.candidates, where=accepted)
        np.copyto(self.values, values, where=accepted)
        changed = accepted if p.update is Update.ACCEPTED else np.full_like(accepted, True)
        np.multiply(self.a, p.alpha, out=self.a, where=changed)  # eq. 8
        np.copyto(self.r, p.r0 * (1.0 - math.exp(-p.gamma * t)), where=changed)  # eq. 9
        if p.alpha != 1.0:
            self._average()

    def _average(self) -> None:
        """Sigma times the mean loudness, rounded once, as by fsum.

        Where all loudnesses are multiples of 2^-60, their sum as integers is exact.
        """
        p, scaled = self.params, self.a * _SCALE
        if self.a.size and scaled.max() * p.population < _LARGEST:
            whole = scaled.astype(np.int64)
            if (whole == scaled).all():
                self.loudness = p.sigma * (whole.sum(axis=1) / _SCALE) / p.population
                return
        sums = [p.sigma * math.fsum(a) / p.population for a in self.a.tolist()]
        self.loudness = np.array(sums)

    def _keep_best(self, values: Array) -> None:
        """Update the best where the best candidate is better."""
        values = values if self.finite else _numbers(values)
        first = values.argmin(axis=1)
        least = values[self.row, first]
        better = least < self.best_value
        np.copyto(self.best_value, least, where=better)
        np.copyto(self.best_x, self.candidates[:, self.row, first], where=better)

    def _bound(self, x: Array) -> None:
        """Move (d, R, n) points outside to the edge of the region."""
        if self.params.bounds is Bounds.NONE:
            return
        if isinstance(self.region, Disc):
            _into_disc(x, self.region)
        else:
            _into_box(x, self.region)


def _into_box(x: Array, box: Box) -> None:
    """As Box.clamp: each coordinate is cut to its interval, NaN to the lower edge."""
    for xj, low, high in zip(x, *box.span()):
        np.copyto(xj, low, where=~(xj > low))
        np.copyto(xj, high, where=~(xj < high))


def _into_disc(x: Array, disc: Disc) -> None:
    """As Disc.clamp: a point outside is moved along its radius to the edge."""
    center = np.array(disc.center)[:, None, None]
    offset = x - center
    squares = offset * offset
    norm = np.sqrt(squares[0] + squares[1])
    outside = norm > disc.radius
    offset *= disc.radius / np.maximum(norm, disc.radius)
    offset += center
    np.copyto(x, offset, where=outside)


def _numbers(values: Array) -> Array:
    """The values with NaN replaced by inf."""
    return np.where(np.isnan(values), math.inf, values)
