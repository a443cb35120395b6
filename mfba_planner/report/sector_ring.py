# SPDX-License-Identifier: Apache-2.0
"""The geometry of a decision's bits around the robot: a ring of sectors, or of headings."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..core.planner_types import Bits
from ..planning.gap_vector import GapHeading, gap_heading
from ..simulation.episode import Episode


@dataclass(frozen=True, slots=True)
class Ring:
    """One equal wedge per bit; wedge i (from 0) starts i + first wedge widths from +x.

    Sectors start at +x (Table 1). In a ring of headings (predictive planner) each heading is the
    middle of its wedge and its own gap. rule: how the heading of a gap is computed.
    """

    count: int
    first: float = 0.0
    rule: GapHeading = GapHeading.BOUNDARY

    @property
    def of_headings(self) -> bool:
        """Whether a bit is a heading that leads to a contact, not a sector with an obstacle."""
        return self.first != 0.0

    @property
    def gaps(self) -> list[float]:
        """The headings of the gaps (rad)."""
        return [gap_heading(gap, self.count, self.rule) for gap in range(1, self.count + 1)]

    def wedge(self, i: int, wedges: int = 1) -> tuple[float, float]:
        """Start and end of wedge i, or of so many wedges from i on: radians from +x."""
        width = 2.0 * math.pi / self.count
        return (i + self.first) * width, (i + self.first + wedges) * width


def ring_of(episode: Episode, bits: Bits = ()) -> Ring:
    """The ring of a run's bits: of headings if their number is not that of its sectors."""
    sectors = episode.sensor.sectors
    if len(bits) in (0, sectors):
        return Ring(sectors, rule=episode.planner.gap_heading)
    return Ring(len(bits), 0.5)
