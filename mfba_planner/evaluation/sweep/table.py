# SPDX-License-Identifier: Apache-2.0
"""The sweep's table: rows in order, their hash, and the files they go into."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ...core.errors import ConfigError, OutputError
from ...core.outputs import write_same
from ..study.chunk import Columns
from ..suites import suite
from .chunks import Optima, Runs, gather
from .columns import COLUMNS, TIMINGS, Row, judged
from .sweep_spec import SweepSpec

Kinds = Mapping[str, tuple[type, str]]


def build(
    order: SweepSpec, chunks: list[Runs | Optima], found: Mapping[str, Columns]
) -> tuple[list[Row], list[Row]]:
    """The table's rows and the timings' rows, in the order of suite, world, planner, seed."""
    runs, optima = gather(chunks, found)
    by_world = {row["world"]: row for row in optima}
    worlds = suite(order.suite, order.setting.suite_seed)
    place = {name: k for k, name in enumerate(order.planners)}
    runs.sort(key=lambda row: (row["world"], place[row["planner"]], row["seed"]))
    speed = order.setting.params.speed_mps
    rows = []
    for row in runs:
        optimum = by_world.get(worlds.world_number(row["world"])) if order.oracle else None
        rows.append(_in_order(judged(row, optimum, speed), COLUMNS))
    return rows, [_in_order(row, TIMINGS) for row in runs]


def _in_order(row: Row, kinds: Kinds) -> Row:
    return {name: row.get(name) for name in kinds}


def sorted_hash(rows: Sequence[Row]) -> str:
    """SHA-256 of the rows whatever their order, every float to its last bit."""
    lines = sorted(json.dumps(row, sort_keys=True) for row in rows)
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


def write(path: Path, rows: Sequence[Row], kinds: Kinds) -> None:
    """Write a .csv or .parquet, whole; one that is there must hold just that.

    Raises OutputError for one that does not, ConfigError where pyarrow is missing.
    """
    data = to_parquet(rows, kinds) if path.suffix == ".parquet" else to_csv(rows, kinds)
    try:
        write_same(path, data)
    except OutputError:
        if not path.is_file():
            raise
        raise OutputError(
            f"{path}: is not what the finished runs say (cut short or edited); move it away and "
            "call again, nothing will be computed twice"
        ) from None


def to_csv(rows: Sequence[Row], kinds: Kinds) -> bytes:
    """Text; empty for what does not apply, inf for never, true and false."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(kinds)
    writer.writerows([_cell(row[name]) for name in kinds] for row in rows)
    return text.getvalue().encode()


def _cell(value: Any) -> Any:
    if isinstance(value, bool):
        return str(value).lower()
    return "" if isinstance(value, float) and math.isnan(value) else value


def to_parquet(rows: Sequence[Row], kinds: Kinds) -> bytes:
    """The same with types; null for what does not apply."""
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise ConfigError(
            "parquet: pyarrow is not installed; pip install 'mfba_planner[parquet]', "
            "or give --format csv"
        ) from None
    arrow = {
        int: pyarrow.int64(),
        float: pyarrow.float64(),
        str: pyarrow.string(),
        bool: pyarrow.bool_(),
    }
    schema = pyarrow.schema(
        [
            pyarrow.field(name, arrow[kind], metadata={"meaning": meaning})
            for name, (kind, meaning) in kinds.items()
        ]
    )
    columns = {name: [row[name] for row in rows] for name in kinds}
    sink = io.BytesIO()
    parquet.write_table(pyarrow.table(columns, schema=schema), sink)
    return sink.getvalue()
