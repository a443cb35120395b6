# SPDX-License-Identifier: Apache-2.0
"""`mfba scenarios`: list the shipped scenarios; needs no ROS."""

from __future__ import annotations

from ..core.argument_parser import Parser
from ..core.shipped_files import scenario_names, share_dir
from ..scenarios.scenario_files import load_scenario


def main(args: list[str]) -> int:
    """List the scenarios."""
    Parser(prog="mfba scenarios", description="List the shipped scenarios.").parse(args)
    names = scenario_names()
    width = max(map(len, names), default=0)
    for name in names:
        print(f"{name:<{width}}  {load_scenario(name).description}")
    print(f"files: {share_dir() / 'config' / 'scenarios'}")
    return 0
