# SPDX-License-Identifier: Apache-2.0
"""`mfba options`: list the options of --set; needs no ROS."""

from __future__ import annotations

from enum import Enum
from typing import Any

from ..core.argument_parser import Parser
from ..core.option_specs import Spec, flatten
from ..launcher.set_option import option_rows
from ..planning.planner_factory import params_for_method
from ..planning.planner_params import PlannerParams


def main(args: list[str]) -> int:
    """List the options."""
    Parser(
        prog="mfba options",
        description="List the options of --set, for `mfba run` and `mfba sim`.",
    ).parse(args)
    rows = [
        (name, _value(default), _meaning(default, spec)) for name, default, spec in option_rows()
    ]
    widths = [max(len(row[column]) for row in rows) for column in (0, 1)]
    for name, default, meaning in rows:
        print(f"{name:<{widths[0]}}  {default:<{widths[1]}}  {meaning}")
    default_params = params_for_method(None, PlannerParams(), algorithm_1=False)
    changes = set(flatten(default_params).items()) - set(flatten(PlannerParams()).items())
    defaults = ", ".join(f"planner.{name}={value}" for name, value in sorted(changes))
    print(f"Defaults without --planner: {defaults}")
    return 0


def _value(default: Any) -> str:
    if isinstance(default, bool):
        return str(default).lower()
    return str(default.value if isinstance(default, Enum) else default)


def _meaning(default: Any, spec: Spec) -> str:
    notes = [spec.unit] if spec.unit else []
    if isinstance(default, Enum):
        notes.append(" | ".join(str(member.value) for member in type(default)))
    elif spec.minimum is not None and spec.maximum is not None:
        notes.append(f"{spec.minimum:g} to {spec.maximum:g}")
    return f"{spec.doc} [{', '.join(notes)}]" if notes else spec.doc
