# SPDX-License-Identifier: Apache-2.0
"""`mfba export`: write a bag's ticks and decisions as CSV or Parquet; needs no ROS."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from itertools import chain, islice
from typing import Any, BinaryIO

from ..core.argument_parser import Parser
from ..core.errors import BagError, ConfigError
from ..core.output_files import bag_in, file_type, new_file
from ..recording.bag_reader import BagReader
from ..recording.decisions_with_sectors import robots_with_decisions
from ..recording.decisions_without_inputs import print_omissions
from ..recording.fleet_topics import select_robots
from ..recording.tick_table import COLUMNS, Row, read_rows

BATCH = 5000  # rows in memory at a time


def main(args: list[str]) -> int:
    """Write the table."""
    lines = [f"  {name:<12} {meaning}" for name, (_, meaning) in COLUMNS.items()]
    parser = Parser(
        prog="mfba export",
        description="Write a bag's ticks and decisions as one table, a row per decision; "
        "for a fleet's bag with the robot's name.",
        epilog="columns:\n" + "\n".join([*lines, "  range_1 ...  range of each sector, m"]),
    )
    parser.add_bag()
    parser.add_argument(
        "table", type=file_type("table", *_WRITERS), metavar="FILE",
        help="a .csv or .parquet to create",
    )  # fmt: skip
    parser.add_robots()
    parsed = parser.parse(args)
    write = _WRITERS[parsed.table.suffix.lower()]
    omitted: dict[str, str] = {}
    with BagReader(bag_in(parsed.bag)) as reader:
        robots = select_robots(reader.path, robots_with_decisions(reader), parsed.robots)
        rows = read_rows(reader, robots, omitted)
        first = next(rows, None)
        if first is None:
            raise BagError(f"{parsed.bag}: holds no decision to export; give another bag")
        with new_file(parsed.table) as file:
            count = write(file, list(first), chain([first], rows))
    print_omissions(reader.path, omitted)
    print(f"wrote {parsed.table}: {count} rows")
    return 0


def _write_csv(file: BinaryIO, names: list[str], rows: Iterator[Row]) -> int:
    text = io.TextIOWrapper(file, encoding="utf-8", newline="", write_through=True)
    writer = csv.DictWriter(text, names, restval="", extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    count = 0
    for row in rows:
        writer.writerow(row)
        count += 1
    text.detach()
    return count


def _write_parquet(file: BinaryIO, names: list[str], rows: Iterator[Row]) -> int:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise ConfigError(
            "parquet: pyarrow is not installed; pip install 'mfba_planner[parquet]', or give .csv"
        ) from None
    kinds: dict[type, Any] = {
        int: pyarrow.int64(),
        float: pyarrow.float64(),
        str: pyarrow.string(),
    }
    schema = pyarrow.schema([(name, kinds[COLUMNS.get(name, (float,))[0]]) for name in names])
    count = 0
    with parquet.ParquetWriter(file, schema) as writer:
        while batch := list(islice(rows, BATCH)):
            columns = {name: [row.get(name) for row in batch] for name in names}
            writer.write_table(pyarrow.table(columns, schema=schema))
            count += len(batch)
    return count


_WRITERS = {".csv": _write_csv, ".parquet": _write_parquet}
