# SPDX-License-Identifier: Apache-2.0
"""Write and read a run's result as JSON: scenario, parameters, versions, digest, metrics."""

from __future__ import annotations

import json
import math
import platform
from collections.abc import Mapping
from dataclasses import asdict
from enum import Enum
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np

from mfba_planner import __version__
from mfba_planner.core.errors import InputError
from mfba_planner.core.input_files import read_input_text
from mfba_planner.core.option_specs import flatten
from mfba_planner.core.output_files import write_new
from mfba_planner.evaluation.metrics import Result, evaluate
from mfba_planner.scenarios.scenario_json import scenario_to_dict
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.episode import Episode, Outcome

SCHEMA_VERSION = 1
_KINDS = {
    "schema_version": int,
    "scenario": str,
    "world": dict,
    "seed": int,
    "driver": str,
    "algorithm": str,
    "parameters": dict,
    "versions": dict,
    "digest": str,
    "result": dict,
    "extra": dict,
}
_OPTIONAL = {"world"}  # keys that the oldest results lack


def result_to_dict(episode: Episode, extra: Mapping[str, Any] = {}) -> dict[str, Any]:
    """The content of a result file, in plain JSON values.

    world: the whole scenario, as in scenario files (the oldest results lack it). parameters: the
    flattened options of planner and sensor. extra: what the caller adds (wall time, file names).
    JSON has no infinity, so null stands for a number that is not finite: fitness is null if the
    robot never moved, min_clearance_m if there are no obstacles.
    """
    return {
        "schema_version": SCHEMA_VERSION,
        "scenario": episode.scenario.name,
        "world": scenario_to_dict(episode.scenario),
        "seed": episode.seed,
        "driver": episode.driver,
        "algorithm": episode.label,
        "parameters": {
            "planner": plain(flatten(episode.planner)),
            "sensor": plain(flatten(episode.sensor)),
        },
        "versions": {
            "mfba_planner": __version__,
            "python": platform.python_version(),
            "numpy": np.__version__,
        },
        "digest": digest(episode.ticks),
        "result": plain(asdict(evaluate(episode))),
        "extra": plain(extra),
    }


def plain(value: Any) -> Any:
    """Convert a value to plain JSON values; numbers that are not finite become None."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, Enum):
        return plain(value.value)
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, (np.generic, np.ndarray)):
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def write_result(path: Path, data: Mapping[str, Any]) -> None:
    """Write a result file; OutputError when it exists already or cannot be written."""
    text = json.dumps(data, indent=2, allow_nan=False)
    write_new(path, f"{text}\n".encode())


def read_result(path: Path) -> dict[str, Any]:
    """Read a result file; InputError for anything else."""
    try:
        text = read_input_text(path)
    except UnicodeDecodeError:
        raise _refused(path, "not a text file") from None
    except OSError as error:
        raise _refused(path, (error.strerror or str(error)).lower()) from None
    try:
        data = json.loads(text, parse_constant=_no_constant)
    except (ValueError, RecursionError):
        raise _refused(path, "not JSON, or cut short") from None
    fault = _fault(data)
    if fault:
        raise _refused(path, fault)
    return data


def _no_constant(token: str) -> None:
    raise ValueError(token)


def _refused(path: Path, reason: str) -> InputError:
    return InputError(f"{path}: {reason}; give a result .json that a run has written")


def _fault(data: Any) -> str:
    """Why data is not a result, "" if it is one."""
    if not isinstance(data, dict):
        return f"of type {type(data).__name__}, not a mapping"
    version = data.get("schema_version")
    if version != SCHEMA_VERSION:
        return f"schema_version={version!r} is unknown (this is version {SCHEMA_VERSION})"
    for key, kind in _KINDS.items():
        if key not in data:
            if key in _OPTIONAL:
                continue
            return f"{key} is missing"
        if type(data[key]) is not kind:
            return f"{key} is of type {type(data[key]).__name__}, not {kind.__name__}"
    return _result_fault(data["result"])


def _result_fault(result: Mapping[str, Any]) -> str:
    for key, kind in get_type_hints(Result).items():
        if key not in result:
            return f"result.{key} is missing"
        if not _fits(result[key], kind):
            return f"result.{key}={result[key]!r} makes no sense"
    return ""


def _fits(value: Any, kind: Any) -> bool:
    """Whether a JSON value fits a field of Result of this type; a float may be null."""
    if kind is Outcome:
        return value in [outcome.value for outcome in Outcome]
    if kind is float:
        return value is None or type(value) in (int, float)
    if kind in (bool, int):
        return type(value) is kind
    return isinstance(value, list) and all(type(item) is int for item in value)
