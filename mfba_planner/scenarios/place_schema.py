# SPDX-License-Identifier: Apache-2.0
"""Schema of the static place in scenario files: what becomes wall segments."""

from __future__ import annotations

from pydantic import BaseModel

from ..core.segments import Segment
from .schema_types import STRICT, Number

_Segment = tuple[Number, Number, Number, Number]


class Place(BaseModel):
    """The keys of a scenario that make its walls."""

    model_config = STRICT

    segments_m: list[_Segment] = []

    def segments(self) -> tuple[Segment, ...]:
        """All of them as wall segments."""
        return tuple(self.segments_m)


MEANINGS = {
    "segments_m": "wall segments, [x0, y0, x1, y1] each, m; the robot touches them",
}
# What to give instead of a list of another length.
SHAPES = {
    "segments_m": "give four numbers, [x0, y0, x1, y1]",
}
