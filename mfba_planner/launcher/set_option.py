# SPDX-License-Identifier: Apache-2.0
"""`--set NAME=VALUE`: the option, the names it accepts, and how values are applied."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from typing import Any

from ..core.errors import ConfigError
from ..core.option_specs import did_you_mean, flatten, override, walk
from ..core.robot_base import Base
from ..perception.sensory_vector import SensorParams
from ..planning.planner_params import PlannerParams
from ..simulation.robot_model import Robot

# Options of a planner that the scenario sets.
OF_ROBOT = {"robot_radius_m": "set robot_radius_m in the scenario file"} | {
    name: f"give robot.{name}" for name in flatten(Base())
}

OPTIMIZER, METHOD = "planner.optimizer", "planner.method"
_SAME = {"optimizer": OPTIMIZER, "planner": METHOD, "algorithm": "planner.bat.algorithm"}


def add_set_argument(parser: argparse.ArgumentParser) -> None:
    """Add --set, which may be repeated."""
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        dest="settings",
        help="an option of planner, sensor or robot, such as planner.bat.population=30; "
        "`mfba options` lists them",
    )


def add_optimizer_argument(parser: argparse.ArgumentParser) -> None:
    """Add --optimizer, short for --set planner.optimizer=NAME."""
    parser.add_argument(
        "--optimizer", metavar="NAME", help=f"the same as --set {OPTIMIZER}=NAME (default: bats)"
    )


def settings_of(parsed: argparse.Namespace) -> list[str]:
    """The settings of --set and --optimizer.

    Raises ConfigError for a setting that contradicts an option of the same meaning.
    """
    settings: list[str] = parsed.settings
    for option, name in _SAME.items():
        value = getattr(parsed, option, None)
        if isinstance(value, str):  # not several planners, each with its method
            refuse_other(f"--{option} {value}", f"{name}={value}", settings)
    if parsed.optimizer is None:
        return settings
    return [*settings, f"{OPTIMIZER}={parsed.optimizer}"]


def refuse_other(given: str, wanted: str, settings: list[str]) -> None:
    """Raise ConfigError for a setting NAME=VALUE of the same name as wanted, but another value."""
    name, _, _ = wanted.partition("=")
    for text in settings:
        if text.startswith(f"{name}=") and text != wanted:
            raise ConfigError(f"{given}: --set {text}; leave one of them out")


def with_settings(
    planner: PlannerParams, sensor: SensorParams, settings: list[str]
) -> tuple[PlannerParams, SensorParams]:
    """Both with the changes of --set; ConfigError for an unknown name or a bad value."""
    changes = dict(map(_setting, settings))
    for name in _below("robot", changes):
        raise ConfigError(f"--set robot.{name}: the scenario sets the robot; leave it out")
    return (
        override(planner, _below("planner", changes)),
        override(sensor, _below("sensor", changes)),
    )


def with_robot_settings(robot: Robot, settings: list[str]) -> tuple[Robot, list[str]]:
    """The robot with the robot.NAME=VALUE changes of --set, and the other settings."""
    changes, others = robot_changes(settings)
    return override(robot, changes), others


def robot_changes(settings: list[str]) -> tuple[dict[str, Any], list[str]]:
    """The robot.NAME=VALUE changes of --set by name, and the other settings."""
    of_robot = [text for text in settings if text.startswith("robot.")]
    others = [text for text in settings if text not in of_robot]
    return _below("robot", dict(map(_setting, of_robot))), others


def option_rows() -> Iterable[tuple[str, Any, Any]]:
    """(name for --set, default, Spec) of every option."""
    for group, defaults in (
        ("planner", PlannerParams()),
        ("sensor", SensorParams()),
        ("robot", Robot()),
    ):
        for name, value, item in walk(defaults):
            if group != "planner" or name not in OF_ROBOT:
                yield f"{group}.{name}", value, item.metadata["spec"]


def _setting(text: str) -> tuple[str, Any]:
    name, found, value = text.partition("=")
    if not found:
        raise ConfigError(f"--set {text}: no value; give NAME=VALUE")
    group, _, of_robot = name.partition(".")
    if group == "planner" and of_robot in OF_ROBOT:
        raise ConfigError(
            f"--set {name}: the planner's robot is the scenario's; {OF_ROBOT[of_robot]}"
        )
    known = [row[0] for row in option_rows()]
    if name not in known:
        raise ConfigError(f"--set {name}: unknown option; {did_you_mean(name, known)}")
    return name, _literal(value)


def _literal(text: str) -> Any:
    """The number or bool that text spells, otherwise text itself."""
    if text in ("true", "false"):
        return text == "true"
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _below(group: str, changes: dict[str, Any]) -> dict[str, Any]:
    head = f"{group}."
    return {name[len(head) :]: value for name, value in changes.items() if name.startswith(head)}
