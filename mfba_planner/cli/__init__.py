# SPDX-License-Identifier: Apache-2.0
"""The user command `mfba`: one module per subcommand, loaded when it is called."""

from __future__ import annotations

from importlib import import_module

from .. import __version__
from ..core.errors import ConfigError
from ..core.options import did_you_mean

# Each is a module here with main(args) -> exit code.
COMMANDS = {
    "run": "run an episode in ROS 2, record it and judge it",
    "sim": "the same decisions without ROS: one seed or many",
    "replay": "publish a bag's messages again (ROS 2)",
    "info": "what a bag holds, and how its run went",
    "digest": "the decision digest of a bag or a result",
    "verify": "decide again on what a bag recorded, and compare bit for bit",
    "diff": "where the decisions of two bags first differ",
    "export": "a bag's ticks and decisions as one tidy table, CSV or Parquet",
    "recover": "make an ordinary bag of one that was killed or truncated",
    "picture": "draw the run that a bag holds",
    "animate": "a run as an animated WebP or GIF",
    "view": "runs in Rerun's viewer",
    "report": "runs as one page for a browser, to play and scrub",
    "figures": "the paper's figures again, as SVG and PNG",
    "sensitivity": "what hangs on what the paper does not say",
    "scenarios": "list the worlds that are shipped",
    "options": "list what --set can change",
    "sweep": "planners in worlds without number: success, gap to the optimum, side by side",
    "show": "explain a run of a sweep: picture, words, bag",
    "tables": "the paper's tables again, ours beside the printed, with verdicts",
}


def main(args: list[str]) -> int:
    """Do what args say; return the exit code. MfbaErrors pass through."""
    first = args[0] if args else "--help"
    if first in ("-h", "--help"):
        print(_usage())
        return 0
    if first == "--version":
        print(f"mfba {__version__}")
        return 0
    if first not in COMMANDS:
        raise ConfigError(f"{first}: unknown command; {did_you_mean(first, list(COMMANDS))}")
    code: int = import_module(f"{__name__}.{first}").main(args[1:])
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
            "`mfba COMMAND --help` tells more; `mfba --version` the version.",
        ]
    )
