# SPDX-License-Identifier: Apache-2.0
"""Conformance of optimisers: budget, region, seed, random numbers, hash seed, failures, ends."""

from __future__ import annotations

import hashlib
import math
import os
import random
import signal
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import FrameType
from typing import Any, NamedTuple

import numpy as np

from ..core.errors import MfbaError, OptimizerError, OutsideError
from ..optimizers.registry import find_optimizer, make
from ..swarm.bat_swarm import BatParams
from ..swarm.optimizer import Factory, Found, RunOptimizer, each, search
from ..swarm.search_region import Disc, Vector
from .sweep.planner_sandbox import HungError

PATIENCE_S = 10.0
REGION = Disc(0.3, (1.0, -2.0))  # as of a planner: one goal step
POPULATION = 5
BUDGET, LEAST_BUDGET = 30, 10  # of a decision of paper and of predictive
_OPTIMUM = (1.21, -1.87)
_START_S = 60.0  # to start a process and import a library


class Property(NamedTuple):
    """One checked property: ok, or the reason for which the optimiser is refused."""

    name: str
    ok: bool
    text: str

    def __str__(self) -> str:
        return f"{'ok' if self.ok else 'fault':<6} {self.name:<20} {self.text}"


@dataclass(slots=True)
class Trial:
    """One search: its points, its result or its error."""

    points: list[Vector] = field(default_factory=list)
    found: Found | None = None
    optimizer: Any = None
    error: str = ""
    outside: bool = False

    @property
    def digest(self) -> str:
        """A digest of all points."""
        data = b"".join(struct.pack(f"<{len(x)}d", *x) for x in self.points)
        return hashlib.sha256(data).hexdigest()[:16]


class _Check:
    def __init__(self, name: str, patience_s: float) -> None:
        self.name, self.patience_s = name, patience_s
        self.factory: Factory = find_optimizer(name, BatParams())

    def trial(
        self,
        seed: int = 0,
        budget: int = BUDGET,
        objective: Callable[[Vector], float] | None = None,
    ) -> Trial:
        """A search on a planner's disc; what the optimiser does wrong is in error."""
        trial, evaluate = Trial(), each(objective or _distance)

        def recorded(points: list[Vector]) -> Sequence[Any]:
            trial.points += points
            return evaluate(points)

        try:
            with _time_limit(self.patience_s):
                generator = np.random.default_rng(seed)
                trial.optimizer = make(self.factory, REGION, budget, generator, POPULATION)
                trial.found = search(trial.optimizer, REGION, budget, recorded)
        except HungError:
            trial.error = f"does not end: {len(trial.points)} evaluations in {self.patience_s:g} s"
        except OptimizerError as error:
            trial.error, trial.outside = str(error), isinstance(error, OutsideError)
        return trial

    def properties(self) -> Iterator[Property]:
        """All properties; after the first fault that ends a search only that one."""
        with _global_states() as changed:
            first = self.trial()
        if first.error:
            yield Property("region" if first.outside else "ends", False, first.error)
            return
        yield Property("ends", True, "without an error")
        yield _region(first)
        yield self._budget(first)
        yield self._best(first)
        yield self._small_budget()
        again = self.trial()
        yield Property(
            "same seed",
            again.digest == first.digest,
            f"the same points ({first.digest})" if again.digest == first.digest else
            f"other points ({first.digest}, then {again.digest})",
        )  # fmt: skip
        yield self._other_seed(first)
        drawn = ", ".join(changed)
        yield Property(
            "random numbers",
            not drawn,
            f"changes the state of {drawn}; draw from the generator that is given"
            if drawn else "none from global generators",
        )  # fmt: skip
        yield self._other_processes(first)
        yield self._failures()

    def _budget(self, first: Trial) -> Property:
        used = len(first.points)
        text = f"{used} of {BUDGET} evaluations"
        if isinstance(first.optimizer, RunOptimizer):
            return Property("budget", True, text + (", then it ends" if used < BUDGET else ""))
        fresh = make(self.factory, REGION, BUDGET, np.random.default_rng(0), POPULATION)
        assert not isinstance(fresh, RunOptimizer)
        if (count := len(fresh.ask())) > BUDGET:
            return Property("budget", False, f"asks for {count} points at once of {BUDGET}")
        return Property("budget", True, text)

    def _best(self, first: Trial) -> Property:
        assert first.found is not None
        if isinstance(first.optimizer, RunOptimizer):
            return Property("best", True, "kept outside")
        try:
            kept = float(first.optimizer.best_value)
            x = [float(v) for v in first.optimizer.best_x]
        except (AttributeError, TypeError, ValueError) as error:
            return Property("best", False, f"best_x, best_value: {error}")
        best = first.found.best_value
        # The points of the last ask() are not told if they were more than the budget.
        earlier = zip(map(_distance, first.points[: -len(first.found.candidates)]), first.points)
        right = (kept, x) in ((best, first.found.best_x), min(earlier, default=(math.inf, x)))
        text = "best_x and best_value are the best told"
        if not right:
            text = f"best_value is {kept:.6g}, the best told {best:.6g}"
        return Property("best", right, text)

    def _small_budget(self) -> Property:
        least = self.trial(budget=LEAST_BUDGET)
        text = f"{len(least.points)} of {LEAST_BUDGET} evaluations"
        return Property("small budget", not least.error, least.error or text)

    def _other_seed(self, first: Trial) -> Property:
        other = self.trial(seed=1)
        same = other.digest == first.digest
        if same and getattr(self.factory, "deterministic", False):
            return Property("other seed", True, "the same points, as it says (deterministic)")
        text = "the same points; use the generator, or set deterministic = True"
        return Property("other seed", not same, text if same else "other points")

    def _other_processes(self, first: Trial) -> Property:
        digests, error = _digests_elsewhere(self.name, self.patience_s)
        if error:
            return Property("hash seed", False, error)
        same = set(digests) == {first.digest}
        text = "the same points with PYTHONHASHSEED 0 and 1"
        if not same:
            text = f"other points: {first.digest} here, {' and '.join(digests)} with 0 and 1"
        return Property("hash seed", same, text)

    def _failures(self) -> Property:
        for what, objective in (("NaN", _nan), ("inf", _inf), ("an exception", _raising)):
            trial = self.trial(objective=objective)
            if trial.error:
                return Property("failed values", False, f"where the objective is {what}: "
                                f"{trial.error}")  # fmt: skip
        return Property("failed values", True, "goes on after NaN, inf and exceptions")


