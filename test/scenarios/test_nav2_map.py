# SPDX-License-Identifier: Apache-2.0
"""Nav2 maps in scenario files: outlines, modes of map_server, and what is refused."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image

from mfba_planner.core.errors import ConfigError
from mfba_planner.scenarios import nav2_map, place_schema
from mfba_planner.scenarios.map_outline import outline
from mfba_planner.scenarios.scenario_files import load_scenario, parse_scenario
from mfba_planner.scenarios.scenario_json import scenario_to_json
from mfba_planner.simulation.scenario import Scenario

TASK = "name: x\nstart_m: [0, 0]\ngoal_m: [5, 5]\nmap: m.yaml\n"
GRIDS = arrays(bool, st.tuples(st.integers(1, 9), st.integers(1, 9)))


def write_map(
    folder: Path,
    pixels: np.ndarray | None = None,
    name: str = "m.pgm",
    text: str = "resolution: 1.0\norigin: [1, 2, 0]\n",
) -> None:
    """A map of 3 x 4 cells with two occupied ones, by default."""
    if pixels is None:
        pixels = np.full((3, 4), 254, dtype=np.uint8)
        pixels[0, 1:3] = 0  # the highest row
    Image.fromarray(pixels).save(folder / name)
    (folder / "m.yaml").write_text(f"image: {name}\n{text}")


def load(folder: Path, text: str = TASK) -> Scenario:
    (folder / "s.yaml").write_text(text)
    return load_scenario(str(folder / "s.yaml"))


def refusal(folder: Path, text: str = TASK) -> str:
    with pytest.raises(ConfigError) as caught:
        load(folder, text)
    message = str(caught.value)
    assert "\n" not in message
    return message.replace(str(folder), "").removeprefix("/s.yaml: ")


# --- outlines ---------------------------------------------------------------------------------


@given(occupied=GRIDS)
def test_the_outline_is_every_edge_between_occupied_and_not_once(occupied: np.ndarray) -> None:
    """Cut into edges of one cell again: those of the grid; and no two could be one."""
    segments = outline(occupied, 1.0, (0.0, 0.0))
    edges = []
    for x0, y0, x1, y1 in segments.tolist():
        along = (x1 > x0, y1 > y0)
        count = round(x1 - x0 + y1 - y0)
        edges += [(x0 + k * along[0], y0 + k * along[1], *along) for k in range(count)]
    assert len(edges) == len(set(edges))
    framed = np.pad(occupied, 1)
    rows, columns = framed.shape
    level = {
        (column - 1.0, row - 1.0, True, False)
        for row in range(1, rows)
        for column in range(columns)
        if framed[row, column] != framed[row - 1, column]
    }
    upright = {
        (column - 1.0, row - 1.0, False, True)
        for row in range(rows)
        for column in range(1, columns)
        if framed[row, column] != framed[row, column - 1]
    }
    assert set(edges) == level | upright
    ends = {(x1, y1, x1 > x0) for x0, y0, x1, y1 in segments.tolist()}
    starts = {(x0, y0, x1 > x0) for x0, y0, x1, y1 in segments.tolist()}
    assert not ends & starts, "neighbours in one line are one segment"


def test_a_large_room_has_few_segments() -> None:
    room = np.zeros((2000, 2000), dtype=bool)
    room[[0, -1], :] = room[:, [0, -1]] = True
    assert len(outline(room, 0.05, (0.0, 0.0))) == 8


# --- a map in a scenario ----------------------------------------------------------------------


def test_the_map_lies_relative_to_the_scenario_and_bags_need_no_map(tmp_path: Path) -> None:
    (tmp_path / "maps").mkdir()
    write_map(tmp_path / "maps")
    scenario = load(tmp_path, TASK.replace("m.yaml", "maps/m.yaml"))
    assert set(scenario.segments_m) == {
        (2.0, 4.0, 4.0, 4.0), (2.0, 5.0, 4.0, 5.0), (2.0, 4.0, 2.0, 5.0), (4.0, 4.0, 4.0, 5.0),
    }  # fmt: skip
    assert parse_scenario(scenario_to_json(scenario), "bag") == scenario


def test_segments_boxes_and_a_map_together(tmp_path: Path) -> None:
    write_map(tmp_path)
    more = "segments_m: [[8, 8, 9, 9]]\nboxes: [{center_m: [9, 0], size_m: [1, 1]}]"
    assert len(load(tmp_path, TASK + more).segments_m) == 1 + 4 + 4


def shades(*levels: int) -> np.ndarray:
    return np.array([levels], dtype=np.uint8)


def occupied(folder: Path) -> list[int]:
    """Columns of a map of one row that are occupied."""
    read = nav2_map.read_map(
        folder / "m.yaml", place_schema.from_yaml((folder / "m.yaml").read_text(), "x")
    )
    return np.flatnonzero(read.occupied[0]).tolist()


BASE = "resolution: 1.0\norigin: [9, 9]\n"


@pytest.mark.parametrize("name", ["m.pgm", "m.png"])
def test_occupied_is_above_the_threshold(name: str, tmp_path: Path) -> None:
    """205 is what map_saver writes for unknown; 0.65 and 89.25 are the threshold."""
    write_map(tmp_path, shades(0, 89, 90, 205, 254, 255), name, BASE)
    assert occupied(tmp_path) == [0, 1]
    write_map(tmp_path, shades(0, 89, 90, 205, 254, 255), name, BASE + "occupied_thresh: 0.1")
    assert occupied(tmp_path) == [0, 1, 2, 3]
    write_map(tmp_path, shades(0, 89, 90, 205, 254, 255), name, BASE + "negate: 1")
    assert occupied(tmp_path) == [3, 4, 5]


@pytest.mark.parametrize(("mode", "expected"), [("trinary", [0, 1]), ("scale", [0])])
def test_modes_with_alpha(mode: str, expected: list[int], tmp_path: Path) -> None:
    """A transparent pixel is unknown in mode scale; in trinary alpha counts as a colour."""
    rgba = np.zeros((1, 3, 4), dtype=np.uint8)
    rgba[0, :, 3] = 255, 0, 254
    rgba[0, 2, :3] = 120
    write_map(tmp_path, rgba, "m.png", BASE + f"mode: {mode}")
    assert occupied(tmp_path) == expected


def test_other_kinds_of_images(tmp_path: Path) -> None:
    write_map(tmp_path, np.array([[0, 65535, 10000]], dtype=np.uint16), "m.png", BASE)
    assert occupied(tmp_path) == [0, 2]
    Image.fromarray(shades(0, 255, 0)).convert("1").save(tmp_path / "m.png")
    assert occupied(tmp_path) == [0, 2]
    Image.fromarray(shades(0, 255, 0)).convert("RGB").convert("P").save(tmp_path / "m.png")
    assert occupied(tmp_path) == [0, 2]
    (tmp_path / "m.png").write_text("P2\n# by hand\n3 1\n9\n0 9 0\n")
    assert occupied(tmp_path) == [0, 2]


# --- refused ----------------------------------------------------------------------------------

REMEDY = "give the .yaml file that nav2's map_saver wrote, beside its image"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("", f"map /m.yaml: empty; {REMEDY}"),
        ("[1]", f"map /m.yaml: a list, not a mapping; {REMEDY}"),
        ("image: m.pgm\norigin: [0, 0, 0]", f"map /m.yaml: resolution missing; {REMEDY}"),
        ("a: [", f"map /m.yaml line 1: not YAML (expected the node content, but found "
                 f"'<stream end>'); {REMEDY}"),
        ("image: 3\nresolution: 1\norigin: [0, 0, 0]",
         f"map /m.yaml: image=3: not a file; {REMEDY}"),
        ("image: m.pgm\nresolution: 0\norigin: [0, 0, 0]",
         "map /m.yaml: resolution=0: give a number in [0.001, 10]"),
        ("image: m.pgm\nresolution: .nan\norigin: [0, 0, 0]",
         "map /m.yaml: resolution=nan: give a number in [0.001, 10]"),
        ("image: m.pgm\nresolution: '0.05'\norigin: [0, 0, 0]",
         "map /m.yaml: resolution='0.05': give a number in [0.001, 10]"),
        ("image: m.pgm\nresolution: 1\norigin: [0, 0, 0.3]",
         "map /m.yaml: origin=[0, 0, 0.3]: rotated by 0.3 rad, which is not supported; "
         "save the map with yaw 0"),
        ("image: m.pgm\nresolution: 1\norigin: [0, .inf, 0]",
         "map /m.yaml: origin=[0, inf, 0]: give [x, y, 0], m"),
        ("image: m.pgm\nresolution: 1\norigin: 3", "map /m.yaml: origin=3: give [x, y, 0], m"),
        ("image: m.pgm\nresolution: 1\norigin: [0, 0, 0]\nmode: raw",
         "map /m.yaml: mode='raw': not supported; give trinary or scale"),
        ("image: m.pgm\nresolution: 1\norigin: [0, 0, 0]\nmode: [1]",
         "map /m.yaml: mode=[1]: not supported; give trinary or scale"),
        ("image: m.pgm\nresolution: 1\norigin: [0, 0, 0]\nnegate: yes please",
         "map /m.yaml: negate='yes please': neither 0 nor 1; give one of them"),
        ("image: m.pgm\nresolution: 1\norigin: [0, 0, 0]\noccupied_thresh: 65",
         "map /m.yaml: occupied_thresh=65: give a number in [0, 1]"),
        ("image: m.pgm\nresolution: 1\norigin: [0, 0, 0]\noccupied_thresh: 1.0",
         "map /m.yaml: no cell is occupied; check negate=0 and occupied_thresh=1"),
        ("image: none.pgm\nresolution: 1\norigin: [0, 0, 0]",
         "map image /none.pgm: No such file or directory; give a .pgm or .png file"),
        ("image: m.yaml\nresolution: 1\norigin: [0, 0, 0]",
         "map image /m.yaml: not an image; give a .pgm or .png file"),
        ("image: .\nresolution: 1\norigin: [0, 0, 0]",
         "map image : Is a directory; give a .pgm or .png file"),
    ],
)  # fmt: skip
def test_refused_maps(change: str, message: str, tmp_path: Path) -> None:
    write_map(tmp_path)
    (tmp_path / "m.yaml").write_text(change)
    assert refusal(tmp_path) == message


def test_a_yaw_that_is_rounding_is_none(tmp_path: Path) -> None:
    write_map(tmp_path, text="resolution: 1.0\norigin: [1, 2, -1.2e-17]\n")
    assert len(load(tmp_path).segments_m) == 4


def test_missing_and_unreadable(tmp_path: Path) -> None:
    assert refusal(tmp_path) == f"map /m.yaml: No such file or directory; {REMEDY}"
    (tmp_path / "m.yaml").write_bytes(b"\xff\xfe\x00")
    assert refusal(tmp_path) == f"map /m.yaml: not a text file; {REMEDY}"
    assert refusal(tmp_path, TASK.replace("m.yaml", "7")) == "map=7: refused; give a text"


def truncated(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-5])


def lying(path: Path) -> None:
    path.write_bytes(b"P5 10000 10000 255\n\x00\x00")


def enormous(path: Path) -> None:
    path.write_bytes(b"P5 100000 100000 255\n\x00\x00")


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (truncated, "damaged; give a .pgm or .png file"),
        (lying, "more than 25000000 cells; crop it, or save it coarser"),
        (enormous, "more than 25000000 cells; crop it, or save it coarser"),
    ],
)
def test_damaged_and_too_large_images(
    damage: Callable[[Path], None], reason: str, tmp_path: Path
) -> None:
    """Sizes are refused before a pixel is read: these two files have almost none."""
    write_map(tmp_path)
    damage(tmp_path / "m.pgm")
    assert refusal(tmp_path) == f"map image /m.pgm: {reason}"


def test_too_many_walls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(place_schema, "MOST_SEGMENTS", 3)
    write_map(tmp_path)
    assert refusal(tmp_path) == (
        "map /m.yaml: 4 wall segments, more than 3; "
        "remove the specks from its image, or save it coarser"
    )


def test_a_start_in_an_occupied_cell(tmp_path: Path) -> None:
    write_map(tmp_path, text="resolution: 1.0\norigin: [-1.5, -2.5, 0]\n")
    message = "start_m=[0.0, 0.0]: in an occupied cell of map /m.yaml; move it to a free one"
    assert refusal(tmp_path) == message
    write_map(tmp_path, text="resolution: 1.0\norigin: [-3.2, -2.5, 0]\n")
    assert refusal(tmp_path).startswith("start_m=[0.0, 0.0]: 0.1 m inside a wall segment")
