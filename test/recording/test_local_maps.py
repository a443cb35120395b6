# SPDX-License-Identifier: Apache-2.0
"""Local maps in bags: read back as points; grids that contradict themselves are refused."""

from array import array
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from edited_bags import changed
from rclpy.serialization import serialize_message

from mfba_planner.core.errors import BagError, InputError
from mfba_planner.core.geometry import Pose2D
from mfba_planner.perception.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from mfba_planner.recording.bag_writer import BagWriter
from mfba_planner.recording.from_messages import occupancy_grid
from mfba_planner.recording.local_maps import read_local_maps
from mfba_planner.recording.merge_by_time import RawMessage
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.qos_conversion import offered
from mfba_planner.ros.interface.to_messages import occupancy_grid_msg

KIND = "nav_msgs/msg/OccupancyGrid"


def grid(stamp_ns: int) -> OccupancyGrid:
    cells = np.array([[FREE, OCCUPIED, UNKNOWN], [OCCUPIED, FREE, FREE]], dtype=np.int8)
    return OccupancyGrid(stamp_ns, Pose2D(1.0, -2.0, 0.25), 0.5, cells)


def bag_of(directory: Path, topic: str, *grids: OccupancyGrid, change: Any = None) -> Path:
    with BagWriter(directory) as writer:
        writer.add_topic("/odom", "nav_msgs/msg/Odometry", offered(topics.ODOM.qos))
        writer.add_topic(topic, KIND, offered(topics.LOCAL_MAP.qos))
        for found in grids:
            data = serialize_message(occupancy_grid_msg(found, "odom"))
            raw = RawMessage("/local_map", KIND, data, found.stamp_ns, found.stamp_ns, 0)
            writer.write(topic, changed(raw, change).data if change else data, found.stamp_ns, 0)
    return directory


def test_a_message_gives_the_grid_back() -> None:
    found = occupancy_grid(occupancy_grid_msg(grid(1_500_000_001), "odom"))
    assert found.stamp_ns == 1_500_000_001
    assert found.cell_m == 0.5
    assert found.origin == pytest.approx(grid(1).origin)
    assert found.cells.dtype == np.int8
    assert found.cells.tolist() == grid(1).cells.tolist()


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda m: setattr(m.info, "width", 4), "holds 6 cells, but width=4 and height=2 make 8"),
        (lambda m: setattr(m.info, "resolution", 0.0), "resolution=0 m; send more than 0"),
        (lambda m: setattr(m.info, "resolution", float("nan")), "resolution holds nan"),
        (lambda m: setattr(m.info.origin.position, "x", float("inf")), "position holds inf"),
        (lambda m: setattr(m, "data", array("b")), "holds 0 cells"),
    ],
)
def test_a_grid_that_contradicts_itself_is_refused(
    change: Callable[[Any], None], text: str, tmp_path: Path
) -> None:
    message = occupancy_grid_msg(grid(1), "odom")
    change(message)
    with pytest.raises(InputError, match=text):
        occupancy_grid(message)
    bag = bag_of(tmp_path / "bag", "/local_map", grid(1), change=change)
    with pytest.raises(BagError, match=f"/bag: /local_map: .*{text}"):
        read_local_maps(bag, [""])


def test_the_maps_of_a_bag_by_robot_and_stamp(tmp_path: Path) -> None:
    bag = bag_of(tmp_path / "bag", "/b/local_map", grid(3), grid(1), grid(3))
    found = read_local_maps(bag, ["a", "b"])
    assert found["a"] == ()
    assert [points.stamp_ns for points in found["b"]] == [1, 3]
    for _, points in found["b"]:
        np.testing.assert_allclose(points, grid(1).occupied(), atol=1e-6)
    assert read_local_maps(bag, [""]) == {"": ()}
