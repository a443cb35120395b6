# SPDX-License-Identifier: Apache-2.0
"""Fuzzing: whatever comes in is accepted or refused in one line, within 2 s of CPU.

    .venv/bin/python bench/fuzz.py scenario map import parameters bag messages --cases 1000
    .venv/bin/python bench/fuzz.py scenario --first 4711 --cases 1    # that case again

A case is a number: with the door's name it is the seed of its random changes. A failure is any
exception but an MfbaError, a RuntimeWarning, a line break in its message, or more CPU than 2 s.
Exit code 1 then. Ctrl-C or SIGTERM end a door early, and its counts are printed.
"""

from __future__ import annotations

import argparse
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
import zlib
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from types import FrameType
from typing import Any

import fuzz_doors
import numpy as np
from fuzz_nodes import Nodes
from rclpy.logging import LoggingSeverity, set_logger_level

from mfba_planner.core.errors import MfbaError

DOORS: dict[str, Any] = {
    "scenario": lambda _: fuzz_doors.scenario,
    "map": lambda _: fuzz_doors.world_map,
    "import": lambda _: fuzz_doors.importing,
    "parameters": lambda _: fuzz_doors.parameters,
    "bag": fuzz_doors.Bags,
    "messages": Nodes,
}
SLOW_S, TIMEOUT_S = 2.0, 60


class EndlessError(BaseException):
    """A case that does not end; no except clause of a door takes it."""


def _on_alarm(_signum: int, _frame: FrameType | None) -> None:
    raise EndlessError


def run_case(name: str, door: Any, number: int) -> str:
    """What became of a case: accepted, refused, or how it failed in several lines."""
    rng = np.random.default_rng([zlib.crc32(name.encode()), number])
    start_s = time.process_time()
    signal.alarm(TIMEOUT_S)
    try:
        with tempfile.TemporaryDirectory(prefix="mfba_fuzz_") as directory:
            door(rng, Path(directory))
        found = "accepted"
    except MfbaError as error:
        found = "refused" if "\n" not in str(error) else f"two lines: {error!r}"
    except (EndlessError, Exception) as error:
        found = "".join(traceback.format_exception(error)[-6:])
    finally:
        signal.alarm(0)
    took_s = time.process_time() - start_s
    return found if took_s < SLOW_S else f"slow: {took_s:.1f} s, {found}"


def main(argv: Sequence[str]) -> int:
    """Print failures and counts; 1 if there was a failure."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument(
        "doors", nargs="+", choices=list(DOORS), metavar="door", help=", ".join(DOORS)
    )
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--budget", type=float, default=1e9, help="s per door; no case after")
    options = parser.parse_args(argv)
    signal.signal(signal.SIGALRM, _on_alarm)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    warnings.simplefilter("error", RuntimeWarning)
    set_logger_level("", LoggingSeverity.FATAL)
    failed = 0
    for name in options.doors:
        counts, start_s = Counter[str](), time.monotonic()
        with tempfile.TemporaryDirectory(prefix="mfba_fuzz_") as directory:
            door = DOORS[name](Path(directory))
            for number in range(options.first, options.first + options.cases):
                try:
                    found = run_case(name, door, number)
                except KeyboardInterrupt:
                    break
                counts[found if found in ("accepted", "refused") else "failed"] += 1
                if number - options.first <= min(options.cases // 10, 1000):
                    early_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
                if found not in ("accepted", "refused"):
                    print(f"{name} {number}: {found}", flush=True)
                if time.monotonic() - start_s > options.budget:
                    break
        growth = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - early_kb) / 1024
        text = ", ".join(f"{count} {what}" for what, count in sorted(counts.items()))
        took_s = time.monotonic() - start_s
        print(
            f"{name}: {counts.total()} cases in {took_s:.0f} s, {text}, {growth:+.0f} MB",
            flush=True,
        )
        failed += counts["failed"]
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
