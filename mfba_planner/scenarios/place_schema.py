# SPDX-License-Identifier: Apache-2.0
"""Schema of the static place in scenario files: segments, polygons, boxes, a map.

All of it becomes wall segments here, so that a scenario in a bag needs no other file and the
simulation knows segments only.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path

from pydantic import BaseModel

from ..core.errors import ConfigError
from ..core.geometry import Point as PointM
from ..core.segments import Segment
from .nav2_map import MAP_REMEDY, OccupancyMap, read_map
from .read_yaml import from_yaml
from .schema_types import STRICT, Number, Point, Positive
from .solids import Polygon, Solid, box
from .text_files import read_text

MOST_SEGMENTS = 100_000
_Segment = tuple[Number, Number, Number, Number]


class Box(BaseModel):
    """A rectangle, turned by yaw_deg."""

    model_config = STRICT

    center_m: Point
    size_m: tuple[Positive, Positive]
    yaw_deg: Number = 0.0


class Place(BaseModel):
    """The keys of a scenario that make its walls."""

    model_config = STRICT

    segments_m: list[_Segment] = []
    polygons_m: list[list[Point]] = []
    boxes: list[Box] = []
    map: str | None = None

    def segments(
        self, directory: Path, positions: Iterable[tuple[str, PointM]]
    ) -> tuple[Segment, ...]:
        """All of them as wall segments; a map's path is relative to the directory.

        Raises ConfigError for what makes no walls, and for a position (what it is, the point)
        inside a polygon, a box or an occupied cell.
        """
        polygons = [
            Polygon(f"polygon {number}", corners)
            for number, corners in enumerate(self.polygons_m, start=1)
        ]
        polygons += [
            box(f"box {number}", it.center_m, it.size_m, math.radians(it.yaw_deg))
            for number, it in enumerate(self.boxes, start=1)
        ]
        solids: list[Solid] = [*polygons]
        segments = [*self.segments_m, *(edge for polygon in polygons for edge in polygon.outline)]
        if self.map is not None:
            occupancy = self._read_map(directory / self.map)
            solids.append(occupancy)
            segments += map_segments(occupancy)
        if len(segments) > MOST_SEGMENTS:
            raise ConfigError(
                f"{len(segments)} wall segments in all, more than {MOST_SEGMENTS}; "
                "simplify the place, or save the map coarser"
            )
        for what, point in positions:
            for solid in solids:
                if solid.covers(point):
                    raise ConfigError(f"{what}={list(point)}: {solid.refusal}")
        return tuple(segments)

    def _read_map(self, path: Path) -> OccupancyMap:
        text = read_text(path, MAP_REMEDY, "map ")
        return read_map(path, from_yaml(text, f"map {path}", MAP_REMEDY))


def map_segments(occupancy: OccupancyMap) -> list[Segment]:
    """The walls of a map. Raises ConfigError for more than MOST_SEGMENTS."""
    found = occupancy.segments
    if len(found) > MOST_SEGMENTS:
        raise ConfigError(
            f"{occupancy.name}: {len(found)} wall segments, more than {MOST_SEGMENTS}; "
            "remove the specks from its image, or save it coarser"
        )
    return [(x0, y0, x1, y1) for x0, y0, x1, y1 in found.tolist()]


MEANINGS = {
    "segments_m": "wall segments, [x0, y0, x1, y1] each, m; the robot touches them",
    "polygons_m": "solid polygons, a list of corners [x, y] each, m; their outlines are walls",
    "boxes": "solid rectangles; their outlines are walls",
    "map": "the .yaml of a Nav2 map, relative to this file; outlines of occupied cells are walls",
    "size_m": "length and width, m",
    "yaw_deg": "direction of its length, degrees from +x, counter-clockwise",
}
# What to give instead of a list of another length.
SHAPES = {
    "segments_m": "give four numbers, [x0, y0, x1, y1]",
    "polygons_m": "give corners of two numbers, [[x, y], ...]",
}
