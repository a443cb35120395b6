# SPDX-License-Identifier: Apache-2.0
"""`mfba check-optimizer`: check that optimisers keep budget, region and seed; needs no ROS."""

from __future__ import annotations

from ..core.argument_parser import Parser
from ..core.errors import MfbaError
from ..core.option_specs import require_range
from ..evaluation.optimizer_check import BUDGET, PATIENCE_S, POPULATION, check
from ..optimizers.registry import NAMES, NONE

_DESCRIPTION = f"""Check optimisers, as planner.optimizer names them, in the disc of one goal step
with {BUDGET} evaluations and a population of {POPULATION}: one line for each property."""


def main(args: list[str]) -> int:
    """Check; 0 if every optimiser has every property."""
    parser = Parser(prog="mfba check-optimizer", description=_DESCRIPTION)
    parser.add_argument(
        "names",
        nargs="+",
        metavar="NAME",
        help=f"{', '.join(name for name in NAMES if name != NONE)}; or MODULE:NAME",
    )
    parser.add_argument(
        "--patience",
        type=float,
        default=PATIENCE_S,
        metavar="S",
        help=f"wall time, s, after which a search does not end (default: {PATIENCE_S:g})",
    )
    parsed = parser.parse(args)
    require_range("--patience", parsed.patience, 0, 3600, "s", above=True)
    refused = []
    for name in parsed.names:
        properties = check(name, parsed.patience)
        print(name)
        faults = []
        for found in properties:
            print(f"  {found}", flush=True)
            if not found.ok:
                faults.append(f"{found.name} ({found.text})")
        if faults:
            refused.append(f"optimizer {name}: refused: {'; '.join(faults)}")
    if refused:
        raise MfbaError("; ".join(refused))
    return 0
