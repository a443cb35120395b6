# SPDX-License-Identifier: Apache-2.0
"""Helper: the stored numbers of `mfba tables --quick`, and a run's numbers in that form."""

import hashlib
from typing import Any

import numpy as np
from project import ROOT

STORED = ROOT / "test/data/tables_quick.json"


def numbers(made: Any) -> dict[str, dict[str, Any]]:
    return {
        f"{n['place']}/{n['row']}/{n['column']}": n for s in made["sections"] for n in s["numbers"]
    }


def flat(made: Any) -> dict[str, Any]:
    """Every computed number: {key: value or [middle, low, high]}."""
    found: dict[str, Any] = {}
    for key, n in numbers(made).items():
        for reading, ours in n["ours"].items():
            found[f"{key}/{reading}"] = short(ours["value"])
    for section in made["sections"]:
        for name, grid in section["grids"].items():
            for i, row in enumerate(grid["rows"]):
                for j, value in enumerate(row):
                    found[f"{section['key']}/{name}/{i}/{j}"] = short(value)
    return found


def short(value: Any) -> Any:
    return [value["middle"], value["low"], value["high"]] if isinstance(value, dict) else value


def libm() -> str:
    """A hash of numpy's sin, cos and exp, which may differ between machines in the last bit."""
    x = np.linspace(-20.0, 20.0, 20_001)
    bits = b"".join(f(x).tobytes() for f in (np.sin, np.cos, np.exp))
    return hashlib.sha256(bits).hexdigest()[:16]
