# SPDX-License-Identifier: Apache-2.0
"""What the bits of a run's decisions stand for around the robot: sectors, or headings."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..core.types import Bits
from ..planning.gap_vector import GapHeading, gap_heading
from ..simulation.episode import Episode


@dataclass(frozen=True, slots=True)
class Ring:
    """As many equal wedges as there are bits; wedge i (from 0) begins i + first of them from +x.

    Sectors begin at +x (Table 1). A planner of headings has each in the middle of its wedge, and
    every heading is its own gap. rule says where gaps lead.
    """

    count: int
    first: float = 0.0
    rule: GapHeading = GapHeading.BOUNDARY

    @property
    def of_headings(self) -> bool:
        """Whether the bits are headings that lead to contact, not sectors with something in."""
        return self.first != 0.0

    @property
    def gaps(self) -> list[float]:
        """The headings of the gaps in radians."""
        return [gap_heading(gap, self.count, self.rule) for gap in range(1, self.count + 1)]

    def wedge(self, i: int, wedges: int = 1) -> tuple[float, float]:
        """Where wedge i, or so many from it on, begins and ends: radians from +x."""
        width = 2.0 * math.pi / self.count
        return (i + self.first) * width, (i + self.first + wedges) * width


def ring_of(episode: Episode, bits: Bits = ()) -> Ring:
    """The ring of a run's bits: of headings where they are not as many as its sectors."""
    sectors = episode.sensor.sectors
    if len(bits) in (0, sectors):
        return Ring(sectors, rule=episode.planner.gap_heading)
    return Ring(len(bits), 0.5)
