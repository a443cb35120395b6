# SPDX-License-Identifier: Apache-2.0
"""Message definitions and RIHS01 type hashes from the installed interface packages."""

from __future__ import annotations

import json
import os
import re
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from ..core.errors import InputError

_SEPARATOR = "\n" + "=" * 80 + "\n"
_FIELD_TYPE = re.compile(r"\s*(?:([A-Za-z]\w*)/)?([A-Za-z]\w*)")
_PRIMITIVES = frozenset(
    ("bool", "byte", "char", "float32", "float64", "int8", "uint8", "int16", "uint16")
    + ("int32", "uint32", "int64", "uint64", "string", "wstring")
)


@dataclass(frozen=True, slots=True)
class Definition:
    """A message type as stored in a bag: `pkg/msg/Name`, schema text, RIHS01 hash."""

    type_name: str
    text: str
    type_hash: str
    encoding: str = "ros2msg"


def definition_of(type_name: str) -> Definition:
    """The definition of a message type. Raises InputError if it is not installed."""
    return _definition(type_name, _prefixes())


def _prefixes() -> tuple[str, ...]:
    # A sourced workspace lists its prefixes; the wheels install share/ under sys.prefix.
    ament = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    return (*(prefix for prefix in ament if prefix), sys.prefix)


@cache
def _definition(type_name: str, prefixes: tuple[str, ...]) -> Definition:
    fields = type_name.split("/")
    if len(fields) != 3 or fields[1] != "msg" or not all(fields):
        raise InputError(
            f"{type_name!r}: not a message type; write package/msg/Name, like std_msgs/msg/String"
        )
    path = _msg_file(fields[0], fields[2], prefixes)
    own, *dependencies = _with_dependencies(fields[0], fields[2], prefixes, set())
    blocks = [f"{_SEPARATOR}MSG: {package}/{name}\n{text}" for package, name, text in dependencies]
    return Definition(type_name, own[2] + "".join(blocks), _type_hash(type_name, path))


def _with_dependencies(
    package: str, name: str, prefixes: tuple[str, ...], visited: set[tuple[str, str]]
) -> list[tuple[str, str, str]]:
    """(package, name, .msg text) of a type and its dependencies, depth first, each once.

    Dependencies are sorted by name, so that the text equals rosbag2's to the byte.
    """
    visited.add((package, name))
    text = _msg_file(package, name, prefixes).read_text(encoding="utf-8")
    found = [(package, name, text)]
    fields = [match for match in map(_FIELD_TYPE.match, text.splitlines()) if match]
    uses = {(match[1] or package, match[2]) for match in fields if match[2] not in _PRIMITIVES}
    for used in sorted(uses):
        if used not in visited:
            found += _with_dependencies(*used, prefixes, visited)
    return found


def _msg_file(package: str, name: str, prefixes: tuple[str, ...]) -> Path:
    for prefix in prefixes:
        path = Path(prefix, "share", package, "msg", f"{name}.msg")
        if path.is_file():
            return path
    raise InputError(
        f"{package}/msg/{name}: this message type is not installed; "
        f"install the ROS 2 package {package} or leave the topic out"
    )


def _type_hash(type_name: str, msg_file: Path) -> str:
    path = msg_file.with_suffix(".json")
    try:
        hashes = json.loads(path.read_text(encoding="utf-8"))["type_hashes"]
        return next(str(h["hash_string"]) for h in hashes if h["type_name"] == type_name)
    except (OSError, ValueError, KeyError, TypeError, StopIteration) as error:
        raise InputError(
            f"{path}: holds no type hash of {type_name} ({type(error).__name__}); "
            f"install the ROS 2 package {type_name.split('/')[0]} again"
        ) from error
