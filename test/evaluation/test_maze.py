# SPDX-License-Identifier: Apache-2.0
"""Mazes: one way between any two cells, loops by openings, joined walls."""

import numpy as np
import pytest

from mfba_planner.evaluation.suites.maze import maze_walls

Cell = tuple[int, int]


def unit_walls(walls: list[tuple[int, int, int, int]]) -> set[tuple[Cell, Cell]]:
    """Walls of one cell's length; fails where walls overlap."""
    found: list[tuple[Cell, Cell]] = []
    for x0, y0, x1, y1 in walls:
        assert (x0 == x1) != (y0 == y1)
        steps = range(max(x1 - x0, y1 - y0))
        dx, dy = int(x1 > x0), int(y1 > y0)
        found += [
            ((x0 + k * dx, y0 + k * dy), (x0 + k * dx + dx, y0 + k * dy + dy)) for k in steps
        ]
    assert len(found) == len(set(found))
    return set(found)


def passages(columns: int, rows: int, walls: set[tuple[Cell, Cell]]) -> list[tuple[Cell, Cell]]:
    """Pairs of neighbouring cells without a wall between them."""
    pairs = []
    for i in range(columns):
        for j in range(rows):
            if i + 1 < columns and ((i + 1, j), (i + 1, j + 1)) not in walls:
                pairs.append(((i, j), (i + 1, j)))
            if j + 1 < rows and ((i, j + 1), (i + 1, j + 1)) not in walls:
                pairs.append(((i, j), (i, j + 1)))
    return pairs


def reached(pairs: list[tuple[Cell, Cell]]) -> set[Cell]:
    found, grew = {(0, 0)}, True
    while grew:
        more = {c for pair in pairs if found & set(pair) for c in pair} - found
        found, grew = found | more, bool(more)
    return found


@pytest.mark.parametrize(("columns", "rows"), [(1, 1), (1, 5), (5, 5), (7, 4)])
def test_every_cell_is_reached_and_without_openings_by_one_path(columns: int, rows: int) -> None:
    for seed in range(20):
        walls = unit_walls(maze_walls(columns, rows, 0, np.random.default_rng(seed)))
        pairs = passages(columns, rows, walls)
        assert len(reached(pairs)) == columns * rows
        assert len(pairs) == columns * rows - 1, "a tree"
        border = [w for w in walls if is_border(w, columns, rows)]
        assert len(border) == 2 * (columns + rows), "closed all round"


def is_border(wall: tuple[Cell, Cell], columns: int, rows: int) -> bool:
    (x0, y0), (x1, y1) = wall
    return (x0 == x1 and x0 in (0, columns)) or (y0 == y1 and y0 in (0, rows))


def test_openings_are_walls_taken_away_while_there_are_any() -> None:
    def count(openings: int) -> int:
        return len(unit_walls(maze_walls(5, 5, openings, np.random.default_rng(3))))

    assert [count(0) - count(n) for n in (1, 2, 5)] == [1, 2, 5]
    assert count(1000) == 20


def test_mazes_differ() -> None:
    found = {tuple(maze_walls(5, 5, 0, np.random.default_rng(seed))) for seed in range(20)}
    assert len(found) == 20
