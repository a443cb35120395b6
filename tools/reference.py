# SPDX-License-Identifier: Apache-2.0
"""The README's tables of topics and parameters, from the code that declares them.

`python tools/reference.py` says whether README.md is up to date (exit 1 if not);
`python tools/reference.py --write` brings it up to date.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable
from enum import Enum
from pathlib import Path
from typing import Any

from mfba_planner import node_settings as settings
from mfba_planner.core.options import walk
from mfba_planner.core.planner import PlannerParams
from mfba_planner.core.sensing import SensorParams
from mfba_planner.ros import topics

README = Path(__file__).resolve().parent.parent / "README.md"

NODES: dict[str, tuple[Any, ...]] = {
    "planner": (settings.PlannerSettings(), PlannerParams()),
    "virtual_sensor": (settings.VirtualSensorSettings(), SensorParams()),
    "world_sim": (settings.WorldSimSettings(),),
    "recorder": (settings.RecorderSettings(),),
}


def topic_table() -> str:
    """Every topic of the graph: name, type, from, to, QoS."""
    rows = []
    for topic in topics.GRAPH:
        if topic is topics.TF:
            continue  # only where tf2_msgs is installed: the README's sentence says so
        package = topic.type.__module__.split(".")[0]
        latched = topic.qos.durability.short_key == "transient_local"
        rows.append(
            (
                f"`{topic.name}`",
                f"{package}/{topic.type.__name__}",
                ", ".join(topic.writers) or "you",
                ", ".join(topic.readers) or "viewers",
                f"reliable{', latched' if latched else ''}, {topic.qos.depth}",
                "yes" if topic.every_tick else "",
            )
        )
    return _table(("topic", "type", "from", "to", "QoS, depth", "every tick"), rows)


def parameter_tables() -> str:
    """Every parameter of every node: name, default, range, meaning."""
    parts = []
    for node, declared in NODES.items():
        rows = [row for defaults in declared for row in _rows(defaults)]
        if node == "virtual_sensor":
            rows.append(
                (
                    "`obstacle_radii_m`",
                    "[0.3]",
                    "> 0",
                    "radius per obstacle; one stands for all",
                    "m",
                )
            )
        table = _table(("parameter", "default", "range", "meaning", "unit"), rows)
        parts.append(f"#### {node}\n\n{table}")
    return "\n\n".join(parts)


def _rows(defaults: Any) -> Iterable[tuple[str, ...]]:
    for name, value, item in walk(defaults):
        spec = item.metadata["spec"]
        if isinstance(value, Enum):
            allowed = " \\| ".join(str(member.value) for member in type(value))
        elif spec.minimum is None and spec.maximum is None:
            allowed = ""
        else:
            low = "" if spec.minimum is None else f"{spec.minimum:g}"
            high = "" if spec.maximum is None else f"{spec.maximum:g}"
            allowed = f"{low} … {high}"
        shown = value.value if isinstance(value, Enum) else value
        text = {True: "true", False: "false", "": "(empty)"}.get(shown, str(shown))
        yield (
            f"`{name}`",
            text if isinstance(shown, bool | str) else str(shown),
            allowed,
            spec.doc,
            spec.unit,
        )


def _table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [head, tuple("---" for _ in head), *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def updated(text: str) -> str:
    """The README's text with its generated parts made anew."""
    for name, content in (("topics", topic_table()), ("parameters", parameter_tables())):
        begin, end = f"<!-- begin generated: {name} -->", f"<!-- end generated: {name} -->"
        pattern = re.compile(re.escape(begin) + ".*?" + re.escape(end), re.DOTALL)
        if not pattern.search(text):
            raise SystemExit(f"README.md: lacks {begin} ... {end}; put them back")
        text = pattern.sub((f"{begin}\n{content}\n{end}").replace("\\", r"\\"), text)
    return text


def main() -> int:
    """Check or write."""
    old = README.read_text(encoding="utf-8")
    new = updated(old)
    if "--write" in sys.argv[1:]:
        README.write_text(new, encoding="utf-8")
        return 0
    if old != new:
        print("README.md: tables out of date; run `python tools/reference.py --write`")
    return int(old != new)


if __name__ == "__main__":
    raise SystemExit(main())
