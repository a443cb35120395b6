# SPDX-License-Identifier: Apache-2.0
"""Numbers, points and mappings of scenario files, as pydantic checks them."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import ConfigDict, Field

from .scenario_json import LIMIT

STRICT = ConfigDict(extra="forbid")  # of a mapping without unknown keys
Number = Annotated[float, Field(allow_inf_nan=False, strict=True, ge=-LIMIT, le=LIMIT)]
Positive = Annotated[float, Field(allow_inf_nan=False, strict=True, gt=0.0, le=LIMIT)]
NotNegative = Annotated[float, Field(allow_inf_nan=False, strict=True, ge=0.0, le=LIMIT)]
Point = tuple[Number, Number]


def default(kind: type, name: str) -> Any:
    """The default of a dataclass field, so that it is defined only once."""
    return kind.__dataclass_fields__[name].default  # type: ignore[attr-defined]
