# SPDX-License-Identifier: Apache-2.0
"""Trajectories that a scenario takes from CSV files: columns t_s, x_m, y_m, header or not."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any

from ..core.errors import ConfigError
from ..core.input_files import read_input
from ..simulation.recorded_motion import MOST_KNOTS

COLUMNS = ("t_s", "x_m", "y_m")
_GIVE = f"give lines of {', '.join(COLUMNS)}"


def with_trajectory_files(data: dict[Any, Any], folder: Path) -> dict[Any, Any]:
    """The scenario data with every `trajectory: FILE` replaced by the points of that file.

    A relative name is one below folder. Raises ConfigError for a file that is no trajectory.
    """
    obstacles = data.get("obstacles")
    if not isinstance(obstacles, list) or not any(map(_names_file, obstacles)):
        return data
    return data | {
        "obstacles": [
            {**entry, "trajectory": read_trajectory(folder / entry["trajectory"])}
            if _names_file(entry)
            else entry
            for entry in obstacles
        ]
    }


def _names_file(entry: object) -> bool:
    return isinstance(entry, dict) and isinstance(entry.get("trajectory"), str)


def read_trajectory(path: Path) -> list[list[float]]:
    """The points [t, x, y] of a CSV file. Raises ConfigError, naming file and line."""
    points: list[list[float]] = []
    try:
        lines = io.StringIO(read_input(path).decode("utf-8-sig"), newline="")
        for number, row in enumerate(csv.reader(lines), start=1):
            words = [word.strip() for word in row]
            if not any(words) or (not points and tuple(words) == COLUMNS):
                continue
            points.append(_point(words, f"{path} line {number}"))
            if len(points) > MOST_KNOTS:
                raise ConfigError(f"{path}: more than {MOST_KNOTS} points; give fewer")
    except (OSError, ValueError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise ConfigError(f"trajectory {path}: {reason}; {_GIVE}") from None
    if not points:
        raise ConfigError(f"trajectory {path}: empty; {_GIVE}")
    return points


def _point(words: list[str], where: str) -> list[float]:
    try:
        t, x, y = map(float, words)
    except ValueError:
        shown = ", ".join(words)[:60]
        raise ConfigError(f"trajectory {where}: {shown!r}: not three numbers; {_GIVE}") from None
    return [t, x, y]
