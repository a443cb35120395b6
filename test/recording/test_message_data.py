# SPDX-License-Identifier: Apache-2.0
"""What passes for the CDR of a stored message."""

import pytest
import zstandard
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.recording.message_data import cdr_bytes


@given(st.binary(max_size=8).filter(lambda data: not data.startswith(b"\x28\xb5\x2f\xfd")))
def test_cdr_starts_with_one_of_twelve_representations(data: bytes) -> None:
    """Of RTPS, 0x0000 to 0x000b; then two bytes of options."""
    is_cdr = len(data) >= 4 and int.from_bytes(data[:2], "big") <= 0x000B
    assert cdr_bytes(data) == (data if is_cdr else None)


@pytest.mark.parametrize(
    ("head", "passes"),
    [("000b0000", True), ("000c0000", False), ("01010000", False), ("000100", False)],
)
def test_the_last_representation_and_the_shortest_header(head: str, passes: bool) -> None:
    data = bytes.fromhex(head)
    for stored in (data, zstandard.compress(data)):
        assert cdr_bytes(stored) == (data if passes else None)


def test_a_compressed_message_that_is_cut_or_broken_is_none() -> None:
    stored = zstandard.compress(bytes.fromhex("00010000") + bytes(range(256)))
    assert cdr_bytes(stored[:4] + b"\xff" * 8) is None
