# SPDX-License-Identifier: Apache-2.0
"""Parameters of the command line that rcl has dropped without a word."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

from rclpy.node import Node

from ...core.errors import ConfigError
from ...recording import yaml_text
from ..interface.parameters import plain

_BOOLS = {True: ("true", "yes", "on", "y"), False: ("false", "no", "off", "n")}


def check_given_parameters(node: Node, args: list[str]) -> None:
    """Raise ConfigError for a -p NAME:=VALUE that the node has not got.

    rcl lets a file's section of the node's name count more than -p, which is one for all nodes;
    and it drops a -p whose type differs from that of the same parameter in a file. A file that
    follows a -p may change what it says, as later arguments do: that is a warning.
    """
    files = [index for index, arg in enumerate(args) if arg == "--params-file"]
    after_files = _given(node, args[files[-1] :] if files else args)
    for name, texts in _given(node, args).items():
        override = node._parameter_overrides.get(name)
        value = None if override is None else plain(override.value)
        is_empty = override is not None and value is None  # an empty list
        if is_empty or any(_is_value(text, value) for text in texts):
            continue
        if name not in after_files and override is not None:
            node.get_logger().warning(
                f"-p {name}:={texts[-1]} has no effect: a parameter file that follows it says "
                f"{value!r}; give -p after the file"
            )
            continue
        remedy = "change it there"
        if node.get_namespace() == "/":
            remedy += f", or give -p {node.get_name()}:{name}:={texts[-1]}"
        says = "" if override is None else f": a parameter file says {value!r} for this node"
        raise ConfigError(f"-p {name}:={texts[-1]} has no effect{says}; {remedy}")


def _given(node: Node, args: list[str]) -> dict[str, list[str]]:
    """The texts of every -p for this node, by parameter."""
    given: dict[str, list[str]] = {}
    for prefix, name, text in _assignments(args):
        if prefix in ("", node.get_name()):
            given.setdefault(name, []).append(text)
    return given


def _assignments(args: list[str]) -> Iterator[tuple[str, str, str]]:
    """(node or "", name, text) of every -p [NODE:]NAME:=VALUE."""
    for option, rule in zip(args, args[1:]):
        if option in ("-p", "--param") and ":=" in rule:
            left, _, text = rule.partition(":=")
            prefix, _, name = left.rpartition(":")
            yield prefix, name, text


def _is_value(text: str, value: Any) -> bool:
    """Whether rcl may have read a text as this value: its YAML is older than PyYAML's."""
    if isinstance(value, bool):
        return text.lower() in _BOOLS[value]
    if isinstance(value, float):
        with suppress(ValueError):
            number = float(text.lstrip(".") if math.isnan(value) else text)
            return number == value or (math.isnan(number) and math.isnan(value))
    with suppress(Exception):  # whatever PyYAML says to it
        if yaml_text.load(text) == value:
            return True
    if isinstance(value, list):
        inner = [part.strip() for part in text.strip().strip("[]").split(",")]
        parts = [part for part in inner if part]
        return len(parts) == len(value) and all(map(_is_value, parts, value))
    return text.strip("'\"") == str(value)
