# SPDX-License-Identifier: Apache-2.0
"""`mfba picture`: the run that a bag holds, as PNG; needs no ROS."""

from __future__ import annotations

from pathlib import Path

from ..arguments import Parser
from ..outputs import bag_in
from ..recording.episode import read_episode


def main(args: list[str]) -> int:
    """Draw a bag's run."""
    parser = Parser(
        prog="mfba picture", description="Draw the run that a bag holds, as `mfba run` does."
    )
    parser.add_bag()
    parser.add_argument("png", type=Path, metavar="PNG", help="file to create")
    found = parser.parse(args)
    episode = read_episode(bag_in(found.bag))
    from ..report.figure import draw_run  # takes its time: only where there is something to draw

    draw_run(episode, found.png)
    print(f"wrote {found.png}")
    return 0
