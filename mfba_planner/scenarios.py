# SPDX-License-Identifier: Apache-2.0
"""Scenarios from YAML: checked at the door, degrees turned into radians, names looked up."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from .core.errors import ConfigError
from .core.options import did_you_mean, override
from .core.robot import Robot
from .core.world import Kidnapping, Obstacle, Scenario, Turn, Walls
from .resources import scenario_names, scenario_path

_EXAMPLE = "compare config/scenarios/case1.yaml"
_Number = Annotated[float, Field(allow_inf_nan=False, strict=True, ge=-1e6, le=1e6)]
_Positive = Annotated[float, Field(allow_inf_nan=False, strict=True, gt=0.0, le=1e6)]
_NotNegative = Annotated[float, Field(allow_inf_nan=False, strict=True, ge=0.0, le=1e6)]
_Point = tuple[_Number, _Number]
# Names end up in messages and in file names.
_Name = Annotated[str, Field(max_length=100, pattern=r"^\w[\w .+-]*$")]


def _default(kind: type, name: str) -> Any:
    """The core's default; it is written down there and only there."""
    return kind.__dataclass_fields__[name].default  # type: ignore[attr-defined]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


class _Heading(_Strict):
    heading_deg: _Number | None = None
    heading_rad: _Number | None = None  # what programs write: degrees would lose the last bit

    def heading(self) -> float:
        if self.heading_deg is not None and self.heading_rad is not None:
            raise ConfigError(
                f"heading_deg={self.heading_deg:g}: heading_rad={self.heading_rad:g} is given "
                "as well; keep one of them"
            )
        if self.heading_rad is None:
            return math.radians(self.heading_deg or 0.0)
        return self.heading_rad


class _Turn(_Heading):
    at_s: _Positive
    speed_mps: _NotNegative

    def build(self) -> Turn:
        return Turn(at_s=self.at_s, speed_mps=self.speed_mps, heading_rad=self.heading())


class _Obstacle(_Heading):
    center_m: _Point
    radius_m: _Positive
    speed_mps: _NotNegative = _default(Obstacle, "speed_mps")
    turns: list[_Turn] = []

    def build(self) -> Obstacle:
        return Obstacle(
            center_m=self.center_m,
            radius_m=self.radius_m,
            speed_mps=self.speed_mps,
            heading_rad=self.heading(),
            turns=tuple(turn.build() for turn in self.turns),
        )


class _Walls(_Strict):
    lower_m: _Point
    upper_m: _Point


class _Kidnapping(_Strict):
    at_s: _Positive
    to_m: _Point

    def build(self) -> Kidnapping:
        return Kidnapping(at_s=self.at_s, to_m=self.to_m)


class _Scenario(_Strict):
    name: _Name
    description: str = _default(Scenario, "description")
    start_m: _Point
    goal_m: _Point
    robot_radius_m: _Positive = _default(Scenario, "robot_radius_m")
    obstacles: list[_Obstacle] = []
    walls: _Walls | None = None
    time_limit_s: _Positive = _default(Scenario, "time_limit_s")
    robot: dict[str, Any] = {}
    kidnappings: list[_Kidnapping] = []

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
            robot=_robot(self.robot),
            kidnappings=tuple(kidnapping.build() for kidnapping in self.kidnappings),
        )


def _robot(told: dict[str, Any]) -> Robot:
    """The options of core.robot, named as there, nested or with dots."""
    try:
        return override(Robot(), dict(_dotted(told)))
    except ConfigError as error:
        raise ConfigError(f"robot.{error}") from None


