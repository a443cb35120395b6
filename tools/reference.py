# SPDX-License-Identifier: Apache-2.0
"""Write docs/reference and config/planner.yaml from the code that declares what they list.

    python tools/reference.py            # check: name the files that are out of date, exit 1
    python tools/reference.py --write    # write them

The pages list commands, topics, services, parameters and scenario keys. `make docs` writes them
too. Sentences around the tables are in reference_text.py.
"""

from __future__ import annotations

import io
import json
import os
import sys
from collections.abc import Callable, Iterable
from contextlib import redirect_stdout, suppress
from enum import Enum
from pathlib import Path
from typing import Any

from reference_text import PARAMETERS_TEXT, SERVICES, SERVICES_TEXT, TOPICS_TEXT, YAML_HEAD

from mfba_planner import cli
from mfba_planner.core.option_specs import walk
from mfba_planner.planning.planner_factory import DEFAULT_METHOD
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.ros import node_help
from mfba_planner.ros.interface import topics
from mfba_planner.scenarios import yaml_schema

ROOT = Path(__file__).resolve().parent.parent
PAGES_FOLDER = ROOT / "docs/reference"
YAML = ROOT / "config/planner.yaml"
# Values in config/planner.yaml that differ from the defaults: for a robot with a lidar.
ROBOT_NODES = ("virtual_sensor", "planner")
ROBOT: dict[str, dict[str, Any]] = {
    "*": {"input_timeout_s": 0.25},  # of both nodes
    "virtual_sensor": {"source": "scan"},
    "planner": {
        "speed_mps": 0.5,
        "step_length_m": 0.05,  # one decision per 0.1 s
        "goal_tolerance_m": 0.1,
        "method": DEFAULT_METHOD.value,
        "bat.iterations": preset().bat.iterations,
        "recovery.enabled": True,
    },
}
NODES = node_help.PARAMETERS


def topics_page() -> str:
    """Every topic of the graph, then frames, sectors and time."""
    return TOPICS_TEXT.format(table=topic_table()).rstrip()


def topic_table() -> str:
    """Every topic: name, type, publishers, subscribers, QoS."""
    rows = []
    for topic in topics.GRAPH:
        if topic in topics.TRANSFORMS:
            continue  # only where tf2_msgs is installed: mentioned in TOPICS_TEXT
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


def services_page() -> str:
    """Every service: name, type, node, effect."""
    rows = ((f"`{node}/{name}`", kind, node, effect) for node, name, kind, effect in SERVICES)
    table = _table(("service", "type", "node", "what it does"), rows)
    return SERVICES_TEXT.format(table=table).rstrip()


def parameter_tables() -> str:
    """Every parameter of every node: name, default, range, meaning, unit."""
    sections = []
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
        sections.append(f"## {node}\n\n{table}")
    return "\n\n".join(sections)


def parameters_page() -> str:
    """Every parameter, node by node, and how to set it."""
    return PARAMETERS_TEXT.format(tables=parameter_tables()).rstrip()


def planner_yaml() -> str:
    """config/planner.yaml: all parameters; those with their default value are commented out."""
    options = {
        node: {item[0]: item for defaults in NODES[node] for item in walk(defaults)}
        for node in ROBOT_NODES
    }
    first, second = options.values()
    both = {name: item for name, item in first.items() if name in second}
    lines = [YAML_HEAD.rstrip(), "", "/**:", "  ros__parameters:", *_lines(both, ROBOT["*"])]
    for node, declared in options.items():
        own = {name: item for name, item in declared.items() if name not in both}
        lines += ["", f"/**/{node}:", "  ros__parameters:", *_lines(own, ROBOT[node])]
    return "\n".join(lines) + "\n"


def _lines(options: dict[str, Any], changed: dict[str, Any]) -> Iterable[str]:
    """The lines of a YAML section; values that are not changed are commented out."""
    for name, value, item in options.values():
        spec, shown = item.metadata["spec"], getattr(value, "value", value)
        choices = [str(m.value) for m in type(value)] if isinstance(value, Enum) else []
        allowed = " | ".join(choices) or _range(spec)
        about = [spec.doc, *(f"[{x}]" for x in (spec.unit, allowed) if x)]
        yield f"    # {' '.join(about)}"
        mark = "" if name in changed else "# "
        yield f"    {mark}{name}: {json.dumps(changed.get(name, shown))}"


def _range(spec: Any) -> str:
    if spec.minimum is None and spec.maximum is None:
        return ""
    return " … ".join("" if x is None else f"{x:g}" for x in (spec.minimum, spec.maximum))


