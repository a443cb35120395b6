# SPDX-License-Identifier: Apache-2.0
"""What adapters of libraries share: they search the box around a region."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..core.errors import ConfigError
from ..core.option_specs import did_you_mean
from ..swarm.optimizer import Objective
from ..swarm.search_region import Region, Vector

Start = Callable[[Objective], object]


class LibraryRun:
    """A RunOptimizer made of a function that starts a library's run with an objective."""

    def __init__(self, region: Region, start: Start) -> None:
        """The objective moves points of the box outside the region to the region's edge."""
        self._region, self._start = region, start

    def run(self, objective: Objective) -> None:
        """Start the library; warnings on inf, the value of a failure, are left out."""
        with np.errstate(all="ignore"):
            self._start(lambda x: objective(from_box(self._region, x)))


def from_box(region: Region, x: Sequence[float]) -> Vector:
    """The point of the region for one of its box; one outside the box as it is."""
    point = [float(v) for v in x]
    if all(a <= v <= b for v, a, b in zip(point, *region.span())):
        return region.clamp(point)
    return point


def seed_of(generator: np.random.Generator) -> int:
    """A seed for a library that does not take a generator."""
    return int(generator.integers(2**31))


def unknown(library: str, name: str, known: Sequence[str]) -> ConfigError:
    """The error for an unknown algorithm of a library, with the nearest one."""
    hint = did_you_mean(f"{library}:{name}", [f"{library}:{word}" for word in known])
    return ConfigError(f"optimizer {library}:{name}: unknown; {hint}")
