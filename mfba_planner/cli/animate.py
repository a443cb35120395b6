# SPDX-License-Identifier: Apache-2.0
"""`mfba animate`: a run as an animated WebP or GIF; needs no ROS."""

from __future__ import annotations

from pathlib import Path

from ..core.argument_parser import Parser
from ..core.output_files import file_type, new_file
from ..report.animation_options import AnimationOptions
from .support.load_episodes import named_episodes
from .support.progress_bar import progress_bar

_DESCRIPTION = """Write a run as an animation for a web page or slides: WebP or GIF, by the suffix.

A bag is read. Of a result (`mfba sim --out`) the run is simulated again, and must take the
decisions that the result's digest stands for. A fleet's bag shows all its robots, or those
that --robot names; the others are obstacles then. The animation repeats for ever."""


def main(args: list[str]) -> int:
    """Write the animation."""
    usual = AnimationOptions()
    parser = Parser(prog="mfba animate", description=_DESCRIPTION)
    parser.add_argument(
        "path", type=Path, metavar="BAG|RESULT", help="run or bag directory, or file"
    )
    parser.add_argument(
        "out", type=file_type("animation", ".webp", ".gif"), metavar="OUT",
        help="file to create: .webp or .gif",
    )  # fmt: skip
    parser.add_argument(
        "--fps", type=float, default=usual.fps, metavar="N",
        help=f"frames per second (default: {usual.fps:g})",
    )  # fmt: skip
    parser.add_argument(
        "--speed", type=float, default=usual.speed, metavar="N",
        help=f"simulated seconds per second (default: {usual.speed:g})",
    )  # fmt: skip
    parser.add_argument(
        "--width", type=int, default=usual.width_px, metavar="PX",
        help=f"pixels (default: {usual.width_px})",
    )  # fmt: skip
    parser.add_argument(
        "--max-bytes", type=int, default=usual.max_bytes, metavar="N",
        help="size limit: colours, then frames are left out until it fits "
        f"(default: {usual.max_bytes})",
    )  # fmt: skip
    parser.add_robots()
    found = parser.parse(args)
    # Pillow and matplotlib take their time: not for --help.
    from ..report.animation import animation_bytes

    options = AnimationOptions(
        fps=found.fps, speed=found.speed, width_px=found.width, max_bytes=found.max_bytes
    )
    with new_file(found.out) as file:
        runs, roster, *_ = named_episodes([found.path], found.robots)
        with progress_bar("drawing") as progress:
            data = animation_bytes(runs, roster, found.out.suffix.lower(), options, progress)
        file.write(data)
    print(f"wrote {found.out}")
    return 0