def _dotted(told: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in told.items():
        if isinstance(value, dict):
            yield from _dotted(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def load_scenario(source: str) -> Scenario:
    """Load a scenario by the name of a shipped one, by file, or from YAML/JSON text ('{...').

    Raises ConfigError in one line for whatever cannot be a scenario.
    """
    if source.lstrip().startswith("{"):
        return parse_scenario(source, "inline scenario")
    if source.endswith((".yaml", ".yml", ".json")):
        return parse_scenario(_read(Path(source)), source)
    known = scenario_names()
    if source in known:
        return parse_scenario(_read(scenario_path(source)), source)
    if os.path.isfile(source):
        return parse_scenario(_read(Path(source)), source)
    raise ConfigError(
        f"{source!r}: no such scenario; {did_you_mean(source, known)} (or give a .yaml file)"
    )


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:  # ValueError: not UTF-8, or a path with a NUL
        reason = getattr(error, "strerror", None) or "not a text file"
        raise ConfigError(f"{path}: {reason}; give a readable scenario .yaml") from None


class _Loader(yaml.SafeLoader):
    """YAML as people expect it: 1e-3 is a number, and a key given twice is a mistake."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> Any:
        """Refuse what SafeLoader would settle in silence: the last of two equal keys."""
        keys = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode):
                if key.value in keys:
                    problem = f"{key.value!r} given twice"
                    raise yaml.MarkedYAMLError(problem=problem, problem_mark=key.start_mark)
                keys.add(key.value)
        return super().construct_mapping(node, deep)


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)[eE][-+]?[0-9]+$"),
    list("-+.0123456789"),
)


def parse_scenario(text: str, origin: str) -> Scenario:
    """Turn YAML or JSON text into a Scenario.

    Raises ConfigError naming origin, value, reason and remedy.
    """
    data = _plain(text, origin)
    if data is None:
        raise ConfigError(f"{origin}: empty; {_EXAMPLE}")
    if not isinstance(data, dict):
        raise ConfigError(f"{origin}: a {type(data).__name__}, not a mapping; {_EXAMPLE}")
    try:
        return _Scenario.model_validate(data).build()
    except ValidationError as error:
        raise ConfigError(f"{origin}: {_explain(error)}") from None
    except ConfigError as error:
        raise ConfigError(f"{origin}: {error}") from None


def _plain(text: str, origin: str) -> Any:
    """What the text holds; JSON first, since YAML reads some of JSON's escapes differently."""
    with suppress(ValueError, RecursionError):
        return json.loads(text)
    try:
        return yaml.load(text, Loader=_Loader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f" line {mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or "unreadable characters"
        raise ConfigError(f"{origin}{where}: not YAML ({problem}); {_EXAMPLE}") from None
    except (ValueError, LookupError, AttributeError, RecursionError):
        # what PyYAML raises for an impossible date, a misused tag, a bottomless nesting
        raise ConfigError(f"{origin}: not YAML (unreadable value); {_EXAMPLE}") from None


_REMEDIES = {
    "finite_number": "give a finite number",
    "float_type": "give a number",
    "list_type": "give a list ([] for none)",
    "missing": f"add it ({_EXAMPLE})",
    "model_type": f"give a mapping ({_EXAMPLE})",
    "string_pattern_mismatch": "give a name of letters, digits, spaces and _ . + -",
    "string_too_long": "give at most 100 characters",
    "string_type": "give a text",
    "too_long": "give two numbers, [x, y]",
    "tuple_type": "give two numbers, [x, y]",
}


def _explain(error: ValidationError) -> str:
    """One fault in one line: place, value, reason, remedy.

    An unknown key goes first: misspelt, it is why another one is missing.
    """
    faults = error.errors(include_url=False)
    fault = next((f for f in faults if f["type"] == "extra_forbidden"), faults[0])
    kind, location = fault["type"], fault["loc"]
    if kind == "invalid_key":
        return f"key {location[-1]}: not a word; remove it ({_EXAMPLE})"
    place = ".".join(str(part + 1 if isinstance(part, int) else part) for part in location)
    if kind == "extra_forbidden":
        return f"{place}: unknown key; {did_you_mean(str(location[-1]), _keys_at(location))}"
    if kind == "missing":
        return f"{place}: missing; {_REMEDIES[kind]}"
    remedy = _REMEDIES.get(kind) or fault["msg"].replace("Input should be", "give a number")
    value = repr(fault["input"])
    shown = value if len(value) <= 60 else f"{value[:57]}..."
    return f"{place}={shown}: refused; {remedy}"


def _keys_at(location: tuple[Any, ...]) -> list[str]:
    models: dict[Any, type[BaseModel]] = {
        "obstacles": _Obstacle,
        "turns": _Turn,
        "kidnappings": _Kidnapping,
        "walls": _Walls,
    }
    within = [models[part] for part in location[:-1] if part in models]
    return list((within or [_Scenario])[-1].model_fields)


def scenario_to_dict(scenario: Scenario) -> dict[str, Any]:
    """The scenario as plain data that load_scenario accepts and turns into an equal one."""
    plain: dict[str, Any] = json.loads(json.dumps(asdict(scenario), default=lambda e: e.value))
    # What a scenario does not use is left out: recordings compare scenarios as text.
    if scenario.robot == Robot():
        del plain["robot"]
    if not scenario.kidnappings:
        del plain["kidnappings"]
    for obstacle in plain["obstacles"]:
        if not obstacle["turns"]:
            del obstacle["turns"]
    return plain


def scenario_to_json(scenario: Scenario) -> str:
    """One line of JSON that load_scenario accepts; the same scenario always gives the same."""
    return json.dumps(scenario_to_dict(scenario), sort_keys=True)
