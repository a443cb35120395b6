# SPDX-License-Identifier: Apache-2.0
"""The configuration of a run as an attachment of its bag: write and read it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ..core.errors import BagError, OutputError
from .bag_reader import BagReader

if TYPE_CHECKING:  # reading a bag must not load the writer
    from .bag_writer import BagWriter

ATTACHMENT_NAME = "mfba_planner/configuration.json"
MEDIA_TYPE = "application/json"
SCHEMA_VERSION = 1


def attach_configuration(writer: BagWriter, configuration: Mapping[str, Any]) -> None:
    """Store the configuration in a bag, with its schema_version. Raises OutputError."""
    content = {"schema_version": SCHEMA_VERSION, **configuration}
    try:
        text = json.dumps(content, indent=1, sort_keys=True, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise OutputError(
            f"configuration: cannot be stored as JSON ({error}); use finite numbers and text"
        ) from error
    writer.attach(ATTACHMENT_NAME, MEDIA_TYPE, text.encode())


def has_configuration(reader: BagReader) -> bool:
    """Whether a bag holds a configuration."""
    return any(index.name == ATTACHMENT_NAME for index in reader.attachments)


def read_configuration(reader: BagReader) -> dict[str, Any]:
    """The configuration in a bag. Raises BagError if missing or of an unknown version."""
    data = reader.attachment(ATTACHMENT_NAME)
    if data is None:
        raise BagError(
            f"{reader.path}: has no {ATTACHMENT_NAME}, so it was not recorded by mfba; "
            "give the parameters of its nodes with `mfba verify --params-file FILE`, or use "
            "`mfba decide`"
        )
    try:
        content = json.loads(data)
    except ValueError as error:
        raise BagError(
            f"{reader.path}: {ATTACHMENT_NAME} is not JSON ({error}); record the bag again"
        ) from error
    version = content.get("schema_version") if isinstance(content, dict) else None
    if version != SCHEMA_VERSION:
        raise BagError(
            f"{reader.path}: {ATTACHMENT_NAME} has schema_version {version!r}, only "
            f"{SCHEMA_VERSION} can be read; use the mfba that recorded it"
        )
    return dict(content)
