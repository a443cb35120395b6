# SPDX-License-Identifier: Apache-2.0
"""Chunk: a unit of work of a study, computed in any process with the same result."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

Columns = Mapping[str, list[Any]]  # of equal lengths; int, float, str


class Chunk(Protocol):
    """A unit of work of a study; it is pickled to a worker, which returns its columns."""

    @property
    def name(self) -> str:
        """Unique name within the study, usable as a file name."""

    @property
    def cost(self) -> float:
        """Estimated time in milliseconds, for a progress bar."""

    def facts(self) -> Mapping[str, Any]:
        """All inputs that determine the result, as plain values."""

    def run(self) -> Columns:
        """Compute it."""
