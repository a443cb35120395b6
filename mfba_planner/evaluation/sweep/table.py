# SPDX-License-Identifier: Apache-2.0
"""The sweep table: sorted rows, their hash, and CSV and Parquet files."""

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
from ...core.output_files import write_same
from ..study.chunk import Columns
from .sweep_chunks import OracleChunk, RunsChunk, gather
from .sweep_spec import SweepSpec
from .table_columns import COLUMNS, SCENARIO, TIMINGS, Row, with_optimum

Kinds = Mapping[str, tuple[type, str]]


def build(
    spec: SweepSpec, chunks: list[RunsChunk | OracleChunk], found: Mapping[str, Columns]
) -> tuple[list[Row], list[Row]]:
    """Rows of the table and of the timings, sorted by suite, world, planner, seed."""
    runs, optima = gather(chunks, found)
    by_world = {row["world"]: row for row in optima}
    worlds, kinds = spec.setting.suite(spec.suite), kinds_of(spec)
    rank = {name: k for k, name in enumerate(spec.planners)}
    runs.sort(key=lambda row: (row["world"], rank[row["planner"]], row["seed"]))
    speed = spec.setting.params.speed_mps
    rows = []
    for row in runs:
        optimum = by_world.get(worlds.world_number(row["world"])) if spec.oracle else None
        row = {**row, **_scenario_name(spec, row["world"])}
        rows.append(_columns_of(with_optimum(row, optimum, speed), kinds))
    return rows, [_columns_of(row, TIMINGS) for row in runs]


def kinds_of(spec: SweepSpec) -> Kinds:
    """The columns of the table: with the scenarios' names in a suite of files."""
    return COLUMNS if spec.setting.scenarios is None else {**COLUMNS, **SCENARIO}


def _scenario_name(spec: SweepSpec, world: int) -> Row:
    scenarios = spec.setting.scenarios
    return {} if scenarios is None else {"scenario": scenarios.names[world]}


def _columns_of(row: Row, kinds: Kinds) -> Row:
    return {name: row.get(name) for name in kinds}


def sorted_hash(rows: Sequence[Row]) -> str:
    """SHA-256 of the sorted rows, every float to its last bit."""
    lines = sorted(json.dumps(row, sort_keys=True) for row in rows)
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


def write(path: Path, rows: Sequence[Row], kinds: Kinds) -> None:
    """Write a .csv or .parquet atomically; an existing file must have the same content.

    Raises OutputError where it differs, ConfigError where pyarrow is missing.
    """
    data = to_parquet(rows, kinds) if path.suffix == ".parquet" else to_csv(rows, kinds)
    try:
        write_same(path, data)
    except OutputError:
        if not path.is_file():
            raise
        raise OutputError(
            f"{path}: differs from the finished runs (cut short or edited); move it away and "
            "call again, nothing will be computed twice"
        ) from None


def to_csv(rows: Sequence[Row], kinds: Kinds) -> bytes:
    """CSV: empty where not applicable, inf for never, true and false."""
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
    """Parquet: typed columns, null where not applicable."""
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
