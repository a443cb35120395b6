# SPDX-License-Identifier: Apache-2.0
"""Decode CDR by the definition that a bag holds of a type, without ROS."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory

from ..core.errors import BagError, InputError
from .message_definitions import Definition, definition_of


def decoder(known: Definition) -> Callable[[bytes], Any]:
    """A function from CDR to a message. Raises BagError, the reason alone, if there is none.

    A type without definition in the bag is decoded as it is installed, a ros2idl schema through
    rosbags.
    """
    known = _as_ros2msg(known)
    schema = Schema(id=1, name=known.type_name, encoding=known.encoding, data=known.text.encode())
    reason = f"schema encoding {known.encoding!r}, not ros2msg or ros2idl"
    try:
        found = DecoderFactory().decoder_for("cdr", schema)
    except Exception as error:  # the schema parser has no error of its own
        found, reason = None, f"its schema does not parse: {type(error).__name__}"
    if found is None:
        raise BagError(reason)
    return found


def _as_ros2msg(known: Definition) -> Definition:
    if not known.text:
        try:
            return definition_of(known.type_name)
        except InputError as error:
            reason = str(error).split("; ")[0]
            raise BagError(f"the bag holds no definition of it; {reason}") from None
    if known.encoding != "ros2idl":
        return known
    try:
        from .rosbags_definitions import idl_store, msg_text
    except ImportError:
        raise BagError(
            "its schema is ros2idl and rosbags is not installed: pip install 'mfba_planner[bags]'"
        ) from None
    try:
        text = msg_text(idl_store(known.text), known.type_name)
    except Exception as error:  # of many kinds, for any flaw of a foreign definition
        raise BagError(f"its ros2idl schema does not parse: {type(error).__name__}") from error
    return replace(known, text=text, encoding="ros2msg")
