# SPDX-License-Identifier: Apache-2.0
"""All numbers that the paper prints, verbatim: data to compare with, not targets to fit."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Printed:
    """A printed number: place (table or section), row, column, text, and its value (or None)."""

    place: str
    row: str
    column: str
    text: str
    value: float | None

    @property
    def key(self) -> str:
        """Unique name of the number: `Table 5/MFBA/mean`."""
        return f"{self.place}/{self.row}/{self.column}"


# Table 1 and the worked example of section 4.2.
GAP_BITS = ("0 0 | 0", "0 1 | 1", "1 0 | 1", "1 1 | 1")
EXAMPLE_VS = "1 1 0 0 0 0 1 1 1 0 0 0"
EXAMPLE_VG = "1 1 0 0 0 1 1 1 1 0 0 1"

# Table 2: function, name, formula, unimodal or multimodal, minimum, search range.
FUNCTION_COLUMNS = ("formula", "C", "minimum", "from", "to")
FUNCTION_ROWS = (
    ("F1", "Sphere", "sum x_i^2", "U", "0", "-5.12", "5.12"),
    ("F2", "Easom", "-cos(x_1) cos(x_2) * exp(-(x_1 - pi)^2 - (x_2 - pi)^2)",
     "U", "-1", "-100", "100"),
    ("F3", "Three Hump Camel", "2 x_1^2 - 1.05 x_1^4 + x_1^6/6 + x_1 x_2 + x_2^2",
     "M", "0", "-5", "5"),
    ("F4", "Booth", "(x_1 + 2 x_2 - 7)^2 + (2 x_1 + x_2 - 5)^2", "U", "0", "-10", "10"),
    ("F5", "Rastrigin", "10 * d + sum (x_i^2 - 10 * cos(2 pi x_i))", "M", "0", "-5.12", "5.12"),
    ("F6", "Michalewicz", "-sum sin(x_i) * sin^2m(i x_i^2 / pi)", "M", "-1.8013", "0", "π"),
)  # fmt: skip

BENCHMARK_COLUMNS = ("best", "worst", "mean", "sd")
BENCHMARK_RUNS = 15
_BENCHMARK = """
F1 | BA   | 0.00028437 | 0.048626  | 0.0146  | 0.0145 |
F1 | MFBA | 0.00011976 | 0.0285    | 0.0048  | 0.0078 | +
F2 | BA   | -0.8286    | -9.64e-32 | -0.1241 | 0.2476 |
F2 | MFBA | -0.8691    | 0         | -0.2090 | 0.3132 | +
F3 | BA   | 1.1407e-05 | 0.3050    | 0.0398  | 0.0857 |
F3 | MFBA | 1.1183e-05 | 0.1034    | 0.0154  | 0.0361 | +
F4 | BA   | 1.7676e-04 | 0.4544    | 0.1256  | 0.1533 |
F4 | MFBA | 2.7530e-05 | 0.1854    | 0.1029  | 0.0305 | +
F5 | BA   | 0.0121     | 5.6793    | 2.4541  | 1.8399 |
F5 | MFBA | 0.0642     | 5.3864    | 2.0278  | 1.3476 | +
F6 | BA   | -1.9880    | -1.5022   | -1.7743 | 0.1008 |
F6 | MFBA | -1.9695    | -1.7993   | -1.8762 | 0.0617 | +
"""

TRIP_COLUMNS = ("minimum", "maximum", "standard deviation", "mean")
TRIP_RUNS = 10
TRIP_TABLES = {"case1": "Table 5", "case2": "Table 7"}
_TRIPS = {
    "Table 5": """
BA   | 0.056170939  | 0.058502796  | 0.00103782 | 0.05751639825
MFBA | 0.05830325   | 0.0585072461 | 0.05315157 | 0.05844756632
""",
    "Table 7": """
BA   | 0.052038612  | 0.053694446 | 0.10387507 | 0.052918954
MFBA | 0.0532810468 | 0.054486114 | 0.07777658 | 0.05399353627
""",
}

OBSTACLE_COLUMNS = ("center x", "center y", "radius", "speed", "theta")
OBSTACLE_TABLES = {"case1": "Table 4", "case2": "Table 6"}
_OBSTACLES = {
    "Table 4": """
1 | 1    | 4.5 | 0.3 | 0.3  | 0
2 | 10.5 | 6   | 0.3 | 0.2  | 180
3 | 6    | 12  | 0.3 | 0.15 | 270
""",
    "Table 6": """
