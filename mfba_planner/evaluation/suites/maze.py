# SPDX-License-Identifier: Apache-2.0
"""Mazes on a grid of square cells: a random spanning tree by depth-first search, and openings."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

Cell = tuple[int, int]  # column, row
Wall = tuple[int, int, int, int]  # corners x0, y0, x1, y1 of the grid, in cells


def maze_walls(columns: int, rows: int, openings: int, rng: np.random.Generator) -> list[Wall]:
    """The walls; every cell can be reached from every other one.

    In the tree there is one way between two cells. Each opening, a wall of the tree taken away
    (if there is one left), makes a loop. Walls in a row are joined.
    """
    tree = _tree(columns, rows, rng)
    closed = [
        (a, b)
        for a in ((i, j) for i in range(columns) for j in range(rows))
        for b in ((a[0] + 1, a[1]), (a[0], a[1] + 1))
        if b[0] < columns and b[1] < rows and (a, b) not in tree
    ]
    for _ in range(min(openings, len(closed))):
        del closed[int(rng.integers(len(closed)))]
    upright = {(b[0], b[1]) for a, b in closed if b[0] > a[0]}
    level = {(b[0], b[1]) for a, b in closed if b[1] > a[1]}
    upright |= {(x, j) for x in (0, columns) for j in range(rows)}
    level |= {(i, y) for y in (0, rows) for i in range(columns)}
    walls = [(x, a, x, b) for x, a, b in _runs(upright)]
    return walls + [(a, y, b, y) for y, a, b in _runs({(y, i) for i, y in level})]


def _tree(columns: int, rows: int, rng: np.random.Generator) -> set[tuple[Cell, Cell]]:
    """Pairs of neighbouring cells without a wall between them, the lower cell first."""
    path: list[Cell] = [(0, 0)]
    visited, tree = {path[0]}, set[tuple[Cell, Cell]]()
    while path:
        i, j = here = path[-1]
        around = [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)]
        new = [c for c in around if 0 <= c[0] < columns and 0 <= c[1] < rows and c not in visited]
        if not new:
            path.pop()
            continue
        chosen = new[int(rng.integers(len(new)))]
        tree.add((min(here, chosen), max(here, chosen)))
        visited.add(chosen)
        path.append(chosen)
    return tree


def _runs(walls: set[tuple[int, int]]) -> Iterator[tuple[int, int, int]]:
    """(line, from, to) of unit walls (line, from), joined where one ends and the next begins."""
    for line, begin in sorted(walls):
        if (line, begin - 1) not in walls:
            end = begin
            while (line, end) in walls:
                end += 1
            yield line, begin, end
