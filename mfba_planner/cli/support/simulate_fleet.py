# SPDX-License-Identifier: Apache-2.0
"""Helper of `mfba sim`, not a command: scenarios with several robots."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from ...core.errors import ConfigError, MfbaError
from ...evaluation.metrics import Result, evaluate
from ...report.fleet_table import fleet_text, why_no_success
from ...scenarios.run_config import RunConfig
from ...simulation.episode import Episode, Outcome
from ...simulation.fleet import Fleet
from ...simulation.run_episode import simulate_fleet
from .progress_bar import simulation_progress

_SEED_HEAD = "    seed  at the goal   longest     last  clearance  collisions"
_SEED_ROW = "{:>8}  {:>4} of {:<4}  {:>6.3f} m  {:>5.2f} s  {:>7.3f} m  {:>10}"


def simulate(config: RunConfig, seeds: int, out: Path | None) -> int:
    """Print a row per robot, or per seed; 0 when all reach their goals without collision."""
    if out is not None:
        raise ConfigError(
            f"--out {out}: holds one robot's run, {config.scenario.name!r} has "
            f"{len(config.scenario.robots)}; leave it out"
        )
    if seeds == 1:
        with simulation_progress() as go_on:
            results = _results(config, config.seed, go_on)
        print(fleet_text(config.scenario.robot_names, results), end="")
        if why := why_no_success(results):
            raise MfbaError(why)
        return 0
    print(_SEED_HEAD)
    full_successes = 0
    for seed in range(config.seed, config.seed + seeds):
        results = _results(config, seed)
        full_successes += all(r.success for r in results)
        print(_seed_row(seed, results), flush=True)
    print(f"{full_successes} of {seeds} seeds with all robots at the goal without collision")
    if full_successes < seeds:
        raise MfbaError(
            f"{seeds - full_successes} of {seeds} seeds failed; look at one with --seed"
        )
    return 0


def _results(
    config: RunConfig, seed: int, go_on: Callable[[Fleet], bool] = lambda _: True
) -> list[Result]:
    done: Sequence[Episode] = simulate_fleet(
        config.scenario, planner=config.planner, sensor=config.sensor, seed=seed, go_on=go_on
    )
    return [evaluate(episode) for episode in done]


def _seed_row(seed: int, results: Sequence[Result]) -> str:
    return _SEED_ROW.format(
        seed,
        sum(r.outcome is Outcome.GOAL_REACHED for r in results),
        len(results),
        max(r.length_m for r in results),
        max(r.time_s for r in results),
        min(r.min_clearance_m for r in results),
        sum(r.collisions for r in results),
    )
