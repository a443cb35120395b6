# SPDX-License-Identifier: Apache-2.0
"""Scenarios from YAML: checked at the door, degrees turned into radians, names looked up."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from .core.errors import ConfigError
from .core.options import did_you_mean
from .core.world import Obstacle, Scenario, Walls
from .resources import scenario_names, scenario_path

_Number = Annotated[float, Field(allow_inf_nan=False, strict=True, ge=-1e6, le=1e6)]
_Positive = Annotated[float, Field(allow_inf_nan=False, strict=True, gt=0.0, le=1e6)]
_NotNegative = Annotated[float, Field(allow_inf_nan=False, strict=True, ge=0.0, le=1e6)]
_Point = tuple[_Number, _Number]
_DEFAULTS: dict[str, Any] = {
    name: field.default for name, field in Scenario.__dataclass_fields__.items()
}


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


class _Obstacle(_Strict):
    center_m: _Point
    radius_m: _Positive
    speed_mps: _NotNegative = 0.0
    heading_deg: _Number | None = None
    heading_rad: _Number | None = None  # what programs write: degrees would lose the last bit

    def build(self) -> Obstacle:
        if self.heading_deg is not None and self.heading_rad is not None:
            raise ConfigError("obstacles: heading_deg and heading_rad given; keep one of them")
        return Obstacle(
            center_m=self.center_m,
            radius_m=self.radius_m,
            speed_mps=self.speed_mps,
            heading_rad=self.heading_rad or math.radians(self.heading_deg or 0.0),
        )


class _Walls(_Strict):
    lower_m: _Point
    upper_m: _Point


class _Scenario(_Strict):
    name: Annotated[str, Field(min_length=1, max_length=100)]
    description: str = ""
    start_m: _Point
    goal_m: _Point
    robot_radius_m: _Positive = _DEFAULTS["robot_radius_m"]
    obstacles: list[_Obstacle] = []
    walls: _Walls | None = None
    time_limit_s: _Positive = _DEFAULTS["time_limit_s"]

    def build(self) -> Scenario:
        walls = self.walls
        if walls and not all(a < b for a, b in zip(walls.lower_m, walls.upper_m)):
            raise ConfigError(
                f"walls {list(walls.lower_m)} to {list(walls.upper_m)}: "
                "give lower_m below upper_m on both axes"
            )
        return Scenario(
            name=self.name,
            description=self.description,
            start_m=self.start_m,
            goal_m=self.goal_m,
            robot_radius_m=self.robot_radius_m,
            obstacles=tuple(obstacle.build() for obstacle in self.obstacles),
            walls=Walls(lower_m=walls.lower_m, upper_m=walls.upper_m) if walls else None,
            time_limit_s=self.time_limit_s,
        )


def load_scenario(source: str) -> Scenario:
    """Load a scenario by the name of a shipped one, by file, or from YAML/JSON text ('{...').

    Raises ConfigError in one line for whatever cannot be a scenario.
    """
    if source.lstrip().startswith("{"):
        return parse_scenario(source, "inline scenario")
    path = Path(source)
    if path.suffix in (".yaml", ".yml") or path.exists():
        return parse_scenario(_read(path), str(path))
    known = scenario_names()
    if source not in known:
        raise ConfigError(
            f"{source!r}: no such scenario; {did_you_mean(source, known)} (or give a .yaml file)"
        )
    return parse_scenario(_read(scenario_path(source)), source)


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise ConfigError(f"{path}: {reason}; give a readable scenario .yaml") from None


def parse_scenario(text: str, origin: str) -> Scenario:
    """Turn YAML text into a Scenario; ConfigError names origin, value, reason and remedy."""
    try:
        data = yaml.safe_load(text)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f" line {mark.line + 1}" if mark else ""
        raise ConfigError(
            f"{origin}{where}: not YAML; compare config/scenarios/case1.yaml"
        ) from None
    if data is None:
        raise ConfigError(f"{origin}: empty; compare config/scenarios/case1.yaml")
    if not isinstance(data, dict):
        raise ConfigError(
            f"{origin}: a {type(data).__name__}, not a mapping; compare config/scenarios/case1.yaml"
        )
    try:
        return _Scenario.model_validate(data).build()
    except ValidationError as error:
        raise ConfigError(f"{origin}: {_explain(error)}") from None
    except ConfigError as error:
        raise ConfigError(f"{origin}: {error}") from None


def _explain(error: ValidationError) -> str:
    """The first fault in one line: place, value, reason, remedy."""
    fault = error.errors(include_url=False)[0]
    place = ".".join(str(part + 1 if isinstance(part, int) else part) for part in fault["loc"])
    if fault["type"] == "extra_forbidden":
        known = _keys_at(fault["loc"])
        return f"{place}: unknown key; {did_you_mean(str(fault['loc'][-1]), known)}"
    if fault["type"] == "missing":
        return f"{place}: missing; add it (compare config/scenarios/case1.yaml)"
    message = fault["msg"].replace("Input should be", "give")
    return f"{place}={fault['input']!r}: refused; {message}"


def _keys_at(location: tuple[Any, ...]) -> list[str]:
    models: dict[Any, type[BaseModel]] = {"obstacles": _Obstacle, "walls": _Walls}
    head = location[0] if len(location) > 1 else None
    return list(models.get(head, _Scenario).model_fields)


def scenario_to_dict(scenario: Scenario) -> dict[str, Any]:
    """The scenario as plain data that load_scenario accepts and turns into an equal one."""
    plain: dict[str, Any] = json.loads(json.dumps(asdict(scenario)))
    return plain


def scenario_to_json(scenario: Scenario) -> str:
    """One line of JSON that load_scenario accepts; the same scenario always gives the same."""
    return json.dumps(scenario_to_dict(scenario), sort_keys=True)
