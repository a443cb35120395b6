# SPDX-License-Identifier: Apache-2.0
"""What a lidar reports where nothing is within range: drivers differ; inside it is +inf."""

from __future__ import annotations

from enum import Enum

import numpy as np


class NoReturn(Enum):
    """The range by which a driver reports that nothing is there."""

    INF = "inf"
    ZERO = "zero"
    RANGE_MAX = "range_max"
    NAN = "nan"


def rep_117(ranges_m: np.ndarray, range_max_m: float, no_return: NoReturn) -> np.ndarray:
    """The ranges as REP-117 has them, (n,): +inf is free, -inf too near, NaN tells nothing.

    0.0 is no measurement, so it tells nothing unless it means that nothing is there.
    """
    r = np.asarray(ranges_m, dtype=np.float64)
    if no_return is NoReturn.INF:
        free = None
    elif no_return is NoReturn.ZERO:
        free = r == 0.0
    elif no_return is NoReturn.RANGE_MAX:
        free = r >= range_max_m
    else:
        free = np.isnan(r)
    zero = r == 0.0
    if zero.any():
        r = np.where(zero, np.nan, r)
    return r if free is None else np.where(free, np.inf, r)
