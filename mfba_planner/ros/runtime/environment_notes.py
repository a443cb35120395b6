# SPDX-License-Identifier: Apache-2.0
"""What a node logs of its environment at start: settings with which it runs, but not as meant."""

from __future__ import annotations

import os
import re
from pathlib import Path

from ..shared_memory import SHARED_MEMORY

# RTPS port mapping: first port of domain 0, ports per domain.
_FIRST_PORT, _PORTS = 7400, 250


def environment_notes(domain_id: int, shared_memory: Path = SHARED_MEMORY) -> list[str]:
    """One line each, with the remedy; empty where nothing is to be said."""
    notes = []
    distribution = os.environ.get("ROS_DISTRO", "jazzy")
    if distribution != "jazzy":
        notes.append(
            f"ROS_DISTRO={distribution}: this package is made and tested for jazzy; "
            "source a jazzy workspace, or no other"
        )
    # rcl compares both by letter.
    enabled = os.environ.get("ROS_SECURITY_ENABLE") == "true"
    if enabled and os.environ.get("ROS_SECURITY_STRATEGY") != "Enforce":
        notes.append(
            "ROS_SECURITY_ENABLE=true: a node whose keys are missing runs unprotected; "
            "set ROS_SECURITY_STRATEGY=Enforce"
        )
    port = _port_of_another_user(domain_id, shared_memory)
    if port is not None:
        notes.append(
            f"{port}: of another user, whose nodes' messages may not arrive; run all nodes as one "
            "user, or remove what ended nodes have left (`fastdds shm clean`)"
        )
    return notes


def _port_of_another_user(domain_id: int, shared_memory: Path) -> Path | None:
    """A port of Fast DDS in this domain that another user has opened, or left."""
    first = _FIRST_PORT + _PORTS * domain_id
    for path in sorted(shared_memory.glob("fastrtps_port*")):
        number = re.fullmatch(r"fastrtps_port(\d+)", path.name)
        if number is None or not first <= int(number[1]) < first + _PORTS:
            continue
        try:
            if path.stat().st_uid != os.geteuid():
                return path
        except OSError:
            continue  # it has been removed in the meantime
    return None