def check(name: str, patience_s: float = PATIENCE_S) -> Iterator[Property]:
    """The properties of an optimiser, one by one. Raises ConfigError for an unknown name.

    A search that takes longer than patience_s does not end. Global generators are left as they
    were.
    """
    return _restoring(_Check(name, patience_s).properties())


def _restoring(properties: Iterator[Property]) -> Iterator[Property]:
    """The properties; global generators are left as they were after each."""
    while True:
        with _global_states():
            found = next(properties, None)
        if found is None:
            return
        yield found


def print_digest(name: str) -> None:
    """Print the digest of the points of one search; for a process of its own."""
    print(_Check(name, PATIENCE_S).trial().digest)


def _region(trial: Trial) -> Property:
    # Beside what search() refuses: the bats are trusted there.
    outside = [x for x in trial.points if math.dist(x, REGION.center) > REGION.radius + 1e-9]
    text = f"the point {outside[0]} is outside" if outside else "all points inside"
    return Property("region", not outside, text)


def _digests_elsewhere(name: str, patience_s: float) -> tuple[list[str], str]:
    """Digests of the points in processes with PYTHONHASHSEED 0 and 1, or what went wrong."""
    program = f"import sys; from {__name__} import print_digest; print_digest(sys.argv[1])"
    paths = os.pathsep.join(path for path in sys.path if path)
    children = [
        subprocess.Popen(
            [sys.executable, "-c", program, name],
            env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": paths},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for seed in "01"
    ]
    digests = []
    try:
        for child in children:
            out, err = child.communicate(timeout=_START_S + patience_s)
            if child.returncode:
                last = (err.strip().splitlines() or [f"exit code {child.returncode}"])[-1]
                return [], f"a process of its own fails: {last}"
            digests.append(out.split()[-1])
    except subprocess.TimeoutExpired:
        return [], "does not end in a process of its own"
    finally:
        for child in children:
            child.kill()
            child.communicate()
    return digests, ""


@contextmanager
def _global_states() -> Iterator[list[str]]:
    """Yields a list that afterwards names the global generators that were changed."""
    changed: list[str] = []
    ours, numpy_s = random.getstate(), np.random.get_state()  # noqa: NPY002
    try:
        yield changed
    finally:
        if random.getstate() != ours:
            changed.append("Python's random")
        if repr(np.random.get_state()) != repr(numpy_s):  # noqa: NPY002
            changed.append("numpy.random")
        random.setstate(ours)
        np.random.set_state(numpy_s)  # noqa: NPY002


@contextmanager
def _time_limit(seconds: float) -> Iterator[None]:
    """Raises HungError after so many seconds, and again each second should it be caught."""

    def stop(_signum: int, _frame: FrameType | None) -> None:
        raise HungError

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds, 1.0)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _distance(x: Vector) -> float:
    return math.hypot(x[0] - _OPTIMUM[0], x[1] - _OPTIMUM[1])


def _fails_at(x: Vector) -> bool:
    return x[0] > REGION.center[0]


def _nan(x: Vector) -> float:
    return math.nan if _fails_at(x) else _distance(x)


def _inf(x: Vector) -> float:
    return math.inf if _fails_at(x) else _distance(x)


def _raising(x: Vector) -> float:
    if _fails_at(x):
        raise MfbaError("no value here")
    return _distance(x)
