# SPDX-License-Identifier: Apache-2.0
"""Read reports back: the data of an HTML page, the rows of a .rrd file."""

import json
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any


def data_of(path: Path) -> dict[str, Any]:
    found = re.search(r'id="data">(.*?)</script>', path.read_text(encoding="utf-8"), re.DOTALL)
    assert found
    data: dict[str, Any] = json.loads(found[1])
    return data


RERUN = Path(sys.executable).parent / "rerun"


ROWS = re.compile(r"^Chunk\(\w+\) with (\d+) rows .*? - (/\S+)", re.MULTILINE)


def rows_of(path: Path) -> Counter[str]:
    """Rows per entity, from `rerun rrd print`."""
    done = subprocess.run(
        [RERUN, "rrd", "print", path], capture_output=True, text=True, timeout=120, check=True
    )
    found: Counter[str] = Counter()
    for rows, entity in ROWS.findall(done.stdout):
        found[entity] += int(rows)
    return found
