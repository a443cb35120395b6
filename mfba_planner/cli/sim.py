# SPDX-License-Identifier: Apache-2.0
"""`mfba sim`: simulate episodes without ROS (core driver), one seed or many."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from ..core.argument_parser import Parser
from ..core.errors import ConfigError, MfbaError
from ..core.option_specs import require_range
from ..evaluation.metrics import Result, evaluate
from ..launcher.run_arguments import RunRequest, add_world_arguments, read_config
from ..launcher.run_result import show, why_no_success
from ..planning.planner_params import Method
from ..planning.planner_registry import PLANNERS
from ..scenarios.run_config import Driver, RunConfig
from ..simulation.episode import Episode
from ..simulation.run_episode import always_continue, simulate
from ..simulation.world import World
from .support.progress_bar import simulation_progress

MOST_SEEDS = 2**31 - 1
_METHODS = [method.value for method in Method]
_DESCRIPTION = "Simulate episodes without ROS: same decisions as `mfba run`, no bag."
_HEAD = "    seed  outcome       length     time  clearance  collisions"
_ROW = "{:>8}  {:<12}  {:>6.3f} m  {:>5.2f} s  {:>7.3f} m  {:>10}"


def main(args: list[str]) -> int:
    """Simulate; 0 when every run reached the goal without collision."""
    parser = Parser(prog="mfba sim", description=_DESCRIPTION)
    peers = [name for name in PLANNERS if name not in _METHODS]
    add_world_arguments(parser, peers)
    parser.add_argument(
        "--seeds",
        type=int,
        default=1,
        metavar="N",
        help="number of seeds, from --seed on (default: 1)",
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="directory to create for result.json and run.png"
    )
    parsed = parser.parse(args)
    _check(parsed)
    if parsed.planner not in (None, *_METHODS):
        from .support.simulate_peer import Peer

        peer = Peer(parsed)
        if parsed.out is not None:
            return peer.write(parsed.out)
        return _run(peer.config, parsed.seeds, peer.simulate)
    config = read_config(parsed, driver=Driver.CORE)
    if config.scenario.robots:
        from .support import simulate_fleet

        return simulate_fleet.simulate(config, parsed.seeds, parsed.out)
    if parsed.out is not None:
        from ..launcher.execute_run import execute

        return execute(RunRequest(config=config, out=parsed.out, node_args={}))
    return _run(config, parsed.seeds, _simulate if parsed.seeds > 1 else _simulate_with_progress)


def _check(parsed: argparse.Namespace) -> None:
    require_range("--seeds", parsed.seeds, 1, MOST_SEEDS)
    if parsed.out is not None and parsed.seeds > 1:
        raise ConfigError(f"--out {parsed.out}: holds one run; leave out --seeds")


def _simulate(config: RunConfig, go_on: Callable[[World], bool] = always_continue) -> Episode:
    return simulate(
        config.scenario,
        planner=config.planner,
        sensor=config.sensor,
        seed=config.seed,
        go_on=go_on,
    )


def _simulate_with_progress(config: RunConfig) -> Episode:
    with simulation_progress() as go_on:
        return _simulate(config, go_on)


def _run(config: RunConfig, seeds: int, simulate_one: Callable[[RunConfig], Episode]) -> int:
    if seeds == 1:
        return _one(simulate_one(config))
    return _many(config, seeds, simulate_one)


def _one(episode: Episode) -> int:
    result = evaluate(episode)
    show(episode, result)
    if not result.success:
        raise MfbaError(why_no_success(episode, result))
    return 0


def _many(config: RunConfig, seeds: int, simulate_one: Callable[[RunConfig], Episode]) -> int:
    last = replace(config, seed=config.seed + seeds - 1)  # refused before the first run
    print(_HEAD)
    results = []
    for seed in range(config.seed, last.seed + 1):
        results.append(evaluate(simulate_one(replace(config, seed=seed))))
        print(_row(seed, results[-1]), flush=True)
    good = [result for result in results if result.success]
    print(_summary(good, len(results)))
    if len(good) < len(results):
        raise MfbaError(
            f"{len(results) - len(good)} of {len(results)} seeds failed; "
            "look at one of them with --seed and --out"
        )
    return 0


def _row(seed: int, r: Result) -> str:
    return _ROW.format(
        seed, r.outcome.value, r.length_m, r.time_s, r.min_clearance_m, r.collisions
    )


def _summary(good: list[Result], total: int) -> str:
    """The number of successes, and the range of their path lengths."""
    text = f"{len(good)} of {total} at the goal without collision"
    if good:
        from statistics import fmean

        lengths = [result.length_m for result in good]
        text += f"; length {min(lengths):.3f} to {max(lengths):.3f} m, mean {fmean(lengths):.3f} m"
    return text
