# SPDX-License-Identifier: Apache-2.0
r"""The decision digest: SHA-256 over one canonical form of the decisions of an episode.

Equal digests mean equal decisions, bit for bit, whichever driver made the run. The form,
version 1, is the ASCII line "mfba decisions 1\n" and then, per tick, little-endian and unpadded:

    u64 tick (0, 1, ...), i64 stamp_ns, f64 x, y, yaw of the pose,
    u8 1 and f64 x, y of the goal (u8 0 without a goal),
    u32 n and n f64 sector ranges, u32 n and n u8 bits of Vs, u32 n and n u8 bits of Vg,
    i32 gap, text mode, text reason, f64 x, y of the waypoint, f64 x, y of the velocity.

A text is u32 bytes and UTF-8. An f64 is its IEEE-754 bytes, zeros with their sign; every NaN
is the quiet NaN without payload. Raw CDR is not used: its padding is uninitialised memory.
"""

from __future__ import annotations

import hashlib
import math
import struct
from collections.abc import Iterable

from ..core.planner_types import Decision

HEAD = b"mfba decisions 1\n"

_COUNT = struct.Struct("<I")
_GAP = struct.Struct("<i")
_NAN = struct.pack("<d", math.nan)


class Digest:
    """The digest of a sequence of decisions, added one by one."""

    def __init__(self) -> None:
        """Start before tick 0."""
        self._hashed = hashlib.sha256(HEAD)
        self._tick = 0

    def add(self, decision: Decision) -> None:
        """Add the decision of the next tick."""
        self._hashed.update(canonical(self._tick, decision))
        self._tick += 1

    def hexdigest(self) -> str:
        """Hexadecimal SHA-256 of the decisions so far, 64 characters."""
        return self._hashed.hexdigest()


def digest(ticks: Iterable[Decision]) -> str:
    """Hexadecimal SHA-256 of the decisions, 64 characters."""
    whole = Digest()
    for decision in ticks:
        whole.add(decision)
    return whole.hexdigest()


def canonical(tick: int, decision: Decision) -> bytes:
    """The canonical form of one decision."""
    goal = decision.goal
    return b"".join(
        (
            struct.pack("<Qq", tick, decision.stamp_ns),
            _floats(decision.pose),
            b"\x00" if goal is None else b"\x01" + _floats(goal),
            _COUNT.pack(len(decision.ranges_m)),
            _floats(decision.ranges_m),
            _COUNT.pack(len(decision.vs)),
            bytes(decision.vs),
            _COUNT.pack(len(decision.vg)),
            bytes(decision.vg),
            _GAP.pack(decision.gap),
            _text(decision.mode.value),
            _text(decision.reason),
            _floats(decision.waypoint),
            _floats(decision.velocity),
        )
    )


def _floats(values: Iterable[float]) -> bytes:
    return b"".join(_NAN if v != v else struct.pack("<d", v) for v in values)


def _text(text: str) -> bytes:
    data = text.encode()
    return _COUNT.pack(len(data)) + data
