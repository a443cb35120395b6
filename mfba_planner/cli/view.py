# SPDX-License-Identifier: Apache-2.0
"""`mfba view`: walk through a run in the Rerun viewer; needs neither ROS nor RViz."""

from __future__ import annotations

from pathlib import Path

from ..arguments import Parser
from ..core.errors import ConfigError
from ..outputs import bag_in, new_file
from ..recording.episode import read_episode
from ..report import stage


def main(args: list[str]) -> int:
    """Open the viewer, or write what it opens."""
    parser = Parser(
        prog="mfba view",
        description="Show the run that a bag holds in the Rerun viewer: world, sectors, bats, "
        "speed, ranges and reasons, at any time of it. Needs the extra 'view' (rerun-sdk).",
    )
    parser.add_bag()
    parser.add_argument(
        "--save", type=Path, metavar="FILE", help="write a .rrd file instead, for `rerun FILE`"
    )
    found = parser.parse(args)
    if found.save is not None and found.save.suffix != ".rrd":
        raise ConfigError(f"{found.save}: unknown kind of recording; give a name in .rrd")
    episode, name = read_episode(bag_in(found.bag)), Path(found.bag).resolve().name
    if found.save is None:
        stage.show(episode, name)
        print(f"showing {len(episode.ticks)} ticks")
        return 0
    with new_file(found.save) as file:
        file.write(stage.recorded(episode, name))
    print(f"wrote {found.save}: {len(episode.ticks)} ticks")
    return 0
