# SPDX-License-Identifier: Apache-2.0
"""One run of a built-in suite as `mfba sweep` computes it, from the lidar."""

from dataclasses import replace

from mfba_planner.evaluation.metrics import Result, evaluate
from mfba_planner.evaluation.sweep.single_run import run_one
from mfba_planner.evaluation.sweep.sweep_spec import Run, default_setting, own_preset


def metrics_of(suite: str, world: int, planner: str = "predictive") -> Result:
    """The metrics of the run with seed 0."""
    setting = default_setting(suite)
    setting = replace(setting, params=own_preset(planner, setting.params))
    return evaluate(run_one(Run(suite, world, planner, 0), setting, whole=False).episode)
