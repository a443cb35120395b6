# SPDX-License-Identifier: Apache-2.0
"""Hypothesis strategy: BatParams with any combination of options."""

from typing import Any

from hypothesis import strategies as st

from mfba_planner.swarm.bat_swarm import (
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

READINGS: dict[str, Any] = {
    "algorithm": Algorithm,
    "velocity": Velocity,
    "schedule": Schedule,
    "bounds": Bounds,
    "epsilon": Epsilon,
    "initial": Initial,
    "walk": Walk,
}
OURS: dict[str, Any] = {  # options that are not readings of the paper
    "step": Step,
    "acceptance": Acceptance,
    "update": Update,
}
ANY_READING = st.builds(
    BatParams,
    population=st.integers(2, 6),
    iterations=st.integers(1, 12),
    f_min=st.floats(0.0, 0.5),
    f_max=st.floats(0.5, 1000.0),
    rho=st.floats(0.0, 5.0),
    sigma=st.floats(0.0, 10.0),
    alpha=st.floats(0.5, 1.0),
    a0=st.floats(0.0, 2.0),
    inertia=st.sampled_from([0.0, 0.7, 1.0]),
    r0=st.floats(0.0, 1.0),
    **{name: st.sampled_from(list(kind)) for name, kind in {**READINGS, **OURS}.items()},
)
