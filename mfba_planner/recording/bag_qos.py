# SPDX-License-Identifier: Apache-2.0
"""Offered QoS profiles as plain data, and in rosbag2's YAML."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import yaml

from ..core.errors import BagError
from . import yaml_text

INFINITE_NS = 2**63 - 1
_NS_PER_S = 1_000_000_000

# rmw's enumerations by number: metadata.yaml before version 9 holds the numbers.
HISTORY = ("system_default", "keep_last", "keep_all", "unknown")
RELIABILITY = ("system_default", "reliable", "best_effort", "unknown", "best_available")
DURABILITY = ("system_default", "transient_local", "volatile", "unknown", "best_available")
LIVELINESS = (
    "system_default",
    "automatic",
    "manual_by_node",
    "manual_by_topic",
    "unknown",
    "best_available",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class OfferedQos:
    """One publisher's QoS with rosbag2's names; durations in ns, INFINITE_NS for none."""

    history: str = "keep_last"
    depth: int = 10
    reliability: str = "reliable"
    durability: str = "volatile"
    deadline_ns: int = INFINITE_NS
    lifespan_ns: int = INFINITE_NS
    liveliness: str = "automatic"
    liveliness_lease_duration_ns: int = INFINITE_NS
    avoid_ros_namespace_conventions: bool = False


def to_list(profiles: Iterable[OfferedQos]) -> list[dict[str, Any]]:
    """The YAML list of metadata.yaml version 9, keys in rosbag2's sequence."""
    return [
        {
            "history": qos.history,
            "depth": qos.depth,
            "reliability": qos.reliability,
            "durability": qos.durability,
            "deadline": _to_time(qos.deadline_ns),
            "lifespan": _to_time(qos.lifespan_ns),
            "liveliness": qos.liveliness,
            "liveliness_lease_duration": _to_time(qos.liveliness_lease_duration_ns),
            "avoid_ros_namespace_conventions": qos.avoid_ros_namespace_conventions,
        }
        for qos in profiles
    ]


def to_text(profiles: Iterable[OfferedQos]) -> str:
    """The same list as YAML text, the form in an MCAP channel's metadata."""
    return yaml_text.dump(to_list(profiles))


def from_list(value: object) -> tuple[OfferedQos, ...]:
    """Profiles of a YAML list, or of its text; names or rmw's numbers. Raises BagError."""
    try:
        items: Any = yaml_text.load(value) if isinstance(value, str) else value
        return tuple(_from_item(item) for item in items or ())
    except (yaml.YAMLError, TypeError, KeyError, ValueError, IndexError) as error:
        shown = " ".join(str(value).split())[:60]
        raise BagError(
            f"offered_qos_profiles {shown!r}: not a list of QoS profiles "
            f"({type(error).__name__}); record the bag again or edit its metadata.yaml"
        ) from error


def _from_item(item: Mapping[str, Any]) -> OfferedQos:
    return OfferedQos(
        history=_word(item["history"], HISTORY),
        depth=int(item["depth"]),
        reliability=_word(item["reliability"], RELIABILITY),
        durability=_word(item["durability"], DURABILITY),
        deadline_ns=_from_time(item["deadline"]),
        lifespan_ns=_from_time(item["lifespan"]),
        liveliness=_word(item["liveliness"], LIVELINESS),
        liveliness_lease_duration_ns=_from_time(item["liveliness_lease_duration"]),
        avoid_ros_namespace_conventions=bool(item["avoid_ros_namespace_conventions"]),
    )


def _word(value: object, words: tuple[str, ...]) -> str:
    if isinstance(value, int) and 0 <= value < len(words):
        return words[value]
    if value in words:
        return str(value)
    raise ValueError(f"{value!r} is none of {words}")


def _to_time(total_ns: int) -> dict[str, int]:
    return {"sec": total_ns // _NS_PER_S, "nsec": total_ns % _NS_PER_S}


def _from_time(item: Mapping[str, Any]) -> int:
    # Like rosbag2: more than 2**63-1 ns means infinite.
    return min(int(item["sec"]) * _NS_PER_S + int(item["nsec"]), INFINITE_NS)
