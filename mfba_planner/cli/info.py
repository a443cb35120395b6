# SPDX-License-Identifier: Apache-2.0
"""`mfba info`: contents of a bag, and the result of its run; needs no ROS."""

from __future__ import annotations

from ..core.argument_parser import Parser
from ..core.errors import BagError
from ..core.output_files import bag_in
from ..launcher.run_result import show
from ..recording.bag_info import describe, format_info
from ..recording.configuration_attachment import ATTACHMENT_NAME
from ..recording.decisions_without_inputs import print_omissions
from ..recording.fleet_topics import NO_NAMESPACE
from ..recording.read_episode import Summary, summaries
from ..report.fleet_table import fleet_text


def main(args: list[str]) -> int:
    """Describe a bag."""
    parser = Parser(
        prog="mfba info", description="Print the contents of a bag, and the result of its run."
    )
    parser.add_bag()
    bag = bag_in(parser.parse(args).bag)
    info = describe(bag)
    print(format_info(info))
    if any(name == ATTACHMENT_NAME for name, _, _ in info.attachments):
        try:
            runs = summaries(bag, salvage=not info.complete)
        except BagError as error:
            print(f"Run:         {error}")
        else:
            print()
            _print_runs(runs)
            print_omissions(bag, {robot: run.omitted for robot, run in runs.items()})
    return 0


def _print_runs(runs: dict[str, Summary]) -> None:
    if NO_NAMESPACE in runs:
        run = runs[NO_NAMESPACE]
        show(run.episode, run.result)
    else:
        print(fleet_text(list(runs), [run.result for run in runs.values()]), end="")
    for robot, run in runs.items():
        print(" ".join(filter(None, ("digest", robot, run.digest))))
