# SPDX-License-Identifier: Apache-2.0
"""Space that was seen free a moment ago: what is there now has moved.

Whatever stands never comes to be where a beam has passed, whatever its shape and wherever it is
seen from. So this tells what moves among walls and things that are partly hidden, where the
middle of the visible part moves although nothing does.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from .scan_beams import Beams

Array = np.ndarray

_LAGS_S = (0.6, 0.25)  # ages of the scans that are compared, or the next older
_EVERY_S = 0.09  # scans nearer in time to the last one kept are not kept
_MARGIN_M = 0.08
_WIDEST_SPACING_M = 0.12  # between beams farther apart nothing is judged


class _Past:
    """A past scan, as free lengths along its beams; these are computed when first needed."""

    def __init__(self, beams: Beams, error: tuple[float, float, float], turn_sd: float) -> None:
        ex, ey, self._turn = error
        self._x, self._y = float(beams.origin_x[0]) - ex, float(beams.origin_y[0]) - ey
        self._beams, self._turn_sd = beams, turn_sd
        self._clear_m: Array | None = None
        self.age_s = 0.0

    def passed(self, x: Array, y: Array, margin_m: float) -> Array:
        """Whether the beams at and beside each point (k,) ended at least margin_m behind it."""
        beams = self._beams
        dx, dy = x - self._x, y - self._y
        d = np.sqrt(dx * dx + dy * dy)
        index = beams.index_of(np.arctan2(dy, dx) + self._turn)
        passed: Array = d * beams.spacing_rad <= _WIDEST_SPACING_M
        if not beams.turns:
            inside = index < beams.count
            passed &= inside
            index *= inside
        d += margin_m
        passed &= self._clear().take(index) > d
        return passed

    def _clear(self) -> Array:
        """Free length (count,) of each beam and those beside it."""
        if self._clear_m is None:
            beams = self._beams
            reach = np.minimum(beams.range_m, beams.longest_m)
            clear = reach
            if reach.size < beams.count:
                clear = np.zeros(beams.count)
                clear[beams.number] = reach
            beside = min(1 + math.floor(2.0 * self._turn_sd / beams.spacing_rad), beams.count)
            around = np.concatenate((clear[-beside:], clear, clear[:beside]))
            least = clear.copy()
            for k in range(2 * beside + 1):
                np.minimum(least, around[k : k + clear.size], out=least)
            if not beams.turns:
                least[:beside] = least[least.size - beside :] = 0.0
            self._clear_m = least
        return self._clear_m


class FreeSpace:
    """The last scans, as free lengths along their beams."""

    def __init__(self, lags_s: tuple[float, ...] = _LAGS_S, margin_m: float = _MARGIN_M) -> None:
        """Start without scans; the lags are the ages of the scans that are compared."""
        self._lags_s, self._margin_m = lags_s, margin_m
        self._past: deque[_Past] = deque(maxlen=math.ceil(max(lags_s) / _EVERY_S) + 2)

    def clear(self) -> None:
        """Drop all scans."""
        self._past.clear()

    def add(self, beams: Beams, error: tuple[float, float, float], turn_sd: float) -> None:
        """Keep a scan, with its pose's error; turn_sd is that of errors of the heading, rad."""
        if beams.range_m.size and not (self._past and self._past[-1].age_s < _EVERY_S):
            self._past.append(_Past(beams, error, turn_sd))

    def pass_time(self, dt: float) -> None:
        """The next scan is dt seconds later."""
        for past in self._past:
            past.age_s += dt

    def appeared(self, x: Array, y: Array, noise_m: float) -> Array:
        """Whether each point (k,) lies where a past scan saw farther on."""
        found = np.zeros(x.size, dtype=bool)
        for past in self._compared():
            found |= past.passed(x, y, self._margin_m + noise_m)
        return found

    def _compared(self) -> list[_Past]:
        """For each lag the newest scan at least so old, or else the oldest."""
        chosen: list[_Past] = []
        for lag in self._lags_s:
            older = [past for past in self._past if past.age_s >= lag - 0.5 * _EVERY_S]
            candidate = older[-1] if older else (self._past[0] if self._past else None)
            if candidate is not None and candidate not in chosen:
                chosen.append(candidate)
        return chosen
