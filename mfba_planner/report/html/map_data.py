# SPDX-License-Identifier: Apache-2.0
"""The local maps of a run, and what a real robot perceived, for the page: few, and small."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from typing import Any

import numpy as np

from mfba_planner.recording.local_maps import MapPoints
from mfba_planner.recording.perceived import Perceived
from mfba_planner.simulation.episode import Episode

MOST_MAPS = 60  # of a run: about 3 kB each


def map_data(episode: Episode, maps: Sequence[MapPoints]) -> list[dict[str, Any]]:
    """Tick and points of each map; of more than MOST_MAPS a regular choice, with the last.

    Points are in cm, x and y in turn, sorted by y; each but the first as the difference from the
    one before.
    """
    stamps = [tick.stamp_ns for tick in episode.ticks]
    known = [(bisect_left(stamps, found.stamp_ns), found.points_m) for found in maps]
    known = [(k, points) for k, points in known if k < len(stamps)]
    chosen = known[:: -max(1, -(-len(known) // MOST_MAPS))][::-1]
    return [{"tick": k, "points": _differences(points)} for k, points in chosen]


def perceived_data(episode: Episode, perceived: Sequence[Perceived]) -> list[dict[str, Any]]:
    """Tick, returns (as the points of map_data) and tracks [x, y, radius, vx, vy] of each."""
    stamps = [tick.stamp_ns for tick in episode.ticks]
    known = [(bisect_left(stamps, found.stamp_ns), found) for found in perceived]
    return [
        {
            "tick": k,
            "points": _differences(found.points_m),
            "tracks": [
                [round(v, 3) for v in (*t.center_m, t.radius_m, *t.velocity_mps)]
                for t in found.tracks
            ],
        }
        for k, found in known
        if k < len(stamps)
    ]


def _differences(points_m: np.ndarray) -> list[int]:
    """Whole cm, sorted, as differences."""
    cm = np.rint(100.0 * points_m.astype(float)).astype(int)
    cm = np.unique(cm, axis=0)
    cm = cm[np.lexsort((cm[:, 0], cm[:, 1]))]
    moves: list[int] = np.diff(cm, axis=0, prepend=0).ravel().tolist()
    return moves
