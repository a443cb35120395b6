# SPDX-License-Identifier: Apache-2.0
"""The decision digest: its form, its fields, and the stored digests of the case studies."""

import hashlib
import math
import struct
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.planner_types import Decision, Mode
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation import run_episode
from mfba_planner.simulation.decision_digest import HEAD, canonical, digest

SAMPLE = Decision(
    stamp_ns=5,
    mode=Mode.OBSTACLE_AVOIDANCE,
    reason="säctor",
    pose=Pose2D(1.0, -0.0, 0.5),
    goal=(12.0, 12.0),
    ranges_m=(0.25, math.inf, math.nan),
    vs=(1, 0, 0),
    vg=(1, 0, 1),
    gap=2,
    waypoint=(1.5, 2.5),
    velocity=(0.1, -0.2),
    candidates=((9.0, 9.0),),
)


def spelt_out() -> bytes:
    """SAMPLE at tick 3, byte by byte, as documented."""
    mode, reason = b"obstacle_avoidance", "säctor".encode()
    return b"".join(
        [
            (3).to_bytes(8, "little"),
            (5).to_bytes(8, "little"),
            struct.pack("<3d", 1.0, -0.0, 0.5),
            b"\x01" + struct.pack("<2d", 12.0, 12.0),
            (3).to_bytes(4, "little") + struct.pack("<2d", 0.25, math.inf),
            bytes.fromhex("000000000000f87f"),
            (3).to_bytes(4, "little") + b"\x01\x00\x00",
            (3).to_bytes(4, "little") + b"\x01\x00\x01",
            (2).to_bytes(4, "little"),
            len(mode).to_bytes(4, "little") + mode,
            len(reason).to_bytes(4, "little") + reason,
            struct.pack("<4d", 1.5, 2.5, 0.1, -0.2),
        ]
    )


def test_the_canonical_form_is_as_documented() -> None:
    assert canonical(3, SAMPLE) == spelt_out()
    assert digest([SAMPLE]) == hashlib.sha256(HEAD + canonical(0, SAMPLE)).hexdigest()


def next_up(x: float) -> float:
    return math.nextafter(x, math.inf)


@pytest.mark.parametrize(
    "changed",
    [
        {"stamp_ns": 6},
        {"mode": Mode.BLOCKED},
        {"reason": "sector"},
        {"pose": Pose2D(next_up(1.0), -0.0, 0.5)},
        {"pose": Pose2D(1.0, 0.0, 0.5)},
        {"goal": None},
        {"goal": (12.0, next_up(12.0))},
        {"ranges_m": (0.25, math.inf)},
        {"ranges_m": (next_up(0.25), math.inf, math.nan)},
        {"vs": (1, 0, 1)},
        {"vg": (1, 1, 1)},
        {"gap": 1},
        {"waypoint": (1.5, next_up(2.5))},
        {"velocity": (next_up(0.1), -0.2)},
    ],
    ids=str,
)
def test_every_field_counts_to_the_last_bit(changed: dict[str, Any]) -> None:
    assert digest([replace(SAMPLE, **changed)]) != digest([SAMPLE])


def test_sequence_and_number_of_ticks_count() -> None:
    other = replace(SAMPLE, gap=1)
    found = {digest(ticks) for ticks in ([], [SAMPLE], [SAMPLE, other], [other, SAMPLE])}
    assert len(found) == 4


@given(st.binary(min_size=6, max_size=6).filter(any))
def test_every_nan_is_the_same(payload: bytes) -> None:
    (nan,) = struct.unpack("<d", payload + b"\xf0\xff")
    assert digest([replace(SAMPLE, ranges_m=(0.25, math.inf, nan))]) == digest([SAMPLE])


def test_candidates_are_not_in_the_digest() -> None:
    assert digest([replace(SAMPLE, candidates=())]) == digest([SAMPLE])


@pytest.mark.parametrize(
    ("scenario", "expected"),
    [
        ("case1", "39970c339567b4b0f406f0fe79d5a35b513cbd619018e6fc3d6c128057b17d12"),
        ("case2", "f1efb25e51056bfbb8582e42749db90a0bd23e991220deabc8986c6f81f456a9"),
    ],
)
def test_the_case_studies_keep_their_digests(scenario: str, expected: str) -> None:
    """A change here changes the decisions of every user: note it in the CHANGELOG."""
    ticks = run_episode.run(load_scenario(scenario), seed=1).ticks
    assert digest(ticks) == expected
