# SPDX-License-Identifier: Apache-2.0
"""The command line parser: argparse, but a mistake raises a one-line ConfigError."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from .errors import ConfigError
from .option_specs import did_you_mean


class Parser(argparse.ArgumentParser):
    """A parser that raises a one-line ConfigError instead of printing its usage and exiting."""

    def __init__(self, **kwargs: Any) -> None:
        """Take argparse's keywords; abbreviations are off, as they would hide typing errors."""
        super().__init__(
            allow_abbrev=False, formatter_class=argparse.RawDescriptionHelpFormatter, **kwargs
        )

    def add_bag(self, name: str = "bag") -> None:
        """Add the argument for a bag to read; outputs.bag_in finds it in a run directory."""
        self.add_argument(
            name,
            type=Path,
            metavar="BAG",
            help="run or bag directory, or .mcap, .db3 or .bag file",
        )

    def add_robots(self) -> None:
        """Add --robot, which selects robots of a fleet's bag."""
        self.add_argument(
            "--robot",
            dest="robots",
            action="append",
            default=[],
            metavar="NAME",
            help="of a fleet's bag this robot only (may be given several times)",
        )

    def parse(self, args: Sequence[str]) -> argparse.Namespace:
        """Parse all of args; ConfigError for an argument that is unknown, missing or refused."""
        found, unknown = self.parse_known_args(args)
        if unknown:
            known = [name for name in self._option_string_actions if name.startswith("--")]
            word = unknown[0].partition("=")[0]
            hint = did_you_mean(word, known) if word.startswith("-") else self._help_hint()
            raise ConfigError(f"{unknown[0]}: unknown argument; {hint}")
        return found

    def error(self, message: str) -> NoReturn:
        """Raise ConfigError."""
        raise ConfigError(f"{message.removeprefix('argument ')}; {self._help_hint()}")

    def _help_hint(self) -> str:
        return f"see `{self.prog} --help`"
