# SPDX-License-Identifier: Apache-2.0
"""Onto a terminal or into a pipe, whatever letters its encoding has."""

from __future__ import annotations

from collections.abc import Callable

from rich.console import Console


def print_encodable(console: Console, draw: Callable[[Console], None]) -> None:
    """Print what draw prints, with a question mark for each letter the encoding lacks."""
    with console.capture() as captured:
        draw(console)
    encoding = console.encoding
    console.file.write(captured.get().encode(encoding, "replace").decode(encoding))
    console.file.flush()
