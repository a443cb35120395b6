# SPDX-License-Identifier: Apache-2.0
"""Maps of Nav2's map_server: a .yaml file and its image, read and checked.

As map_server does (nav2_map_server/src/map_io.cpp): a pixel's shade is the mean of its channels,
in mode trinary with alpha as one of them; occupancy is 1 - shade, or with negate the shade; a cell
is occupied where that exceeds occupied_thresh. In mode scale a transparent pixel is unknown.
What is not occupied, known to be free or not, is no wall.
"""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import ConfigError
from ..core.geometry import Point
from ..core.input_files import open_input
from ..perception.known_map import COARSEST_M, FARTHEST_M, FINEST_M, MOST_CELLS
from .map_outline import outline

_LEVEL_RAD = 1e-6  # a yaw that is rounding
MODES = ("trinary", "scale")
MAP_REMEDY = "give the .yaml file that nav2's map_saver wrote, beside its image"

Array = np.ndarray


class OccupancyMap:
    """Which cells of a map are occupied, and where it lies in the odom frame."""

    def __init__(self, name: str, occupied: Array, resolution_m: float, origin_m: Point) -> None:
        """occupied: (rows, columns) of bool, the first row at the lowest y."""
        self.name, self.occupied = name, occupied
        self.resolution_m, self.origin_m = resolution_m, origin_m

    @property
    def refusal(self) -> str:
        """As Solid.refusal."""
        return f"in an occupied cell of {self.name}; move it to a free one"

    def covers(self, point: Point) -> bool:
        """Whether a point is in an occupied cell."""
        column, row = (
            math.floor((value - low) / self.resolution_m)
            for value, low in zip(point, self.origin_m)
        )
        rows, columns = self.occupied.shape
        return bool(0 <= row < rows and 0 <= column < columns and self.occupied[row, column])

    @property
    def segments(self) -> Array:
        """The outline of the occupied cells, (n, 4), metres."""
        return outline(self.occupied, self.resolution_m, self.origin_m)


def read_map(path: Path, content: Any) -> OccupancyMap:
    """The map of a .yaml file, whose parsed content is given; the image lies relative to it.

    Raises ConfigError naming the file, the value, the reason and the remedy.
    """
    name = f"map {path}"
    if not isinstance(content, dict):
        reason = "empty" if content is None else f"a {type(content).__name__}, not a mapping"
        raise ConfigError(f"{name}: {reason}; {MAP_REMEDY}")
    for key in ("image", "resolution", "origin"):
        if key not in content:
            raise ConfigError(f"{name}: {key} missing; {MAP_REMEDY}")
    resolution_m = _number(name, content, "resolution", 0.0, FINEST_M, COARSEST_M)
    threshold = _number(name, content, "occupied_thresh", 0.65, 0.0, 1.0)
    mode, negate = content.get("mode", MODES[0]), content.get("negate", 0)
    if mode not in MODES:
        raise ConfigError(f"{name}: mode={mode!r}: not supported; give {' or '.join(MODES)}")
    if negate not in (0, 1):
        raise ConfigError(f"{name}: negate={negate!r}: neither 0 nor 1; give one of them")
    origin_m = _origin(name, content["origin"])
    if not isinstance(content["image"], str) or not content["image"]:
        raise ConfigError(f"{name}: image={content['image']!r}: not a file; {MAP_REMEDY}")
    occupied = _read_occupied(path.parent / content["image"], mode, bool(negate), threshold)
    occupied = np.flipud(occupied)  # the first row of the image is the highest
    if not occupied.any():
        raise ConfigError(
            f"{name}: no cell is occupied; check negate={int(negate)} and "
            f"occupied_thresh={threshold:g}"
        )
    return OccupancyMap(name, occupied, resolution_m, origin_m)


def _number(
    name: str, content: dict[str, Any], key: str, default: float, low: float, high: float
) -> float:
    value = content.get(key, default)
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not (is_number and low <= value <= high):  # NaN is neither
        raise ConfigError(f"{name}: {key}={value!r}: give a number in [{low:g}, {high:g}]")
    return float(value)


def _origin(name: str, origin: Any) -> Point:
    is_list = isinstance(origin, list) and len(origin) in (2, 3)
    if not (is_list and all(type(v) in (int, float) and abs(v) <= FARTHEST_M for v in origin)):
        raise ConfigError(f"{name}: origin={origin!r}: give [x, y, 0], m")
    if len(origin) == 3 and abs(origin[2]) > _LEVEL_RAD:
        raise ConfigError(
            f"{name}: origin={origin!r}: rotated by {origin[2]:g} rad, which is not supported; "
            "save the map with yaw 0"
        )
    return (float(origin[0]), float(origin[1]))


def _read_occupied(path: Path, mode: str, negate: bool, threshold: float) -> Array:
    """Which pixels are occupied, (rows, columns) of bool."""
    from PIL import Image, UnidentifiedImageError

    try:
        with warnings.catch_warnings(), open_input(path) as file:
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            image = Image.open(file)
            width, height = image.size
            if width * height > MOST_CELLS:
                raise Image.DecompressionBombError
            if image.mode in ("L", "1") and not image.has_transparency_data:
                shades = np.arange(256) / 255.0  # of the usual map: by a table, for speed
                table = (shades if negate else 1.0 - shades) > threshold
                return table[np.asarray(image.convert("L"))]
            shade, alpha = _shade(image)
    except Image.DecompressionBombError:
        raise ConfigError(
            f"map image {path}: more than {MOST_CELLS} cells; crop it, or save it coarser"
        ) from None
    except UnidentifiedImageError:
        raise ConfigError(f"map image {path}: not an image; give a .pgm or .png file") from None
    except (OSError, ValueError, SyntaxError) as error:  # SyntaxError: a broken .png
        reason = getattr(error, "strerror", None) or "damaged"
        raise ConfigError(f"map image {path}: {reason}; give a .pgm or .png file") from None
    if alpha is not None and mode == "trinary":
        shade = (3.0 * shade + alpha) / 4.0
    occupancy = shade if negate else 1.0 - shade
    occupied: Array = occupancy > threshold
    if alpha is not None and mode == "scale":
        occupied &= alpha == 1.0  # a transparent pixel is unknown
    return occupied


def _shade(image: Any) -> tuple[Array, Array | None]:
    """Mean of the colours and alpha (None without) of every pixel, in [0, 1]."""
    if image.mode.startswith("I"):  # 16 bits of grey
        return np.asarray(image, dtype=np.float64) / 65535.0, None
    has_alpha = image.has_transparency_data
    pixels = np.asarray(image.convert("RGBA" if has_alpha else "RGB"))
    shade = pixels[:, :, :3].mean(axis=2, dtype=np.float64) / 255.0
    return shade, pixels[:, :, 3] / 255.0 if has_alpha else None
