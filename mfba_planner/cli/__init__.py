# SPDX-License-Identifier: Apache-2.0
"""The user command `mfba`: one module per subcommand, loaded when it is called."""

from __future__ import annotations

from importlib import import_module
from keyword import iskeyword

from .. import __version__
from ..core.errors import ConfigError

# Each is a module of this package with main(args) -> exit code.
COMMANDS = {
    "run": "run an episode in ROS 2, record it and evaluate it",
    "sim": "simulate without ROS, with the same decisions: one seed or many",
    "replay": "publish a bag's messages again (ROS 2)",
    "info": "contents of a bag, and the result of its run",
    "digest": "decision digest of a bag or a result",
    "verify": "recompute the decisions of a bag, and compare bit for bit",
    "decide": "decide anew on the scans and odometry of any recording, and show it",
    "diff": "first difference between the decisions of two bags",
    "export": "write a bag's ticks and decisions as one table, CSV or Parquet",
    "recover": "copy the intact messages of a broken bag into a new one",
    "picture": "draw the run of a bag as PNG",
    "animate": "write a run as an animated WebP or GIF",
    "view": "show runs in Rerun's viewer",
    "report": "write runs as one HTML page, with playback",
    "figures": "reproduce the paper's figures, as SVG and PNG",
    "sensitivity": "vary what the paper leaves open, and compare the results",
    "scenarios": "list the shipped scenarios",
    "options": "list the options of --set",
    "import": "make scenario files of Gazebo worlds, recordings and other formats",
    "sweep": "run planners in many worlds, generated or your own: success, gap to the optimum",
    "show": "explain one run of a sweep: pictures, text, bag",
    "compare": "compare optimisers in the same planners, worlds and budgets",
    "check-optimizer": "check that an optimiser keeps budget, region and seed",
    "tables": "reproduce the paper's tables: our value, printed value, verdict",
}


def main(args: list[str]) -> int:
    """Run the command in args; return the exit code. MfbaErrors pass through."""
    first = args[0] if args else "--help"
    if first in ("-h", "--help"):
        print(_usage())
        return 0
    if first == "--version":
        print(f"mfba {__version__}")
        return 0
    if first not in COMMANDS:
        from ..core.option_specs import did_you_mean

        raise ConfigError(f"{first}: unknown command; {did_you_mean(first, list(COMMANDS))}")
    module = f"{first}_" if iskeyword(first) else first.replace("-", "_")
    code: int = import_module(f"{__name__}.{module}").main(args[1:])
    return code


def _usage() -> str:
    width = max(map(len, COMMANDS))
    lines = [f"  {name:<{width}}  {what}" for name, what in COMMANDS.items()]
    return "\n".join(
        [
            "usage: mfba COMMAND [ARGUMENT ...]",
            "",
            "Path planning among moving obstacles with the modified frequency bat algorithm.",
            "",
            *lines,
            "",
            "`mfba COMMAND --help`: arguments of a command; `mfba --version`: the version.",
        ]
    )
