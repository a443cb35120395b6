# SPDX-License-Identifier: Apache-2.0
"""What passes for the CDR of a message."""

import pytest
import zstandard

from mfba_planner.recording.message_data import cdr_bytes

STRING = b"\0\1\0\0\3\0\0\0ab\0"


@pytest.mark.parametrize("identifier", range(12))
def test_every_representation_of_cdr_passes(identifier: int) -> None:
    data = bytes([0, identifier, 0, 0]) + STRING[4:]
    assert cdr_bytes(data) == data
    assert cdr_bytes(zstandard.compress(data)) == data


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\0\1\0",  # cut within its header
        b"\0\x0c\0\0\3\0\0\0ab\0",  # the first identifier that names no representation
        b"\0\xff\0\0",
        b"\1\1\0\0",
        b"text",
        zstandard.compress(b"text"),
        zstandard.compress(STRING)[:9],  # cut
    ],
)
def test_other_bytes_do_not(data: bytes) -> None:
    assert cdr_bytes(data) is None


def test_a_header_alone_is_an_empty_message() -> None:
    assert cdr_bytes(b"\0\1\0\0") == b"\0\1\0\0"
