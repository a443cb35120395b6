# SPDX-License-Identifier: Apache-2.0
"""Parameters of nodes from a ROS 2 parameter file, as `ros2 run ... --params-file` reads it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

from ..core.errors import ConfigError
from ..core.input_files import MOST_YAML_BYTES, read_input_text
from . import yaml_text

PARAMETERS = "ros__parameters"
_GIVE = "give a file such as config/planner.yaml"


def read_params_file(path: Path, nodes: tuple[str, ...]) -> dict[str, dict[str, Any]]:
    """The parameters of these nodes at the root, by node; later sections override earlier ones.

    Raises ConfigError for a file that cannot be read, or holds none of these nodes.
    """
    try:
        content = yaml_text.load(read_input_text(path, MOST_YAML_BYTES))
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise ConfigError(f"--params-file {path}: {reason}; {_GIVE}") from None
    except (yaml.YAMLError, UnicodeDecodeError):
        raise ConfigError(f"--params-file {path}: not YAML; {_GIVE}") from None
    found: dict[str, dict[str, Any]] = {}
    for section, values in _sections(content, path):
        for node in nodes:
            if _matches(section, node):
                found.setdefault(node, {}).update(_flat(values))
    if not found:
        raise ConfigError(f"--params-file {path}: no parameters of {' or '.join(nodes)}; {_GIVE}")
    return found


def _sections(
    content: Any, path: Path, prefix: str = ""
) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """(node name or pattern, parameters); namespaces may be nested."""
    if not isinstance(content, dict):
        raise ConfigError(f"--params-file {path}: not a mapping of node names; {_GIVE}")
    for name, values in content.items():
        full = f"{prefix}/{str(name).strip('/')}"
        if isinstance(values, dict) and isinstance(values.get(PARAMETERS), dict):
            yield full, values[PARAMETERS]
        elif isinstance(values, dict):
            yield from _sections(values, path, full)


def _matches(section: str, node: str) -> bool:
    """Whether a section is of a node at the root: its name, or a wildcard of it or of all."""
    return section.strip("/") in (node, "*", "**", f"**/{node}", f"*/{node}")


def _flat(values: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in values.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value
