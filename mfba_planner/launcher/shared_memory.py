# SPDX-License-Identifier: Apache-2.0
"""Removes what killed nodes have left in shared memory: half a megabyte for each.

Fast DDS keeps, in one directory, a segment for every participant and a port for every address
that it reads from. Each has a file whose lock the system drops when its process ends, even after
kill -9; the names are those of Fast DDS 2. A file that nobody locks belongs to nobody.
"""

from __future__ import annotations

import fcntl
import os
import re
import time
from contextlib import suppress
from pathlib import Path

SHARED_MEMORY = Path("/dev/shm")
# A file is made before it is locked, in some microseconds.
_LEAST_AGE_S = 10.0
_LOCK = re.compile(r"(fastrtps_(?:[0-9a-f]{16}|port\d+))_(?:el|sl)")


def remove_abandoned(directory: Path = SHARED_MEMORY) -> int:
    """Remove this user's segments and ports that no process holds; return their number.

    The mutex of a port stays: another process may wait for it.
    """
    try:
        found = {match[1] for name in os.listdir(directory) if (match := _LOCK.fullmatch(name))}
    except OSError:
        return 0
    return sum(_remove(directory / name) for name in sorted(found))


def _remove(memory: Path) -> bool:
    """Remove a segment or port with its locks if all of them are free."""
    locks = [path for suffix in ("el", "sl") if (path := Path(f"{memory}_{suffix}")).exists()]
    held: list[int] = []
    try:
        for path in locks:
            held.append(os.open(path, os.O_RDONLY | os.O_CLOEXEC))
            fcntl.flock(held[-1], fcntl.LOCK_EX | fcntl.LOCK_NB)
            status = os.fstat(held[-1])
            if (
                status.st_uid != os.getuid()
                or status.st_ino != path.stat().st_ino  # replaced since it was opened
                or time.time() - status.st_mtime < _LEAST_AGE_S
            ):
                return False
        # A process that comes now finds the locks taken until the memory is gone: it would
        # otherwise use what is removed under it.
        for path in (memory, *locks):
            with suppress(FileNotFoundError):
                path.unlink()
    except OSError:
        return False  # in use, or removed by another
    finally:
        for descriptor in held:
            os.close(descriptor)
    return True
