# SPDX-License-Identifier: Apache-2.0
"""Shared memory: what killed nodes have left is removed, half a megabyte for each.

Fast DDS keeps, in one directory, a segment for every participant and a port for every address
that it reads from. Each has a file whose lock the system drops when its process ends, even after
kill -9; the names are those of Fast DDS 2. A file that nobody locks belongs to nobody.
"""

from __future__ import annotations

import fcntl
import math
import os
import re
import time
from contextlib import suppress
from pathlib import Path

from ..core.errors import ConfigError

SHARED_MEMORY = Path("/dev/shm")
# Some pages that tracing and middleware write to at once: a process without them ends with a bus
# error, before or after its first line. With less than they would like, they use UDP.
_NEEDED_BYTES = 2**16
# A file is made before it is locked, in some microseconds.
_LEAST_AGE_S = 10.0
# Anybody may make a FIFO or a link in this directory.
_NEITHER_WAITS_NOR_FOLLOWS = os.O_RDONLY | os.O_NONBLOCK | os.O_NOFOLLOW | os.O_CLOEXEC
_LOCK = re.compile(r"(fastrtps_(?:[0-9a-f]{16}|port\d+))_(?:el|sl)")


def require_shared_memory(directory: Path = SHARED_MEMORY) -> None:
    """Raise ConfigError when shared memory is full, also without what killed nodes have left."""
    if _free_bytes(directory) >= _NEEDED_BYTES:
        return
    remove_abandoned(directory)
    if (free := _free_bytes(directory)) < _NEEDED_BYTES:
        raise ConfigError(
            f"{directory}: {free // 1024:.0f} kB free, and nodes need {_NEEDED_BYTES // 1024}; "
            "remove what fills it (`fastdds shm clean`) or make it larger"
        )


def _free_bytes(directory: Path) -> float:
    try:
        status = os.statvfs(directory)
    except OSError:
        return math.inf  # the middleware says so, and uses UDP
    # Zero blocks: a file system without a limit.
    return status.f_bavail * status.f_frsize if status.f_blocks else math.inf


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
            held.append(os.open(path, _NEITHER_WAITS_NOR_FOLLOWS))
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
