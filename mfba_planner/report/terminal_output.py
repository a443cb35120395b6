# SPDX-License-Identifier: Apache-2.0
"""Print to a terminal or pipe whose encoding may lack some characters."""

from __future__ import annotations

from collections.abc import Callable

from rich.console import Console


def print_encodable(console: Console, draw: Callable[[Console], None]) -> None:
    """Print what draw prints, with a question mark for each character the encoding lacks."""
    with console.capture() as captured:
        draw(console)
    encoding = console.encoding
    console.file.write(captured.get().encode(encoding, "replace").decode(encoding))
    console.file.flush()
