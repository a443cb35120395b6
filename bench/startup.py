# SPDX-License-Identifier: Apache-2.0
"""How long commands take from the shell to their end, beside two processes that do nothing.

Run: python bench/startup.py --rounds 7. Every round runs each row once, one after another, so that
a machine whose speed drifts slows all; a ratio compares a row with `node` of the same round. The
first round, which may write .pyc files, does not count. `python`: the bare interpreter. `node`:
rclpy.init, one node, shutdown. --only NAME chooses rows, --imports ROW lists its slow imports.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

MFBA = "import sys; from mfba_planner import entry_points; sys.exit(entry_points.mfba())"
NODE = "import rclpy; rclpy.init(); n = rclpy.create_node('n'); n.destroy_node(); rclpy.shutdown()"
NEW, NEW_PAGE = "new", "new.html"  # what a row writes; removed before each round
ROWS: dict[str, list[str]] = {
    "python": ["pass"],
    "node": [NODE],
    "run case1": [MFBA, "run", "case1", "--planner=paper", "--out", NEW],
    "run case1, predictive": [MFBA, "run", "case1", "--out", NEW],
    "sim case1": [MFBA, "sim", "case1", "--planner=paper"],
    "sim case1, predictive": [MFBA, "sim", "case1"],
    "sim case1 --out": [MFBA, "sim", "case1", "--planner=paper", "--out", NEW],
    "verify": [MFBA, "verify", "recorded"],
    "report": [MFBA, "report", "recorded", "--out", NEW_PAGE],
    "--help": [MFBA, "--help"],
}
READY = re.compile(r"nodes are ready after ([\d.]+) s")  # from the start of the first one
SLOW_US = 5000  # of --imports


def seconds(row: list[str], directory: Path, *options: str) -> tuple[float, str, str]:
    """Wall time of a row, what it wrote to stdout and stderr. RuntimeError where it fails."""
    shutil.rmtree(directory / NEW, ignore_errors=True)
    (directory / NEW_PAGE).unlink(missing_ok=True)
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    started = time.perf_counter()
    done = subprocess.run(
        [sys.executable, *options, "-c", *row],
        cwd=directory,
        env={"PYTHONPATH": str(Path(__file__).resolve().parents[1])} | environment,
        capture_output=True,
        text=True,
    )
    took = time.perf_counter() - started
    if done.returncode:
        raise RuntimeError(f"{row[1:]}: exit code {done.returncode}: {done.stderr}")
    return took, done.stdout, done.stderr


def fleet(directory: Path, robots: int) -> list[str]:
    """The row of robots that cross an empty place side by side, a process per node."""
    members = [
        f"{{name: r{k}, start_m: [0.0, {2 * k}.0], goal_m: [1.5, {2 * k}.0]}}"
        for k in range(robots)
    ]
    text = f"name: side by side\nrobots: [{', '.join(members)}]\n"
    (directory / "fleet.yaml").write_text(text)
    return [MFBA, "run", "fleet.yaml", "--planner=paper", "--driver=multi-process", "--out", NEW]


def main() -> None:
    """Print median and range of seconds and ratios, or the slow imports of a row."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--only", default="", help="rows whose name holds this, and the floors")
    parser.add_argument("--robots", type=int, default=0, help="a fleet of so many, as processes")
    parser.add_argument("--imports", choices=ROWS, help="list the slow imports of this row")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as root:
        directory = Path(root)
        rows = {k: v for k, v in ROWS.items() if options.only in k or k in ("python", "node")}
        if options.robots:
            rows[f"run, {options.robots} robots"] = fleet(directory, options.robots)
        seconds([MFBA, "run", "case1", "--planner=paper", "--out", "recorded"], directory)
        if options.imports:
            _, _, lines = seconds(ROWS[options.imports], directory, "-X", "importtime")
            for line in lines.splitlines():
                fields = line.removeprefix("import time:").split("|")
                if len(fields) == 3 and fields[1].strip().isdigit() and int(fields[1]) > SLOW_US:
                    print(f"{int(fields[1]) / 1000:6.1f} ms {fields[2]}")
            return
        taken: dict[str, list[float]] = {name: [] for name in rows}
        for number in range(options.rounds + 1):
            for name, row in rows.items():
                took, lines, _ = seconds(row, directory)
                if number:
                    taken[name].append(took)
                if number and (ready := READY.search(lines)):
                    taken.setdefault(f"{name}: ready", []).append(float(ready[1]))
    print(f"{options.rounds} rounds{'':<21}seconds               ratio to `node`")
    for name, times in taken.items():
        ratios = [one / floor for one, floor in zip(times, taken["node"])]
        print(f"{name:<28}{_spread(times)}   {_spread(ratios)}")


def _spread(values: list[float]) -> str:
    return f"{statistics.median(values):5.2f} ({min(values):5.2f} to {max(values):5.2f})"


if __name__ == "__main__":
    main()
