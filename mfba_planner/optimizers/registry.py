# SPDX-License-Identifier: Apache-2.0
"""Optimisers by name, and the search of a planner with one of them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from importlib import import_module
from importlib.util import find_spec

from numpy.random import Generator

from ..core.errors import ConfigError, MfbaError, OptimizerError
from ..core.named_import import import_named
from ..core.option_specs import did_you_mean
from ..swarm.bat_swarm import Algorithm, BatParams, BatSwarm
from ..swarm.optimizer import Evaluate, Factory, Found, Optimizer, RunOptimizer, raised, search
from ..swarm.search_region import Region
from .baselines import Grid, RandomSearch

BATS = "bats"  # BA or MFBA, as bat.algorithm says
NONE = "none"  # no search: the planner's own candidate
GROUP = "mfba_planner.optimizers"  # of entry points
EXTRA = "optimizers"
_BASELINES: dict[str, Factory] = {"random": RandomSearch, "grid": Grid}
_BATS = {BATS: None, "ba": Algorithm.BA, "mfba": Algorithm.MFBA}
# Prefix of names: the adapter, imported when it is used, and an example.
_LIBRARIES = {
    "scipy": ("scipy_search", "differential_evolution"),
    "cmaes": ("cmaes_search", "CMA"),
    "niapy": ("niapy_search", "ParticleSwarmAlgorithm"),
    "mealpy": ("mealpy_search", "PSO.OriginalPSO"),
}


# Names without a library, and an example of each library.
NAMES = (
    *_BATS,
    *_BASELINES,
    NONE,
    *(f"{library}:{of}" for library, (_, of) in _LIBRARIES.items()),
)


def require_optimizer(name: str) -> None:
    """Raise ConfigError for a name that is unknown, or whose library is not installed."""
    if name not in (*_BATS, NONE):
        _find(name)


def names_module(name: str) -> bool:
    """Whether the name is MODULE:NAME, and that module would be imported."""
    head, colon, _ = name.partition(":")
    return bool(colon) and head not in _LIBRARIES


def find_optimizer(name: str, bat: BatParams) -> Factory:
    """The factory of an optimiser. Raises ConfigError as require_optimizer(), and for NONE."""
    if name == NONE:
        raise ConfigError(f"optimizer {NONE}: no search, only the planner's own candidate")
    if name in _BATS:
        return bats(replace(bat, algorithm=_BATS[name] or bat.algorithm))
    return _find(name)


def bats(bat: BatParams) -> Factory:
    """BatSwarm as a factory; budget and population replace those of the parameters."""

    def make(region: Region, budget: int, generator: Generator, population: int) -> BatSwarm:
        iterations = max(1, budget // population - 1)
        params = replace(bat, population=population, iterations=iterations)
        return BatSwarm(params, region, generator, ahead=iterations)

    return make


def optimize(
    name: str, bat: BatParams, region: Region, generator: Generator, evaluate: Evaluate
) -> Found:
    """One search of a planner, with the population of bat and as many evaluations as its bats.

    Raises OptimizerError, with the name, for an optimiser that breaks its contract.
    """
    budget = bat.population * (bat.iterations + 1)
    if name == BATS:
        swarm = BatSwarm(bat, region, generator, ahead=bat.iterations)
        return search(swarm, region, budget, evaluate)
    factory = find_optimizer(name, bat)
    try:
        made = make(factory, region, budget, generator, bat.population)
        return search(made, region, budget, evaluate)
    except OptimizerError as error:
        raise OptimizerError(
            f"optimizer {name}: {error}; see `mfba check-optimizer {name}`"
        ) from error


def make(
    factory: Factory, region: Region, budget: int, generator: Generator, population: int
) -> Optimizer | RunOptimizer:
    """A new optimiser. Raises OptimizerError if it cannot be made."""
    try:
        return factory(region, budget, generator, population)
    except MfbaError:
        raise
    except Exception as error:
        raise OptimizerError(raised("the factory", error)) from error


@cache
def _find(name: str) -> Factory:
    if name in _BASELINES:
        return _BASELINES[name]
    head, colon, rest = name.partition(":")
    if head in _LIBRARIES and colon:
        return _of_library(head, rest)
    if colon:
        return _of_module(name, name)
    if name in (installed := _installed()):
        return _of_module(name, installed[name])
    raise ConfigError(f"optimizer {name!r}: unknown; {did_you_mean(name, [*NAMES, *installed])}")


def _installed() -> dict[str, str]:
    """MODULE:NAME of the optimisers of installed packages."""
    from importlib.metadata import entry_points  # slow to import, and seldom needed

    return {entry.name: f"{entry.module}:{entry.attr}" for entry in entry_points(group=GROUP)}


def _of_library(library: str, name: str) -> Factory:
    if find_spec(library) is None:
        raise ConfigError(
            f"optimizer {library}:{name}: {library} is not installed; "
            f"pip install 'mfba_planner[{EXTRA}]'"
        )
    adapter = import_module(f".{_LIBRARIES[library][0]}", __package__)
    factory: Factory = adapter.find(name)
    return factory


def _of_module(name: str, target: str) -> Factory:
    """The factory at MODULE:NAME of the optimiser of that name."""
    near = did_you_mean(name, list(NAMES))
    hint = f"; {near}" if near.startswith("did") else ""
    called_with = "region, budget, generator and population"
    factory: Factory = import_named("optimizer", name, target, called_with, hint)
    return factory
