# SPDX-License-Identifier: Apache-2.0
"""Read text files that others wrote."""

from __future__ import annotations

from pathlib import Path

from ..core.errors import ConfigError


def read_text(path: Path, remedy: str, what: str = "") -> str:
    """The text of a UTF-8 file. Raises ConfigError: what it is and its path, reason, remedy."""
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:  # ValueError: not UTF-8, or a path with a NUL byte
        reason = getattr(error, "strerror", None) or "not a text file"
        raise ConfigError(f"{what}{path}: {reason}; {remedy}") from None
