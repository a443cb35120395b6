# SPDX-License-Identifier: Apache-2.0
"""`mfba picture`: the run that a bag holds, as PNG; needs no ROS."""

from __future__ import annotations

from pathlib import Path

from ..core.argument_parser import Parser
from ..core.outputs import bag_in
from ..recording.omitted_decisions import tell
from ..recording.read_episode import read_recording


def main(args: list[str]) -> int:
    """Draw a bag's run."""
    parser = Parser(
        prog="mfba picture", description="Draw the run that a bag holds, as `mfba run` does."
    )
    parser.add_bag()
    parser.add_argument("png", type=Path, metavar="PNG", help="file to create")
    parser.add_robots()
    found = parser.parse(args)
    bag = bag_in(found.bag)
    scenario, seed, runs, missed = read_recording(bag, found.robots)
    tell(bag, missed)
    # What draws takes its time: only where there is something to draw.
    if len(runs) == 1:
        from ..report.run_figure import draw_run

        (episode,) = runs.values()
        draw_run(episode, found.png)
    else:
        from ..report.fleet_figure import draw_fleet

        draw_fleet(scenario, seed, runs, found.png)
    print(f"wrote {found.png}")
    return 0
