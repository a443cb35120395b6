# SPDX-License-Identifier: Apache-2.0
"""Reading files that others wrote: regular files only, and not more of them than a limit.

A device such as /dev/zero never ends, and a FIFO without a writer blocks for ever.
"""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO

MOST_BYTES = 100_000_000
# PyYAML needs about 180 bytes and 4 us for a byte of its text.
MOST_YAML_BYTES = 20_000_000


def open_input(path: Path) -> BinaryIO:
    """Open a regular file, or a link to one, for reading.

    Raises OSError, whose strerror says so for anything else, and ValueError for a path with a NUL.
    """
    # Without O_NONBLOCK opening a FIFO waits for its writer; a regular file reads as ever.
    number = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
    try:
        mode = os.fstat(number).st_mode
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
        if not stat.S_ISREG(mode):
            raise OSError(errno.EINVAL, "not a regular file", str(path))
        return os.fdopen(number, "rb")
    except BaseException:
        os.close(number)
        raise


def read_input(path: Path, most_bytes: int = MOST_BYTES) -> bytes:
    """The content of a regular file. Raises as open_input, and OSError for more bytes."""
    with open_input(path) as file:
        return at_most(file.read(most_bytes + 1), path, most_bytes)


def read_input_text(path: Path, most_bytes: int = MOST_BYTES) -> str:
    """The text of a regular file in UTF-8. Raises as read_input, and UnicodeDecodeError."""
    return read_input(path, most_bytes).decode("utf-8").replace("\r\n", "\n").replace("\r", "\n")


def at_most(data: bytes, path: Path, most_bytes: int = MOST_BYTES) -> bytes:
    """The data. Raises OSError for more bytes."""
    if len(data) > most_bytes:
        raise OSError(errno.EFBIG, f"more than {most_bytes // 10**6} MB", str(path))
    return data
