# SPDX-License-Identifier: Apache-2.0
"""Many independent swarms at once: bat.py's equations on arrays, the same results bit by bit.

Every run has a generator of its own and draws what bat.py would draw; a stream read in one
piece or in many is the same stream. What could differ in the last bit is done as bat.py does
it: exp by the math module (numpy's differs in 5 % of the arguments), the mean loudness by
fsum. So equal bits from the objective give equal bits in the result.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from .bat import (
    Acceptance,
    Algorithm,
    BatParams,
    Bounds,
    Box,
    Epsilon,
    Initial,
    Schedule,
    Step,
    Update,
    Velocity,
    Walk,
    draws_per_bat,
)
from .errors import InputError

Array = np.ndarray
Objective = Callable[[Array], Array]

CACHED_BATS = 8192  # flown at once: their arrays fit a processor's cache
DRAWN = 2**20  # uniforms held at once


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
    objective: Objective, box: Box, params: BatParams, rngs: Sequence[Generator]
) -> BatchResult:
    """Run one swarm per generator; objective takes points (..., d) and returns values (...).

    Raises InputError for an objective that raises or returns another shape.
    """
    runs, d = len(rngs), len(box.lower)
    result = BatchResult(
        best_value=np.empty(runs),
        best_x=np.empty((runs, d)),
        history=np.empty((runs, params.iterations + 1)),
        failures=np.zeros(runs, dtype=np.int64),
    )
    at_once = max(1, CACHED_BATS // params.population)
    for begin in range(0, runs, at_once):
        rows = slice(begin, begin + at_once)
        swarms = _Swarms(objective, box, params, rngs[rows])
        with np.errstate(over="ignore", invalid="ignore"):
            swarms.run(result.history[rows])
        result.best_value[rows] = swarms.best_value
        result.best_x[rows] = swarms.best_x.T
        result.failures[rows] = swarms.failures
    return result


class _Swarms:
    """R swarms of n bats; coordinates come first: x and v are (d, R, n), best_x is (d, R)."""

    def __init__(
        self, objective: Objective, box: Box, params: BatParams, rngs: Sequence[Generator]
    ) -> None:
        self.objective, self.box, self.params, self.rngs = objective, box, params, rngs
        n, d, runs = params.population, len(box.lower), len(rngs)
        sign = 1.0 if params.initial is Initial.INSIDE else -1.0
        u = np.empty((runs, n, d))
        for row, rng in zip(u, rngs):
            rng.random(out=row)
        self.x = np.empty((d, runs, n))
        for j, (low, high) in enumerate(zip(*box.span())):
            self.x[j] = low + sign * u[:, :, j] * (high - low)  # eq. 3
        self._bound(self.x)
        self.v = np.zeros((d, runs, n))
        self.a = np.full((runs, n), params.a0)
        self.r = np.full((runs, n), params.r0)
        self.failures = np.zeros(runs, dtype=np.int64)
        self.row = np.arange(runs)
        self.loudness = np.empty(runs)
        self._average(self.row)
        values = self._value(self.x)
        self.values = _numbers(values)
        self.stride = draws_per_bat(params, d)
        self.best_x = self.x[:, :, 0].copy()
        self.best_value = np.full(runs, math.inf)
        self._keep_best(self.x, values)

    def run(self, history: Array) -> None:
        """Fly T iterations and write the best value after each into history (R, T + 1)."""
        p = self.params
        history[:, 0] = self.best_value
        done = 0
        each = len(self.rngs) * p.population * self.stride
        while done < p.iterations:
            count = min(p.iterations - done, max(1, DRAWN // each))
            for u in self._draw(count):
                done += 1
                candidates = self._fly(u, done)
                values = self._value(candidates)
                self._accept(candidates, values, u[2], done)
                self._keep_best(candidates, values)
                history[:, done] = self.best_value

    def _draw(self, count: int) -> Array:
        """Uniforms of so many iterations, (count, stride, R, n): bat.py's order within a run."""
        n, stride = self.params.population, self.stride
        u = np.empty((count, stride, len(self.rngs), n))
        for i, rng in enumerate(self.rngs):
            u[:, :, i] = rng.random((count, n, stride)).transpose(0, 2, 1)
        return u

    def _betas(self, u: Array, t: int) -> Array:
        p = self.params
        if p.algorithm is Algorithm.BA:
            return u
        when = min(1.0, t / p.iterations) if p.schedule is Schedule.NORMALIZED else t
        exponents = (-p.rho * u).ravel().tolist()
        betas = np.fromiter(map(math.exp, exponents), float, len(exponents))
        return when * betas.reshape(u.shape)  # eq. 10

    def _fly(self, u: Array, t: int) -> Array:
        """Candidates (d, R, n) of iteration t, eq. 4-7, from its uniforms (stride, R, n)."""
        p = self.params
        sign = 1.0 if p.velocity is Velocity.TOWARDS_BEST else -1.0
        f = sign * (p.f_min + (p.f_max - p.f_min) * self._betas(u[0], t))  # eq. 4
        walk = u[1] > self.r
        scale = self.loudness[:, None]
        pair = self._pairs(u[-2], u[-1]) if p.step is Step.PAIR else None
        candidates = np.empty_like(self.x)
        for j, (x, v, best) in enumerate(zip(self.x, self.v, self.best_x)):
            v *= p.inertia
            v += (best[:, None] - x) * f  # eq. 5
            flown = x + v  # eq. 6
            epsilon = 2.0 * u[3 + (0 if p.epsilon is Epsilon.SCALAR else j)] - 1.0
            if pair:
                here, there = (np.take_along_axis(x, bats, axis=1) for bats in pair)
                epsilon *= there - here
            base = best[:, None] if p.walk is Walk.BEST else flown
            candidates[j] = np.where(walk, base + scale * epsilon, flown)  # eq. 7
        self._bound(candidates)
        return candidates

    def _pairs(self, ones: Array, others: Array) -> tuple[Array, Array]:
        """For every bat, the numbers (R, n) of two different bats picked at random."""
        n = self.params.population
        a = (ones * n).astype(np.int64)
        return a, (a + 1 + (others * (n - 1)).astype(np.int64)) % n

    def _value(self, x: Array) -> Array:
        """The objective at (d, R, n) points as (R, n) values."""
        points = np.moveaxis(x, 0, -1)
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
        if not finite.all():
            self.failures += np.count_nonzero(~finite, axis=1)
            values[values == -math.inf] = math.nan
        return values

    def _accept(self, candidates: Array, values: Array, gate: Array, t: int) -> None:
        """Take what is good enough, with probability A_i; then eq. 8 and 9."""
        p = self.params
        limit: Array | float = self.values
        if p.acceptance is not Acceptance.OWN:
            limit = self.best_value[:, None] if p.acceptance is Acceptance.BEST else math.inf
        accepted = (values <= limit) & (gate < self.a)
        np.copyto(self.x, candidates, where=accepted)
        np.copyto(self.values, values, where=accepted)
        changed = accepted if p.update is Update.ACCEPTED else np.full_like(accepted, True)
        np.multiply(self.a, p.alpha, out=self.a, where=changed)  # eq. 8
        self.r[changed] = p.r0 * (1.0 - math.exp(-p.gamma * t))  # eq. 9
        if p.alpha != 1.0:
            self._average(np.flatnonzero(changed.any(axis=1)))

    def _average(self, rows: Array) -> None:
        """Sigma times the mean loudness, for the runs in which it has changed."""
        p = self.params
        sums = [p.sigma * math.fsum(a) / p.population for a in self.a[rows].tolist()]
        self.loudness[rows] = sums

    def _keep_best(self, candidates: Array, values: Array) -> None:
        values = _numbers(values)
        first = values.argmin(axis=1)
        least = values[self.row, first]
        better = least < self.best_value
        self.best_value[better] = least[better]
        self.best_x[:, better] = candidates[:, better, first[better]]

    def _bound(self, x: Array) -> None:
        """Cut (d, R, n) points to the box, a NaN to its lower edge, as Box.clamp does."""
        if self.params.bounds is Bounds.CLAMP:
            for xj, low, high in zip(x, *self.box.span()):
                np.copyto(xj, low, where=~(xj > low))
                np.copyto(xj, high, where=~(xj < high))


def _numbers(values: Array) -> Array:
    """A NaN is worse than any number."""
    return np.where(np.isnan(values), math.inf, values)
