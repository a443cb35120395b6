# SPDX-License-Identifier: Apache-2.0
"""Helper of `mfba sim`, not a command: planners that no ROS node runs, as `mfba sweep` does."""

from __future__ import annotations

import argparse
from dataclasses import replace
from functools import partial
from pathlib import Path

from ...core.errors import ConfigError, MfbaError
from ...core.output_files import refuse_existing
from ...evaluation.metrics import evaluate
from ...evaluation.suites.scenario_suite import single_scenario
from ...evaluation.sweep.single_run import run_one
from ...evaluation.sweep.sweep_spec import Run, SweepSpec, default_setting, own_preset
from ...launcher.run_arguments import refuse_options_of_paper
from ...launcher.run_directory import RunDirectory
from ...launcher.run_result import show, why_no_success
from ...launcher.set_option import settings_of, with_robot_settings, with_settings
from ...perception.sensory_vector import SensorParams
from ...planning.planner_params import PlannerParams
from ...scenarios.run_config import Driver, RunConfig
from ...scenarios.scenario_files import load_scenario
from ...simulation.episode import Episode


class Peer:
    """A planner by name, and the run that the command line describes."""

    def __init__(self, parsed: argparse.Namespace) -> None:
        """Check the arguments. Raises ConfigError, with the nearest name for an unknown one."""
        self._name: str = parsed.planner
        refuse_options_of_paper(parsed, "algorithm", "reading", "swarm")
        if parsed.optimizer and ":" not in self._name:
            raise ConfigError(
                f"--optimizer: of paper and predictive only; leave it out with {self._name}"
            )
        scenario = load_scenario(parsed.scenario)
        if scenario.robots:
            raise ConfigError(
                f"--planner {self._name}: of one robot, {scenario.name!r} has "
                f"{len(scenario.robots)}; give paper or predictive"
            )
        robot, others = with_robot_settings(scenario.robot, settings_of(parsed))
        params, sensor = with_settings(
            own_preset(self._name, PlannerParams()), SensorParams(), others
        )
        self.config = RunConfig(
            scenario=replace(scenario, robot=robot),
            planner=params,
            sensor=sensor,
            seed=parsed.seed,
            driver=Driver.CORE,
        )

    def simulate(self, config: RunConfig) -> Episode:
        """The run, with the robot of the scenario. Raises MfbaError for a planner that fails."""
        scenarios = single_scenario(config.scenario)
        run = Run(scenarios.name, 0, self._name, config.seed)
        setting = default_setting(run.suite, scenarios)
        setting = replace(setting, params=config.planner, sensor=config.sensor)
        # Raises ConfigError for a planner that would not observe any obstacle.
        SweepSpec(suite=run.suite, planners=(self._name,), worlds=1, setting=setting)
        completed = run_one(run, setting)
        if completed.fault:
            raise MfbaError(f"planner {self._name}: {completed.fault_at}")
        return completed.episode

    def write(self, out: Path) -> int:
        """Make the run and its directory; 0 at the goal without collision, else MfbaError."""
        from ...report.result_json import result_to_dict, write_result
        from ...report.run_figure import draw_run

        refuse_existing(out)
        episode = self.simulate(self.config)
        directory, result = RunDirectory(out), evaluate(episode)
        writers = [
            partial(write_result, directory.result, result_to_dict(episode)),
            partial(draw_run, episode, directory.picture),
        ]
        directory.complete(writers, partial(show, episode, result))
        if not result.success:
            raise MfbaError(f"{directory.path}: {why_no_success(episode, result)}")
        return 0
