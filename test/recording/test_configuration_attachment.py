# SPDX-License-Identifier: Apache-2.0
"""The configuration attachment of a bag: stored, read back, refused."""

import math
from pathlib import Path
from typing import Any

import pytest
from recorded_bags import FOREIGN

from mfba_planner.core.errors import BagError, OutputError
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.bag_writer import BagWriter
from mfba_planner.recording.configuration_attachment import (
    ATTACHMENT_NAME,
    attach_configuration,
    read_configuration,
)

CONFIGURATION = {
    "scenario": {"name": "case1", "goal": [10.0, 10.0]},
    "nodes": {"planner": {"sectors": 12}},
    "seed": 3,
}


def test_read_returns_what_was_attached(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "run1") as writer:
        attach_configuration(writer, {"seed": 1})
        attach_configuration(writer, CONFIGURATION)  # the newest is read
    with BagReader(tmp_path / "run1") as reader:
        assert read_configuration(reader) == {"schema_version": 1, **CONFIGURATION}


@pytest.mark.parametrize("value", [math.nan, math.inf, {1, 2}, b"bytes"])
def test_values_that_json_cannot_hold_are_refused_and_not_stored(
    tmp_path: Path, value: Any
) -> None:
    writer = BagWriter(tmp_path / "run1")
    with pytest.raises(OutputError, match="configuration: cannot be stored as JSON"):
        attach_configuration(writer, {"value": value})
    writer.close()
    with BagReader(tmp_path / "run1") as reader:
        assert reader.attachments == ()


def test_bag_without_configuration(tmp_path: Path) -> None:
    with BagReader(FOREIGN) as reader, pytest.raises(BagError, match="has no mfba_planner/"):
        read_configuration(reader)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "is not JSON"),
        (b"\xff\xfe", "is not JSON"),
        (b"{", "is not JSON"),
        (b"[1]", "schema_version None, only 1 can be read"),
        (b"{}", "schema_version None"),
        (b'{"schema_version": 2}', "schema_version 2, only 1"),
        (b'{"schema_version": "1"}', "schema_version '1', only 1"),
    ],
)
def test_other_content_is_refused(tmp_path: Path, data: bytes, reason: str) -> None:
    with BagWriter(tmp_path / "run1") as writer:
        writer.attach(ATTACHMENT_NAME, "application/json", data)
    with BagReader(tmp_path / "run1") as reader, pytest.raises(BagError, match=reason) as caught:
        read_configuration(reader)
    assert "\n" not in str(caught.value)
