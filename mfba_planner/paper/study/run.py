# SPDX-License-Identifier: Apache-2.0
"""Run a plan's chunks on any number of workers; the samples do not depend on the number."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...evaluation.study.chunk import Columns
from ...evaluation.study.chunk_store import Store
from ...evaluation.study.compute_chunks import compute
from .chunk import SampleChunk

# The numbers depend on the code in these folders of mfba_planner.
PACKAGES = (
    "core", "swarm", "optimizers", "perception", "planning", "simulation", "evaluation", "paper",
)  # fmt: skip
Sample = Mapping[str, NDArray[np.float64]]


def open_store(directory: Path, plan: Sequence[SampleChunk], facts: Mapping[str, Any]) -> Store:
    """Open the directory of a study of the paper. Raises OutputError as Store does."""
    return Store(directory, plan, facts, command="mfba tables", packages=PACKAGES)


def run_plan(
    plan: Sequence[SampleChunk],
    *,
    workers: int = 1,
    store: Store | None = None,
    done: Callable[[SampleChunk], None] = lambda _: None,
    warn: Callable[[str], None] = lambda _: None,
) -> dict[str, Sample]:
    """Compute (or read back) every chunk; {sample: {column: values by seed}}.

    The callbacks and the errors raised are those of evaluation.study.compute_chunks.compute.
    """
    return samples(plan, compute(plan, workers=workers, store=store, done=done, warn=warn))


def samples(plan: Sequence[SampleChunk], found: Mapping[str, Columns]) -> dict[str, Sample]:
    """The columns of all chunks, joined in the sequence of the plan."""
    gathered: dict[str, dict[str, list[float]]] = {}
    for chunk in plan:
        sample = gathered.setdefault(chunk.sample, {})
        for column, values in found[chunk.name].items():
            sample.setdefault(column, []).extend(values)
    return {
        name: {column: np.array(values, dtype=float) for column, values in sample.items()}
        for name, sample in gathered.items()
    }
