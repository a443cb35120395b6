# SPDX-License-Identifier: Apache-2.0
"""Standard streams that were closed before the start, as by `>&-` or a service manager."""

from __future__ import annotations

import os
import sys

from .errors import OutputError


def open_closed_streams() -> None:
    """Connect each closed one of descriptors 0, 1 and 2 to /dev/null.

    Otherwise the next file, such as a bag, would get that number, and log lines with it.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number: this one
            os.set_inheritable(number, True)  # a child would find it closed again


def require_stdout() -> None:
    """Raise OutputError when Python started without a standard output."""
    if sys.stdout is None:
        raise OutputError("stdout: closed; redirect it to a file or to /dev/null")
