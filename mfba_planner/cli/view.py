# SPDX-License-Identifier: Apache-2.0
"""`mfba view`: show runs in Rerun's viewer, or save them for it; needs no ROS."""

from __future__ import annotations

from ..core.argument_parser import Parser
from ..core.output_files import file_type
from .support.load_episodes import add_paths, named_episodes

_DESCRIPTION = """Show runs in Rerun's viewer (pip install 'mfba_planner[view]'): the moving world,
the local maps of a bag, decisions as text, clearance and speed; playback on sim_time or tick."""


def main(args: list[str]) -> int:
    """Open the viewer, or write a file for it."""
    parser = Parser(prog="mfba view", description=_DESCRIPTION)
    add_paths(parser)
    parser.add_argument(
        "--save",
        type=file_type("recording for Rerun", ".rrd"),
        metavar="RRD",
        help="write this file instead of opening the viewer; open it with `rerun RRD`",
    )
    parsed = parser.parse(args)
    runs, fleet_names, maps, _ = named_episodes(parsed.paths, parsed.robots)
    from ..report.rerun_viewer import save, show

    if parsed.save is None:
        show(runs, fleet_names, maps)
        return 0
    save(runs, parsed.save, fleet_names, maps)
    print(f"wrote {parsed.save}")
    return 0
