# SPDX-License-Identifier: Apache-2.0
"""Random streams of decisions: children of one seed, keyed by purpose and stamp."""

from __future__ import annotations

import numpy as np

PLANNER_STREAM = 1  # spawn key of the planner's SeedSequence child; one number per purpose
_WORD = 2**32  # numbers below it fit into one word of SeedSequence


def stream(seed: int, stamp_ns: int) -> np.random.Generator:
    """The random stream of one decision: a child of the seed, keyed by purpose and stamp.

    It equals SeedSequence(seed, spawn_key=(PLANNER_STREAM, stamp_ns)). Passing the 32-bit words
    that SeedSequence derives from these takes half the time.
    """
    high, low = divmod(stamp_ns, _WORD)
    if 0 <= seed < _WORD and 0 < high < _WORD:
        words = np.array((seed, 0, 0, 0, PLANNER_STREAM, low, high), dtype=np.uint32)
        sequence = np.random.SeedSequence(words)
    else:
        sequence = np.random.SeedSequence(seed, spawn_key=(PLANNER_STREAM, stamp_ns))
    return np.random.Generator(np.random.PCG64(sequence))
