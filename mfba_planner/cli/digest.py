# SPDX-License-Identifier: Apache-2.0
"""`mfba digest`: the decision digest of bags and results; needs no ROS."""

from __future__ import annotations

from pathlib import Path

from ..arguments import Parser
from ..outputs import bag_in
from ..recording.episode import summarize
from ..report.result import read_result


def main(args: list[str]) -> int:
    """Print one line per file: digest and name, as sha256sum does."""
    parser = Parser(
        prog="mfba digest",
        description="Print the decision digest of bags or results: equal digests mean equal "
        "decisions, bit for bit. docs/determinism.md describes it.",
    )
    parser.add_argument(
        "paths", type=Path, nargs="+", metavar="BAG|RESULT", help="bag, run directory or result"
    )
    for path in parser.parse(args).paths:
        print(f"{_digest(path)}  {path}")
    return 0


def _digest(path: Path) -> str:
    if path.suffix == ".json":
        return str(read_result(path)["digest"])
    return summarize(bag_in(path))[2]
