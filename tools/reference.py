# SPDX-License-Identifier: Apache-2.0
"""What there is to look up, from the code that declares it.

Topics stand in the README too: `python tools/reference.py` says whether it is up to date (exit 1
if not), `python tools/reference.py --write` brings it up to date. The pages of docs/reference are
written by `make docs` and not kept.
"""

from __future__ import annotations

import io
import os
import re
import sys
from collections.abc import Callable, Iterable
from contextlib import redirect_stdout, suppress
from enum import Enum
from pathlib import Path
from typing import Any

from mfba_planner import cli, scenario_model
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


def command_help() -> str:
    """What `mfba` and each of its commands say to --help."""
    parts = [f"```text\n{_help([])}```"]
    for name in sorted(cli.COMMANDS):
        parts.append(f"## mfba {name}\n\n```text\n{_help([name])}```")
    return "\n\n".join(parts)


def _help(command: list[str]) -> str:
    said = io.StringIO()
    os.environ["COLUMNS"] = "96"  # whatever the terminal
    with redirect_stdout(said), suppress(SystemExit):
        cli.main([*command, "--help"])
    return said.getvalue()


def scenario_keys() -> str:
    """Every key of a scenario file: type and range, default, meaning."""
    schema = scenario_model.schema()
    parts = [("The file", schema), *sorted(schema["$defs"].items())]
    return "\n\n".join(f"## {_title(name)}\n\n{_keys(part)}" for name, part in parts)


def _title(name: str) -> str:
    return name.strip("_")


def _keys(schema: dict[str, Any]) -> str:
    required = schema.get("required", [])
    rows = (
        (
            f"`{name}`",
            "required" if name in required else _default(entry.get("default")),
            _allowed(entry),
            entry["description"],
        )
        for name, entry in schema["properties"].items()
    )
    return _table(("key", "default", "what it may be", "meaning"), rows)


def _default(value: Any) -> str:
    return "none" if value in (None, [], "") else str(value)


def _allowed(entry: dict[str, Any]) -> str:
    """A JSON schema's type in words."""
    if "$ref" in entry:
        return _title(entry["$ref"].rpartition("/")[2])
    if "anyOf" in entry:  # a thing or nothing
        return next(_allowed(one) for one in entry["anyOf"] if one.get("type") != "null")
    if entry["type"] == "array":
        if "prefixItems" in entry:
            return "[x, y]"
        return f"list of {_allowed(entry['items'])}"
    if entry["type"] == "number":
        low = f"> {entry['exclusiveMinimum']:g}" if "exclusiveMinimum" in entry else ""
        low = low or (f">= {entry['minimum']:g}" if "minimum" in entry else "")
        high = f"<= {entry['maximum']:g}" if "maximum" in entry else ""
        return ", ".join(["number", *filter(None, (low, high))])
    return {"string": "text"}.get(entry["type"], str(entry["type"]))


PAGES: dict[str, tuple[str, str, Callable[[], str]]] = {
    "cli": ("The command mfba", "Mistakes cost one line and exit code 1.", command_help),
    "topics": (
        "Topics",
        "All names are relative to the namespace, but for those that begin with a slash.",
        topic_table,
    ),
    "parameters": (
        "Parameters of the nodes",
        "`ros2 param describe` shows the same; `mfba run --set planner.NAME=VALUE` sets them.",
        parameter_tables,
    ),
    "scenario": (
        "Keys of a scenario file",
        "YAML or JSON; metres, seconds, and degrees where a name ends in `_deg`.",
        scenario_keys,
    ),
}


def write_pages(folder: Path) -> None:
    """Write docs/reference, one page of Markdown each."""
    folder.mkdir(exist_ok=True)
    for name, (title, about, content) in PAGES.items():
        body = content().replace("\n#### ", "\n## ").removeprefix("#### ")
        body = f"## {body}" if name == "parameters" else body
        text = f"# {title}\n\n{about}\n\n{body}\n"
        (folder / f"{name}.md").write_text(text, encoding="utf-8")


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
