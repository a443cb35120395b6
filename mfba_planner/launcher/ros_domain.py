# SPDX-License-Identifier: Apache-2.0
"""A private ROS domain: a free domain id, locked, with discovery on this machine only."""

from __future__ import annotations

import itertools
import os
import socket
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from ..core.errors import GraphError
from ..core.shipped_files import config_path
from .ros_environment import ignored_settings, private_environment, require_isolating_middleware

# Domains above 101 map to ports that Linux gives to any program. Each process starts its search
# at another id and goes round, so that a domain is not reused at once.
DOMAINS = range(1, 102)
FIRST_PORT, PORTS = 7400, 250  # first port of domain 0, ports per domain: RTPS port mapping
_next_domains = itertools.islice(itertools.cycle(DOMAINS), os.getpid() % len(DOMAINS), None)


def claim_domain() -> tuple[int, socket.socket]:
    """Return a ROS domain id that is free, and the lock to close after use.

    The lock is an abstract socket: the system drops it even after kill -9. A domain that other
    ROS programs of this machine use is skipped. Raises GraphError when every domain is taken.
    """
    occupied = _occupied_domains()
    for domain in itertools.islice(_next_domains, len(DOMAINS)):
        if domain in occupied:
            continue
        lock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            lock.bind(f"\0mfba_planner_domain_{domain}")
        except OSError:
            lock.close()
        else:
            return domain, lock
    raise GraphError(f"all {len(DOMAINS)} ROS domains are taken; end other runs first")


def _occupied_domains() -> set[int]:
    """Domains with an open port in this network namespace, of any DDS implementation."""
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
    """Raise GraphError when the loopback interface is down: no node would find another."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((address, 9))
        except OSError as error:
            raise GraphError(
                f"{address}: {error.strerror}, so the nodes cannot communicate; "
                "bring the loopback interface up (ip link set lo up)"
            ) from None


def _print_note(text: str) -> None:
    print(text, file=sys.stderr)


@contextmanager
def private_domain(note: Callable[[str], None] = _print_note) -> Iterator[int]:
    """Claim a domain, and set it for this process and its children; discovery is local only.

    Settings that could undo this are not in force meanwhile, and are named to note() in one
    line: a simulated run must not command a robot. Raises GraphError for middleware that cannot
    be isolated.
    """
    require_isolating_middleware()
    require_network()
    if ignored := ignored_settings():
        note(f"ignored, since a run is private: {', '.join(ignored)}")
    domain, lock = claim_domain()
    variables = {
        "ROS_DOMAIN_ID": str(domain),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        # The name that these versions of Fast DDS read.
        "FASTRTPS_DEFAULT_PROFILES_FILE": str(config_path("private_discovery.xml")),
    }
    with lock, private_environment(variables):
        yield domain
