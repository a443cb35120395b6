# SPDX-License-Identifier: Apache-2.0
"""Read text files that others wrote."""

from __future__ import annotations

from pathlib import Path

from ..core.errors import ConfigError
from ..core.input_files import MOST_YAML_BYTES, read_input_text


def read_text(path: Path, remedy: str, what: str = "") -> str:
    """The text of a UTF-8 file. Raises ConfigError: what it is and its path, reason, remedy."""
    try:
        return read_input_text(path, MOST_YAML_BYTES)
    except (OSError, ValueError) as error:  # ValueError: not UTF-8, or a path with a NUL byte
        reason = getattr(error, "strerror", None) or "not a text file"
        raise ConfigError(f"{what}{path}: {reason}; {remedy}") from None
