# SPDX-License-Identifier: Apache-2.0
"""The local maps in a bag, for pictures: the occupied cells at some times."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ..core.errors import BagError, InputError
from .bag_reader import BagReader
from .fleet_topics import messages_by_robot, robot_topic
from .from_messages import occupancy_grid

LOCAL_MAP = "/local_map"


class MapPoints(NamedTuple):
    """Centres (n, 2) of the occupied cells, m, single precision, in odom, from a stamp on."""

    stamp_ns: int
    points_m: np.ndarray


RobotMaps = Mapping[str, Sequence[MapPoints]]
NO_MAPS: RobotMaps = MappingProxyType({})


def read_local_maps(
    path: str | Path, robots: Iterable[str], *, salvage: bool = False
) -> dict[str, tuple[MapPoints, ...]]:
    """The maps of each robot by stamp, none where the bag has none. Raises BagError."""
    names = list(robots)
    found: dict[str, dict[int, MapPoints]] = {name: {} for name in names}
    with BagReader(path, salvage=salvage) as reader:
        if any(robot_topic(name, LOCAL_MAP) in reader.topics for name in names):
            for robot, message in messages_by_robot(reader, names, [LOCAL_MAP]):
                try:
                    grid = occupancy_grid(message.message)
                except (InputError, AttributeError) as error:
                    topic = robot_topic(robot, LOCAL_MAP)
                    raise BagError(f"{reader.path}: {topic}: {error}") from None
                points = grid.occupied().astype(np.float32)
                found[robot][grid.stamp_ns] = MapPoints(grid.stamp_ns, points)
    return {name: tuple(by[stamp] for stamp in sorted(by)) for name, by in found.items()}
