# SPDX-License-Identifier: Apache-2.0
"""`mfba picture`: draw the run of a bag as PNG; needs no ROS."""

from __future__ import annotations

from ..core.argument_parser import Parser
from ..core.output_files import bag_in, file_type
from ..recording.decisions_without_inputs import print_omissions
from ..recording.read_episode import read_recording
from ..recording.read_perceived import read_perceived


def main(args: list[str]) -> int:
    """Draw a bag's run."""
    parser = Parser(prog="mfba picture", description="Draw the run of a bag, as `mfba run` does.")
    parser.add_bag()
    parser.add_argument(
        "png", type=file_type("picture", ".png"), metavar="PNG", help=".png to create"
    )
    parser.add_robots()
    parsed = parser.parse(args)
    bag = bag_in(parsed.bag)
    scenario, seed, runs, omitted = read_recording(bag, parsed.robots)
    print_omissions(bag, omitted)
    # The drawing modules take long to import: only after the bag has been read.
    if len(runs) == 1:
        from ..report.run_figure import draw_run

        (episode,) = runs.values()
        draw_run(episode, parsed.png, read_perceived(bag, runs).get(next(iter(runs)), ()))
    else:
        from ..report.fleet_figure import draw_fleet

        draw_fleet(scenario, seed, runs, parsed.png)
    print(f"wrote {parsed.png}")
    return 0
