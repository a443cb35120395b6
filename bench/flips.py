# SPDX-License-Identifier: Apache-2.0
"""Flip one thing in a recorded bag, any number of times: `mfba verify` must notice each.

A flip is a bit of a recorded sensory vector (in /sensory_vector, in Vs of the decision, or by a
range of /sectors), the last mantissa bit of a waypoint coordinate, or a mode. The bag that is
written with it is sound in all other respects.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from mfba_planner.core.planner_types import Mode
from mfba_planner.verification.verify_bag import verify

sys.path.insert(0, str(Path(__file__).parents[1] / "test" / "helpers"))
from edited_bags import one_changed, record, rewrite, set_field

DECISION = "/planner/decision"


def main() -> int:
    """Print what was flipped how often and noticed how often; exit 1 unless all were."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flips", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    made: Counter[str] = Counter()
    noticed: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as root:
        bag = record(Path(root) / "bag", "case2", 4)
        ticks = len(verify(bag).recorded)
        assert verify(bag).is_identical
        for index in range(options.flips):
            what, topic, change = flip(rng)
            index_of_message = int(rng.integers(ticks))
            edited = rewrite(
                bag, Path(root) / f"edited{index}", one_changed(topic, index_of_message, change)
            )
            made[what] += 1
            if verify(edited).is_identical:
                print(f"NOT noticed: {what}, message {index_of_message}")
            else:
                noticed[what] += 1
    for what, count in sorted(made.items()):
        print(f"{what:<28} {noticed[what]:>4} of {count:>4} noticed")
    print(f"{noticed.total()} of {made.total()} noticed")
    return int(noticed.total() < made.total())


def flip(rng: np.random.Generator) -> tuple[str, str, Callable[[Any], None]]:
    """One random flip: what it is, where, and how it is done."""
    sector, axis = int(rng.integers(12)), int(rng.integers(2))

    def vector(message: Any) -> None:
        message.data[sector] ^= 1

    def ranges(message: Any) -> None:
        message.ranges[sector] = 0.5 if np.isinf(message.ranges[sector]) else np.inf

    def bits(text: str) -> str:
        return text[:sector] + "10"[int(text[sector])] + text[sector + 1 :]

    def last_bit(text: str) -> str:
        chunks = [float(number) for number in text.split(",")]
        raw = np.float64(chunks[axis]).view(np.uint64) ^ np.uint64(1)
        chunks[axis] = float(raw.view(np.float64))
        return ",".join(map(repr, chunks))

    def mode(text: str) -> str:
        others = [other.value for other in Mode if other.value != text]
        return others[int(rng.integers(len(others)))]

    kinds: list[tuple[str, str, Callable[[Any], None]]] = [
        ("bit of /sensory_vector", "/sensory_vector", vector),
        ("range of /sectors", "/sectors", ranges),
        ("bit of Vs in the decision", DECISION, set_field("vs", bits)),
        ("last bit of the waypoint", DECISION, set_field("waypoint", last_bit)),
        ("mode", DECISION, set_field("mode", mode)),
    ]
    return kinds[int(rng.integers(len(kinds)))]


if __name__ == "__main__":
    raise SystemExit(main())
