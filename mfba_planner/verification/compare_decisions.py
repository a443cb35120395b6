# SPDX-License-Identifier: Apache-2.0
"""Compare two sequences of decisions: the first tick and the fields that differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

from ..core.planner_types import Decision
from ..simulation.decision_digest import canonical


@dataclass(frozen=True, slots=True, kw_only=True)
class Divergence:
    """The first tick at which two runs differ; None for a run that ended before."""

    tick: int
    left: Decision | None
    right: Decision | None

    @property
    def differing(self) -> tuple[str, ...]:
        """Names of the Decision fields that differ."""
        if self.left is None or self.right is None:
            return ()
        return tuple(
            item.name
            for item in fields(Decision)
            if _bits(self.left, item.name) != _bits(self.right, item.name)
        )


def first_divergence(left: Sequence[Decision], right: Sequence[Decision]) -> Divergence | None:
    """The first tick at which two runs differ in any bit of the canonical form, or None."""
    for tick, (a, b) in enumerate(zip(left, right)):
        if canonical(tick, a) != canonical(tick, b):
            return Divergence(tick=tick, left=a, right=b)
    tick = min(len(left), len(right))
    if len(left) == len(right):
        return None
    return Divergence(
        tick=tick,
        left=left[tick] if tick < len(left) else None,
        right=right[tick] if tick < len(right) else None,
    )


def side_by_side(found: Divergence, left_name: str, right_name: str) -> list[str]:
    """Both decisions as lines of text; differing fields are marked with >."""
    rows = [("", left_name, right_name)]
    for item in fields(Decision):
        if item.name == "candidates":
            continue
        mark = "> " if item.name in found.differing else "  "
        left, right = (_text(decision, item.name) for decision in (found.left, found.right))
        rows.append((mark + item.name, left, right))
    widths = [max(len(row[k]) for row in rows) for k in range(2)]
    return [
        f"{name:<{widths[0]}}  {left:<{widths[1]}}  {right}".rstrip() for name, left, right in rows
    ]


def _bits(decision: Decision, name: str) -> str:
    return repr(getattr(decision, name))  # exact for floats, except a NaN's payload


def _text(decision: Decision | None, name: str) -> str:
    if decision is None:
        return "(ended before)"
    value: Any = getattr(decision, name)
    if name in ("vs", "vg"):
        return "".join(map(str, value))
    if name == "mode":
        return str(value.value)
    if isinstance(value, tuple):
        return ", ".join(f"{x!r}" for x in value)
    return str(value)
