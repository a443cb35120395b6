# SPDX-License-Identifier: Apache-2.0
"""What killed nodes leave in shared memory is removed, and nothing else."""

from __future__ import annotations

import fcntl
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from launched_programs import Program
from rclpy.context import Context
from rclpy.node import Node
from waiting import claim_domain, wait_until

from mfba_planner.ros.shared_memory import (
    SHARED_MEMORY,
    remove_abandoned,
    require_shared_memory,
)

_KILLED = """
import os, signal
from rclpy.context import Context
from rclpy.node import Node
context = Context()
context.init(domain_id={domain})
node = Node("killed", context=context)
print(*(os.readlink(f"/proc/self/fd/{{fd}}") for fd in os.listdir("/proc/self/fd")
        if os.path.exists(f"/proc/self/fd/{{fd}}")), flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""
SEGMENT = "fastrtps_0123456789abcdef"


def locks_in(text: str) -> list[Path]:
    """The lock files of segments among the open files of a process.

    Ports come again: other nodes take their numbers, or still send to them.
    """
    return [
        Path(name) for name in re.findall(rf"{SHARED_MEMORY}/fastrtps_[0-9a-f]{{16}}_el", text)
    ]


def memory_with(lock: Path) -> Path:
    """The segment or port that a lock file belongs to."""
    return lock.with_name(lock.name[:-3])


def of_age(path: Path, age_s: float = 60.0) -> Path:
    """The file, made if need be, last changed so long ago."""
    path.touch()
    os.utime(path, (path.stat().st_mtime - age_s,) * 2)
    return path


def memory_of(directory: Path, name: str, suffix: str = "_el", age_s: float = 60.0) -> list[Path]:
    """A segment or port with its lock, as Fast DDS makes them."""
    return [of_age(directory / name, age_s), of_age(directory / f"{name}{suffix}", age_s)]


def test_a_node_removes_what_a_killed_one_left_and_not_what_a_live_one_has(tmp_path: Path) -> None:
    """With Fast DDS itself: its names, and its locks."""
    domain, lock = claim_domain()
    context = Context()
    context.init(domain_id=domain)
    node = Node("live", context=context)
    live = locks_in(_open_files())
    done = subprocess.run(
        [sys.executable, "-c", _KILLED.format(domain=domain)],
        capture_output=True,
        text=True,
        check=False,
    )
    left = locks_in(done.stdout)
    try:
        assert left, done.stdout + done.stderr
        assert live
        for path in (*left, *live):
            of_age(path)
        with Program("virtual_sensor", cwd=tmp_path):
            wait_until(lambda: not any(path.exists() for path in left))
        assert not [path for path in left if memory_with(path).exists()]
        assert all(path.exists() and memory_with(path).exists() for path in live)
    finally:
        node.destroy_node()
        context.shutdown()
        lock.close()


def _open_files() -> str:
    """The files that this process has open."""
    found = []
    for descriptor in Path("/proc/self/fd").iterdir():
        try:
            found.append(str(descriptor.readlink()))
        except OSError:
            continue  # that of this search itself
    return " ".join(found)


@pytest.mark.parametrize("suffix", ["_el", "_sl"])
@pytest.mark.parametrize("name", [SEGMENT, "fastrtps_port7000"])
def test_what_no_process_locks_is_removed(tmp_path: Path, name: str, suffix: str) -> None:
    memory_of(tmp_path, name, suffix)
    assert remove_abandoned(tmp_path) == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", ["_el", "_sl"])
@pytest.mark.parametrize("kind", [fcntl.LOCK_EX, fcntl.LOCK_SH])
def test_what_one_of_its_locks_holds_stays(tmp_path: Path, suffix: str, kind: int) -> None:
    made = {*memory_of(tmp_path, SEGMENT, "_el"), *memory_of(tmp_path, SEGMENT, "_sl")}
    with (tmp_path / f"{SEGMENT}{suffix}").open() as file:
        fcntl.flock(file, kind)
        assert remove_abandoned(tmp_path) == 0
        assert set(tmp_path.iterdir()) == made
    assert remove_abandoned(tmp_path) == 1


def test_what_is_being_made_stays(tmp_path: Path) -> None:
    """Between the making of a lock file and its locking."""
    made = memory_of(tmp_path, SEGMENT, age_s=5.0)
    assert remove_abandoned(tmp_path) == 0
    assert all(path.exists() for path in made)


def test_what_has_been_made_anew_meanwhile_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The lock that was taken is then of a file without a name."""
    memory, lock = memory_of(tmp_path, SEGMENT)

    def replace(_descriptor: int, _operation: int) -> None:
        lock.rename(tmp_path / "old")
        of_age(lock)

    monkeypatch.setattr(fcntl, "flock", replace)
    assert remove_abandoned(tmp_path) == 0
    assert memory.exists()
    assert lock.exists()


def test_what_another_user_has_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = memory_of(tmp_path, SEGMENT)
    monkeypatch.setattr(os, "getuid", lambda: made[0].stat().st_uid + 1)
    assert remove_abandoned(tmp_path) == 0
    assert all(path.exists() for path in made)


def test_a_link_is_not_followed_and_a_fifo_not_waited_for(tmp_path: Path) -> None:
    """Either would be a node that does not start, or a file elsewhere that is locked."""
    memory = tmp_path / SEGMENT
    of_age(memory)
    elsewhere = of_age(tmp_path / "elsewhere")
    lock = tmp_path / f"{SEGMENT}_el"
    lock.symlink_to(elsewhere)
    assert remove_abandoned(tmp_path) == 0
    assert memory.exists()
    lock.unlink()
    os.mkfifo(lock)
    remove_abandoned(tmp_path)
    assert elsewhere.exists()


def test_files_of_other_programs_stay(tmp_path: Path) -> None:
    """Also the mutex of a port, for which another process may wait."""
    names = (
        "sem.fastrtps_port7000_mutex",
        "lttng-ust-wait-6",
        "fastrtps_0123_el",
        f"{SEGMENT}_el.bak",
        f"my_{SEGMENT}_el",
        "fastrtps_port_el",
    )
    made = {of_age(tmp_path / name) for name in names}
    assert remove_abandoned(tmp_path) == 0
    assert set(tmp_path.iterdir()) == made


def test_a_directory_that_is_missing_holds_nothing(tmp_path: Path) -> None:
    assert remove_abandoned(tmp_path / "none") == 0


def test_memory_is_full_only_without_what_is_abandoned(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    memory, _ = memory_of(tmp_path, SEGMENT)
    status = list(os.statvfs(tmp_path))

    def statvfs(_path: Path) -> os.statvfs_result:
        status[1], status[2], status[4] = 4096, 1024, 15 if memory.exists() else 16
        return os.statvfs_result(status)

    monkeypatch.setattr(os, "statvfs", statvfs)
    require_shared_memory(tmp_path)
    assert not memory.exists()
