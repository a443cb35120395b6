# SPDX-License-Identifier: Apache-2.0
"""`mfba digest`: the decision digest of bags and results; needs no ROS."""

from __future__ import annotations

import sys
from pathlib import Path

from ..core.argument_parser import Parser
from ..core.outputs import bag_in
from ..recording.omitted_decisions import tell
from ..recording.read_episode import summaries
from ..recording.robot_topics import NO_NAMESPACE, chosen
from ..report.result_json import read_result


def main(args: list[str]) -> int:
    """Print one line per file: digest and name, as sha256sum does."""
    parser = Parser(
        prog="mfba digest",
        description="Print the decision digest of bags or results: equal digests mean equal "
        "decisions, bit for bit. Of a fleet's bag there is one for each robot. "
        "docs/determinism.md describes it.",
    )
    parser.add_argument(
        "paths", type=Path, nargs="+", metavar="BAG|RESULT", help="bag, run directory or result"
    )
    parser.add_robots()
    found = parser.parse(args)
    for path in found.paths:
        for robot, digest in _digests(path, found.robots).items():
            print(f"{digest}  {path} {robot}".rstrip())
    return 0


def _digests(path: Path, robots: list[str]) -> dict[str, str]:
    if path.suffix == ".json":
        chosen(path, [NO_NAMESPACE], robots)
        return {NO_NAMESPACE: str(read_result(path)["digest"])}
    bag = bag_in(path)
    runs = summaries(bag, robots)
    # Not among the lines that others read.
    tell(bag, {name: run.missed for name, run in runs.items()}, sys.stderr)
    return {name: run.digest for name, run in runs.items()}
