# SPDX-License-Identifier: Apache-2.0
"""What a study is made of: parts that can be computed anywhere with the same result."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

Columns = Mapping[str, list[Any]]  # of equal lengths; whole and other numbers, text


class Chunk(Protocol):
    """Some work of a study; it travels to a worker and its columns come back."""

    @property
    def name(self) -> str:
        """Name of its own within the study, fit for a file."""

    @property
    def cost(self) -> float:
        """Time it takes, in about milliseconds, for a progress bar."""

    def facts(self) -> Mapping[str, Any]:
        """What decides the numbers, as plain values."""

    def run(self) -> Columns:
        """Compute it."""
