# SPDX-License-Identifier: Apache-2.0
"""`mfba view`: runs in Rerun's viewer; needs no ROS."""

from __future__ import annotations

from pathlib import Path

from ..core.argument_parser import Parser
from .named_episodes import add_paths, named_episodes

_DESCRIPTION = """Watch runs in Rerun's viewer (pip install 'mfba_planner[view]'): the world in
motion, the decisions in words, clearance and speed; play and scrub on sim_time or tick."""


def main(args: list[str]) -> int:
    """Open the viewer, or write what it opens."""
    parser = Parser(prog="mfba view", description=_DESCRIPTION)
    add_paths(parser)
    parser.add_argument(
        "--save", type=Path, metavar="RRD", help="file to create instead, for `rerun RRD`"
    )
    found = parser.parse(args)
    runs, roster = named_episodes(found.paths, found.robots)
    from ..report.rerun_viewer import save, show

    if found.save is None:
        show(runs, roster)
        return 0
    save(runs, found.save, roster)
    print(f"wrote {found.save}")
    return 0
