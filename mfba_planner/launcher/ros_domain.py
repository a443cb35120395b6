# SPDX-License-Identifier: Apache-2.0
"""A ROS domain of one's own: nobody else is in it, nobody off this machine hears."""

from __future__ import annotations

import itertools
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..core.errors import GraphError

# Domains above 101 map to ports that Linux hands out to any program. Each process starts
# elsewhere and goes round, so that a domain rests after use.
DOMAINS = range(1, 102)
FIRST_PORT, PORTS = 7400, 250  # of domain 0, and of every domain: RTPS's port mapping
_candidates = itertools.islice(itertools.cycle(DOMAINS), os.getpid() % len(DOMAINS), None)


def claim_domain() -> tuple[int, socket.socket]:
    """Return a ROS domain id that no other holder has, and the lock to close after use.

    The lock is an abstract socket: the system drops it even after kill -9. A domain that other
    programs of this machine talk in, a robot's perhaps, is passed over. Raises GraphError when
    every domain is taken.
    """
    strange = _inhabited()
    for domain in itertools.islice(_candidates, len(DOMAINS)):
        if domain in strange:
            continue
        lock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            lock.bind(f"\0mfba_planner_domain_{domain}")
        except OSError:
            lock.close()
        else:
            return domain, lock
    raise GraphError(f"all {len(DOMAINS)} ROS domains are taken; end other runs first")


def _inhabited() -> set[int]:
    """Domains whose ports are listened on in this network namespace, by whatever DDS."""
    found: set[int] = set()
    for table in ("udp", "udp6"):
        try:
            lines = Path("/proc/net", table).read_text(encoding="ascii").splitlines()[1:]
        except OSError:
            continue  # a kernel without IPv6
        ports = (int(line.split()[1].rpartition(":")[2], 16) for line in lines)
        found.update((port - FIRST_PORT) // PORTS for port in ports)
    return found


def require_network(address: str = "127.0.0.1") -> None:
    """Raise GraphError when not even this machine can be reached: no node would find another."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((address, 9))
        except OSError as error:
            raise GraphError(
                f"{address}: {error.strerror}, so the nodes cannot talk; "
                "bring the loopback interface up (ip link set lo up)"
            ) from None


@contextmanager
def private_domain() -> Iterator[int]:
    """Hold a domain, and keep this process and its children to it and to this machine."""
    require_network()
    domain, lock = claim_domain()
    ours = {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    theirs = {name: os.environ.get(name) for name in ours}
    os.environ.update(ours)
    with lock:
        try:
            yield domain
        finally:
            for name, value in theirs.items():
                if value is None:
                    del os.environ[name]
                else:
                    os.environ[name] = value
