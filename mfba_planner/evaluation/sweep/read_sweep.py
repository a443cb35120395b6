# SPDX-License-Identifier: Apache-2.0
"""Read a directory of `mfba sweep`: its specification and the finished rows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...core.errors import ConfigError, InputError
from ...core.option_specs import override
from ...perception.sensory_vector import SensorParams
from ...planning.planner_params import PlannerParams
from ..study.chunk_store import code_digest, read_chunk, read_manifest
from ..suites.scenario_suite import from_facts
from .run_sweep import COMMAND, PACKAGES
from .sweep_chunks import chunks_of
from .sweep_spec import Setting, SweepSpec
from .table import build
from .table_columns import Row

_GIVE = f"give one that `{COMMAND}` has made"


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadSweep:
    """The contents of a directory; of an interrupted sweep, the finished rows."""

    spec: SweepSpec
    rows: list[Row]
    code_changed: bool


def read_sweep(directory: Path) -> ReadSweep:
    """Read a sweep. Raises InputError for no sweep, OutputError for a damaged manifest."""
    if not directory.is_dir():
        raise InputError(f"{directory}: no such directory; {_GIVE}")
    facts = read_manifest(directory, COMMAND, _GIVE)
    try:
        spec = _spec(facts)
    except (KeyError, TypeError, AttributeError, ConfigError) as error:
        raise InputError(
            f"{directory}: not of this version's `{COMMAND}` ({error}); sweep again"
        ) from None
    chunks = chunks_of(spec)
    found = {chunk.name: read_chunk(directory, chunk.name) for chunk in chunks}
    finished = [chunk for chunk in chunks if found[chunk.name] is not None]
    rows, _ = build(spec, finished, {name: c for name, c in found.items() if c is not None})
    return ReadSweep(
        spec=spec, rows=rows, code_changed=facts.get("code") != code_digest(*PACKAGES)
    )


def _spec(facts: dict[str, Any]) -> SweepSpec:
    setting = dict(facts["setting"])
    params = override(PlannerParams(), setting.pop("params"))
    sensor = override(SensorParams(), setting.pop("sensor"))
    setting["robot"] = tuple(setting["robot"].items())
    scenarios = from_facts(facts["scenarios"]) if "scenarios" in facts else None
    return SweepSpec(
        suite=facts["suite"],
        planners=tuple(facts["planners"]),
        worlds=facts["worlds"],
        first=facts["first"],
        seeds=facts["seeds"],
        oracle=facts["oracle"],
        setting=Setting(params=params, sensor=sensor, scenarios=scenarios, **setting),
        own={name: override(PlannerParams(), options) for name, options in facts["own"].items()},
    )
