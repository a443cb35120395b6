# SPDX-License-Identifier: Apache-2.0
"""The rooms of the package and who imports whom, read from the sources; and the picture of it.

    python tools/import_graph.py            # print the arrows between rooms
    python tools/import_graph.py --write    # write docs/images/rooms.svg

An arrow points from the room that imports to the room that is imported. ROOMS is the one list of
rooms: a room may import those before it. test/test_package.py holds sources and picture to it.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator, Mapping
from functools import cache
from html import escape
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "mfba_planner"
PICTURE = ROOT / "docs" / "images" / "rooms.svg"

# From the ground up: what a room is for, in the few words that fit into its box.
ROOMS: Mapping[str, tuple[str, str]] = {
    "core": ("errors, geometry, options,", "types, random streams"),
    "swarm": ("BA and MFBA", "(eq. 3-10)"),
    "optimizers": ("others by name:", "adapters of libraries"),
    "perception": ("sensory vector (eq. 11),", "tracker, memory"),
    "planning": ("Algorithm 1 (eq. 12, 13),", "predictive planner, peers"),
    "simulation": ("obstacles, robot, sensors,", "contact, Episode"),
    "scenarios": ("scenario files,", "run configurations"),
    "evaluation": ("metrics, oracle, suites,", "sweeps, studies"),
    "paper": ("printed numbers, readings,", "reproduced tables"),
    "recording": ("MCAP bags: write, read,", "recover"),
    "verification": ("a bag's decisions again,", "compared"),
    "report": ("tables, figures, pages,", "animations"),
    "ros": ("nodes, topics, QoS,", "executor, replay"),
    "launcher": ("one run under any driver,", "processes, launch files"),
    "cli": ("mfba COMMAND", ""),
}
# Inside ros, from the ground up too.
ROS_ROOMS = ("interface", "runtime", "endpoints", "replaying", "nodes")

BOX_W, BOX_H, GAP_X, GAP_Y, MARGIN = 172, 58, 18, 40, 14


@cache
def tree_of(path: Path) -> ast.Module:
    """A source file, parsed."""
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


def imports_of(path: Path) -> Iterator[str]:
    """Every module or attribute that a file names in an import, absolute, lazy ones included."""
    package = path.relative_to(ROOT).parent.parts
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) + 1 - node.level] if node.level else ()
            module = ".".join((*base, *filter(None, [node.module])))
            yield from (f"{module}.{alias.name}" for alias in node.names)


def modules() -> dict[str, Path]:
    """The package's modules by dotted name; a package is its __init__."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def module_graph() -> dict[str, set[str]]:
    """What each module imports of the package: modules by dotted name."""
    known = modules()
    graph: dict[str, set[str]] = {}
    for name, path in known.items():
        graph[name] = set()
        for imported in imports_of(path):
            target = imported if imported in known else imported.rpartition(".")[0]
            if target in known and target not in (name, PACKAGE.name):
                graph[name].add(target)
    return graph


def room_of(module: str) -> str:
    """The room of a module, "" for the package's own files."""
    parts = module.split(".")
    return parts[1] if len(parts) > 1 and parts[1] in ROOMS else ""


def arrows() -> set[tuple[str, str]]:
    """Pairs (room that imports, room that is imported)."""
    pairs = {(room_of(m), room_of(n)) for m, imported in module_graph().items() for n in imported}
    return {(a, b) for a, b in pairs if a and b and a != b}


def direct(pairs: set[tuple[str, str]]) -> set[tuple[str, str]]:
    """The pairs that do not follow from others: the transitive reduction."""
    rooms = {room for pair in pairs for room in pair}
    below: dict[str, set[str]] = {room: {b for a, b in pairs if a == room} for room in rooms}

    def reach(room: str) -> set[str]:
        return below[room].union(*(reach(b) for b in below[room]))

    return {(a, b) for a, b in pairs if not any(b in reach(c) for c in below[a] - {b})}


def levels(pairs: set[tuple[str, str]]) -> list[list[str]]:
    """Rooms by how many rooms lie below them at most, the ground first."""
    height: dict[str, int] = {}
    for room in ROOMS:
        height[room] = max((height[b] + 1 for a, b in pairs if a == room), default=0)
    return [[r for r in ROOMS if height[r] == h] for h in range(max(height.values()) + 1)]


def svg() -> str:
    """The picture: a box per room, an arrow per direct import, the ground at the bottom."""
    pairs = arrows()
    rows = levels(pairs)[::-1]
    widest = max(map(len, rows))
    width = 2 * MARGIN + widest * BOX_W + (widest - 1) * GAP_X
    height = 2 * MARGIN + len(rows) * BOX_H + (len(rows) - 1) * GAP_Y
    left_top = {}
    for k, row in enumerate(rows):
        indent = (width - len(row) * BOX_W - (len(row) - 1) * GAP_X) / 2
        for i, room in enumerate(row):
            left_top[room] = (indent + i * (BOX_W + GAP_X), MARGIN + k * (BOX_H + GAP_Y))
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        f'width="{width}" height="{height}" font-family="sans-serif">',
        "<title>Rooms of mfba_planner and their imports</title>",
        '<defs><marker id="tip" markerWidth="9" markerHeight="8" refX="8" refY="4" '
        'orient="auto"><path d="M0,0 L9,4 L0,8 z" fill="#5a6472"/></marker></defs>',
        f'<rect width="{width}" height="{height}" fill="#ffffff"/>',
    ]
    for a, b in sorted(direct(pairs)):
        (ax, ay), (bx, by) = left_top[a], left_top[b]
        x0, y0, x1, y1 = ax + BOX_W / 2, ay + BOX_H, bx + BOX_W / 2, by
        # Across first, then down: beside the boxes of the rows between.
        turn = y0 + GAP_Y * 0.8
        lines.append(
            f'<path d="M{x0:g},{y0:g} C{x0:g},{y0 + GAP_Y * 0.6:g} {x1:g},{turn - GAP_Y * 0.5:g} '
            f'{x1:g},{turn:g} L{x1:g},{y1:g}" '
            'fill="none" stroke="#5a6472" stroke-width="1.3" marker-end="url(#tip)"/>'
        )
    for room, (x, y) in left_top.items():
        lines.append(
            f'<rect x="{x:g}" y="{y:g}" width="{BOX_W}" height="{BOX_H}" rx="7" '
            'fill="#eef3f8" stroke="#2f5d8a" stroke-width="1.2"/>'
        )
        texts = [(room, 17, 15, "600"), *((t, 34 + 14 * i, 11, "400") for i, t in
                 enumerate(filter(None, ROOMS[room])))]  # fmt: skip
        for text, dy, size, weight in texts:
            lines.append(
                f'<text x="{x + BOX_W / 2:g}" y="{y + dy + 3:g}" font-size="{size}" '
                f'font-weight="{weight}" text-anchor="middle" fill="#1d2733">{escape(text)}</text>'
            )
    return "\n".join([*lines, "</svg>", ""])


def main(args: list[str]) -> int:
    """Print the arrows, or write the picture."""
    if args == ["--write"]:
        PICTURE.write_text(svg(), encoding="utf-8")
        print(f"wrote {PICTURE.relative_to(ROOT)}")
        return 0
    pairs = arrows()
    for room in ROOMS:
        print(f"{room:13s} -> {', '.join(b for b in ROOMS if (room, b) in pairs) or '-'}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
