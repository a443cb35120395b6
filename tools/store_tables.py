# SPDX-License-Identifier: Apache-2.0
"""Store the quick form's numbers for test/cli/test_cli_tables.py, after a change that is meant.

`python tools/store_tables.py` runs `mfba tables --quick` and writes test/data/tables_quick.json.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "test" / "helpers")]


def main() -> int:
    """Run and store."""
    from stored_tables import STORED, flat, libm

    from mfba_planner import cli

    with tempfile.TemporaryDirectory() as directory:
        out = Path(directory) / "out"
        cli.main(["tables", "--quick", "--out", str(out)])
        made = json.loads((out / "tables.json").read_text(encoding="utf-8"))
    stored = {"libm": libm(), **flat(made)}
    STORED.write_text(json.dumps(stored, indent=0, ensure_ascii=False) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
