# SPDX-License-Identifier: Apache-2.0
"""Helper of tables and compare, not a command: generated blocks of a Markdown page."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from ...core.errors import InputError, OutputError
from ...core.input_files import read_input_text
from ...core.output_files import write_new
from ...report.tables.markdown import fill


def read_page(path: Path, names: Iterable[str]) -> str:
    """The page's text; raises, before the long runs, if it lacks the marks of a block."""
    try:
        text = read_input_text(path)
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise InputError(
            f"{path}: cannot be read ({reason.lower()}); give a Markdown page"
        ) from None
    try:
        fill(text, dict.fromkeys(names, ""))
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return text


def replace_file(path: Path, content: bytes) -> None:
    """Replace a file atomically. Raises OutputError."""
    new = path.with_name(f"{path.name}.new")
    try:
        write_new(new, content)
        os.replace(new, path)
    except OSError as error:
        raise OutputError(
            f"{path}: cannot be written ({error.strerror}); give a writable page"
        ) from None
    finally:
        new.unlink(missing_ok=True)