def _rows(defaults: Any) -> Iterable[tuple[str, ...]]:
    for name, value, item in walk(defaults):
        spec = item.metadata["spec"]
        if isinstance(value, Enum):
            allowed = " \\| ".join(str(member.value) for member in type(value))
        else:
            allowed = _range(spec)
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
    """The --help text of `mfba` and of each command."""
    sections = [f"```text\n{_help([])}```"]
    for name in sorted(cli.COMMANDS):
        sections.append(f"## mfba {name}\n\n```text\n{_help([name])}```")
    return "\n\n".join(sections)


def _help(command: list[str]) -> str:
    output = io.StringIO()
    os.environ["COLUMNS"] = "96"  # independent of the terminal
    with redirect_stdout(output), suppress(SystemExit):
        cli.main([*command, "--help"])
    return output.getvalue()


def scenario_keys() -> str:
    """Every key of a scenario file: type and range, default, meaning."""
    schema = yaml_schema.schema()
    sections = [("The file", schema), *sorted(schema["$defs"].items())]
    return "\n\n".join(f"## {_title(name)}\n\n{_keys(keys)}" for name, keys in sections)


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
    return _table(("key", "default", "type and range", "meaning"), rows)


def _default(value: Any) -> str:
    return "none" if value in (None, [], "") else str(value)


def _allowed(entry: dict[str, Any]) -> str:
    """A JSON schema's type in words."""
    if "$ref" in entry:
        return _title(entry["$ref"].rpartition("/")[2])
    if "anyOf" in entry:  # optional
        return next(_allowed(kind) for kind in entry["anyOf"] if kind.get("type") != "null")
    if entry["type"] == "array":
        if "prefixItems" in entry:
            shapes = {2: "[x, y]", 3: "[t, x, y]", 4: "[x0, y0, x1, y1]"}
            return shapes[len(entry["prefixItems"])]
        return f"list of {_allowed(entry['items'])}"
    if entry["type"] == "number":
        low = f"> {entry['exclusiveMinimum']:g}" if "exclusiveMinimum" in entry else ""
        low = low or (f">= {entry['minimum']:g}" if "minimum" in entry else "")
        high = f"<= {entry['maximum']:g}" if "maximum" in entry else ""
        return ", ".join(["number", *filter(None, (low, high))])
    if entry["type"] == "object":
        return "mapping"
    return {"string": "text"}.get(entry["type"], str(entry["type"]))


# File name: title, audience and purpose, content.
PAGES: dict[str, tuple[str, str, Callable[[], str]]] = {
    "cli": (
        "The command mfba",
        "For users of the command line: every command with its arguments and options. "
        "A mistake prints one line and exits with code 1.",
        command_help,
    ),
    "topics": (
        "Topics",
        "For developers who connect other nodes: every topic with type and QoS, the frames, and "
        "the two kinds of time.",
        topics_page,
    ),
    "services": (
        "Services",
        "For developers who control the nodes from outside: every service, its type and effect.",
        services_page,
    ),
    "parameters": (
        "Parameters of the nodes",
        "For users who configure the nodes: every parameter with default, range, meaning, unit.",
        parameters_page,
    ),
    "scenario": (
        "Keys of a scenario file",
        "For authors of scenarios: every key with its range, in YAML or JSON. Units are metres, "
        "seconds, and degrees where a name ends in `_deg`.",
        scenario_keys,
    ),
}


def page(name: str) -> str:
    """The whole text of docs/reference/NAME.md."""
    title, audience, content = PAGES[name]
    note = "<!-- Generated by tools/reference.py. Do not edit. -->"
    return f"# {title}\n\n{note}\n\n*{audience}*\n\n{content()}\n"


def write_pages(folder: Path) -> None:
    """Write docs/reference, one page of Markdown each."""
    folder.mkdir(exist_ok=True)
    for name in PAGES:
        (folder / f"{name}.md").write_text(page(name), encoding="utf-8")


def generated() -> dict[Path, str]:
    """Every generated file with the text that it must hold."""
    return {
        YAML: planner_yaml(),
        **{PAGES_FOLDER / f"{name}.md": page(name) for name in PAGES},
    }


def main(arguments: list[str]) -> int:
    """Check, or write with --write; return the exit code."""
    write = "--write" in arguments
    stale = [(path, text) for path, text in generated().items() if not _holds(path, text)]
    for path, text in stale:
        if write:
            path.parent.mkdir(exist_ok=True)
            path.write_text(text, encoding="utf-8")
        else:
            name = path.relative_to(ROOT)
            print(f"{name}: out of date; run `python tools/reference.py --write`")
    return int(bool(stale) and not write)


def _holds(path: Path, text: str) -> bool:
    return path.exists() and path.read_text(encoding="utf-8") == text


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
