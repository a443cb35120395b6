# SPDX-License-Identifier: Apache-2.0
"""`mfba digest`: the decision digest of bags and results; needs no ROS."""

from __future__ import annotations

import sys
from pathlib import Path

from ..core.argument_parser import Parser
from ..core.output_files import bag_or_result_in
from ..recording.decisions_without_inputs import print_omissions
from ..recording.fleet_topics import NO_NAMESPACE, select_robots
from ..recording.read_episode import summaries
from ..report.result_json import read_result


def main(args: list[str]) -> int:
    """Print one line per file: digest and name, like sha256sum."""
    parser = Parser(
        prog="mfba digest",
        description="Print the decision digest of bags or results: equal digests mean equal "
        "decisions, bit for bit. A fleet's bag has one for each robot. "
        "See docs/determinism.md.",
    )
    parser.add_argument(
        "paths", type=Path, nargs="+", metavar="BAG|RESULT", help="bag, run directory or result"
    )
    parser.add_robots()
    parsed = parser.parse(args)
    for path in parsed.paths:
        for robot, digest in _digests(path, parsed.robots).items():
            print(f"{digest}  {path} {robot}".rstrip())
    return 0


def _digests(path: Path, robots: list[str]) -> dict[str, str]:
    path = bag_or_result_in(path)
    if path.suffix == ".json":
        select_robots(path, [NO_NAMESPACE], robots)
        return {NO_NAMESPACE: str(read_result(path)["digest"])}
    runs = summaries(path, robots)
    # To stderr, so that stdout has digest lines only.
    print_omissions(path, {name: run.omitted for name, run in runs.items()}, sys.stderr)
    return {name: run.digest for name, run in runs.items()}
