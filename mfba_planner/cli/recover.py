# SPDX-License-Identifier: Apache-2.0
"""`mfba recover`: copy the intact messages of a broken bag into a new one; needs no ROS."""

from __future__ import annotations

from pathlib import Path

from ..core.argument_parser import Parser
from ..core.output_files import bag_in
from ..recording.recover import recover


def main(args: list[str]) -> int:
    """Recover a bag."""
    parser = Parser(
        prog="mfba recover",
        description="Copy the intact messages of a truncated or damaged bag into a new one.",
    )
    parser.add_bag()
    parser.add_argument("out", type=Path, metavar="OUT", help="bag directory to create")
    parsed = parser.parse(args)
    report = recover(bag_in(parsed.bag), parsed.out)
    for problem in report.problems:
        print(f"problem: {problem}")
    print(
        f"wrote {report.output}: {report.messages} messages from {report.chunks} chunks, "
        f"{report.attachments} attachments; {report.bytes_lost} bytes could not be recovered"
    )
    return 0