1 | 4    | 2 | 0.3 | 0.3  | 111.8
2 | 3    | 7 | 0.3 | 0.2  | 315
3 | 9    | 4 | 0.3 | 0.2  | 126.8
4 | 7    | 9 | 0.3 | 0.25 | 315
5 | 11.2 | 7 | 0.3 | 0.22 | 150
""",
}

# The text on the best of ten runs, and on the straight line.
_TEXT = """
Section 6.2         | optimum     | length     | 16.9705
Section 6.2, case 1 | MFBA        | length     | 17.0925
Section 6.2, case 1 | MFBA        | run time   | 8.151829
Section 6.2, case 1 | MFBA        | experiment | 8
Section 6.2, case 1 | BA          | length     | 17.0932
Section 6.2, case 1 | BA          | run time   | 7.905828
Section 6.2, case 1 | BA          | experiment | 8
Section 6.2, case 2 | MFBA        | length     | 18.3533
Section 6.2, case 2 | MFBA        | run time   | 9.0903
Section 6.2, case 2 | MFBA        | experiment | 5
Section 6.2, case 2 | BA          | length     | 18.6239
Section 6.2, case 2 | BA          | run time   | 9.10554
Section 6.2, case 2 | BA          | experiment | 8
"""

# The constants that the paper states.
_CONSTANTS = """
Section 2   | eq. 2             | epsilon       | 0.001
Section 3.2 | eq. 10            | rho           | 0.01
Section 4.1 | sensors           | number        | 12
Section 6.1 | Table 3           | runs          | 15
Section 6.1 | F6                | m             | 10
Section 6.2 | swarm             | population    | 5
Section 6.2 | swarm             | A_i(0)        | 1
Section 6.2 | swarm             | r_i(0)        | 0.5
Section 6.2 | swarm             | alpha         | 0.98
Section 6.2 | swarm             | gamma         | 0.8
Section 6.2 | swarm             | f_min         | 0
Section 6.2 | swarm             | f_max         | 10
Section 6.2 | swarm             | sigma         | 0.3
Section 6.2 | sensors           | SR            | 0.8
Section 6.2 | start             | x             | 0
Section 6.2 | start             | y             | 0
Section 6.2 | goal              | x             | 12
Section 6.2 | goal              | y             | 12
Section 6.2 | Tables 5 and 7    | runs          | 10
"""


def _cells(text: str) -> Iterator[list[str]]:
    for line in text.strip().splitlines():
        yield [cell.strip() for cell in line.split("|")]


def _named(text: str) -> tuple[Printed, ...]:
    return tuple(
        Printed(place=place, row=row, column=column, text=number, value=float(number))
        for place, row, column, number in _cells(text)
    )


def _rows(place: str, text: str, columns: tuple[str, ...], names: int) -> tuple[Printed, ...]:
    """Rows whose first `names` cells name them; an empty cell prints nothing."""
    return tuple(
        Printed(
            place=place,
            row=" ".join(cells[:names]),
            column=column,
            text=number,
            value=None if number == "+" else float(number),
        )
        for cells in _cells(text)
        for column, number in zip(columns, cells[names:])
        if number
    )


BENCHMARK = _rows("Table 3", _BENCHMARK, (*BENCHMARK_COLUMNS, "significant"), 2)
TRIPS = {place: _rows(place, text, TRIP_COLUMNS, 1) for place, text in _TRIPS.items()}
OBSTACLES = {place: _rows(place, text, OBSTACLE_COLUMNS, 1) for place, text in _OBSTACLES.items()}
TEXT = _named(_TEXT)
CONSTANTS = _named(_CONSTANTS)
GAPS = tuple(
    Printed(
        place="Table 1", row=f"Vs(i), Vs(i+1) = {vs}", column="Vg(i)", text=vg, value=float(vg)
    )
    for vs, vg in (line.split(" | ") for line in GAP_BITS)
)
EXAMPLE = Printed(
    place="Section 4.2", row=f"Vs = {EXAMPLE_VS}", column="Vg", text=EXAMPLE_VG, value=None
)
FUNCTIONS = tuple(
    Printed(
        place="Table 2",
        row=f"{key}: {name}",
        column=column,
        text=text,
        value=None if column in ("formula", "C") else math.pi if text == "π" else float(text),
    )
    for key, name, *cells in FUNCTION_ROWS
    for column, text in zip(FUNCTION_COLUMNS, cells)
)

ALL: tuple[Printed, ...] = (
    *GAPS,
    EXAMPLE,
    *FUNCTIONS,
    *BENCHMARK,
    *OBSTACLES["Table 4"],
    *TRIPS["Table 5"],
    *OBSTACLES["Table 6"],
    *TRIPS["Table 7"],
    *TEXT,
    *CONSTANTS,
)
BY_KEY = {printed.key: printed for printed in ALL}


def values(place: str, row: str) -> dict[str, float]:
    """The numbers of one row of a table: {column: value}."""
    return {
        p.column: p.value for p in ALL if p.place == place and p.row == row and p.value is not None
    }
