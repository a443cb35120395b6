# SPDX-License-Identifier: Apache-2.0
"""`mfba info`: what a bag holds, and how its run went; needs no ROS."""

from __future__ import annotations

from ..arguments import Parser
from ..core.errors import BagError
from ..launcher.conclusion import show
from ..outputs import bag_in
from ..recording.configuration import ATTACHMENT_NAME
from ..recording.episode import summarize
from ..recording.info import describe, format_info


def main(args: list[str]) -> int:
    """Describe a bag."""
    parser = Parser(prog="mfba info", description="Say what a bag holds, and how its run went.")
    parser.add_bag()
    bag = bag_in(parser.parse(args).bag)
    info = describe(bag)
    print(format_info(info))
    if any(name == ATTACHMENT_NAME for name, _, _ in info.attachments):
        try:
            episode, result, digest = summarize(bag, salvage=not info.complete)
        except BagError as error:
            print(f"Run:         {error}")
        else:
            print()
            show(episode, result)
            print(f"digest {digest}")
    return 0
