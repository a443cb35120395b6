# SPDX-License-Identifier: Apache-2.0
"""Helper: runs launch files without `launch` (not on PyPI): their arguments and their nodes.

Replaces the few names of launch and launch_ros that launch/*.py use by stubs with the same
signatures, which store their arguments. The real launch is not tested with it: where launch is
installed, test_launch_file reads the files with it.
"""

import runpy
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
import yaml
from project import ROOT

LAUNCH = ROOT / "launch"


@dataclass(kw_only=True)
class Node:
    """launch_ros.actions.Node: a process to start."""

    package: str
    executable: str
    name: str
    namespace: str = ""
    output: str = "log"
    parameters: Sequence[Any] = ()
    remappings: Sequence[tuple[str, str]] = ()
    arguments: Sequence[str] = ()
    on_exit: Any = None

    def ended(self, returncode: int, *, is_shutdown: bool = False) -> Any:
        """The action that launch takes when the process has ended."""
        event = SimpleNamespace(returncode=returncode)
        (action,) = self.on_exit(event, SimpleNamespace(is_shutdown=is_shutdown))
        return action

    @property
    def full_name(self) -> str:
        """NAMESPACE/NAME."""
        return f"{self.namespace}/{self.name}".lstrip("/")

    def command_line(self, folder: Path) -> list[str]:
        """The arguments as launch_ros builds them: parameters in files, later ones override."""
        arguments = [*self.arguments, "--ros-args", "-r", f"__node:={self.name}"]
        arguments += ["-r", f"__ns:=/{self.namespace}"] if self.namespace else []
        for number, entry in enumerate(self.parameters):
            if isinstance(entry, dict):
                values = {name: getattr(value, "value", value) for name, value in entry.items()}
                entry = folder / f"{self.full_name.replace('/', '_')}{number}.yaml"
                entry.write_text(yaml.safe_dump({"/**": {"ros__parameters": values}}))
            arguments += ["--params-file", str(entry)]
        return arguments + [w for a, b in self.remappings for w in ("-r", f"{a}:={b}")]


@dataclass
class _Declared:
    name: str
    default_value: str = field(kw_only=True)
    description: str = field(kw_only=True)
    choices: list[str] | None = field(kw_only=True)


@dataclass(kw_only=True)
class _Function:
    function: Callable[[Any], list[Node]]


@dataclass(kw_only=True)
class _Shutdown:
    reason: str


@dataclass
class _Configuration:
    name: str

    def perform(self, context: Mapping[str, str]) -> str:
        return context[self.name]


@dataclass
class _Value:
    value: Any
    value_type: type = field(kw_only=True)


@dataclass
class _Description:
    entities: list[Any]


_NAMES: dict[str, dict[str, Any]] = {
    "launch": {},
    "launch.actions": {
        "DeclareLaunchArgument": _Declared,
        "OpaqueFunction": _Function,
        "Shutdown": _Shutdown,
    },
    "launch.events": {},
    "launch.events.process": {"ProcessExited": object},
    "launch.launch_context": {"LaunchContext": dict},
    "launch.launch_description": {"LaunchDescription": _Description},
    "launch.substitutions": {"LaunchConfiguration": _Configuration},
    "launch_ros": {},
    "launch_ros.actions": {"Node": Node},
    "launch_ros.parameter_descriptions": {"ParameterValue": _Value},
}
_OURS = "mfba_planner.launcher.launch_actions"


@contextmanager
def _stub_modules() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        for name, names in _NAMES.items():
            module = ModuleType(name)
            vars(module).update(names)
            patch.setitem(sys.modules, name, module)
        patch.delitem(sys.modules, _OURS, raising=False)
        yield
        sys.modules.pop(_OURS, None)


def _entities(file: str, kind: type) -> list[Any]:
    description = runpy.run_path(str(LAUNCH / file))["generate_launch_description"]()
    return [entity for entity in description.entities if isinstance(entity, kind)]


def declared(file: str) -> dict[str, tuple[str, str, list[str] | None]]:
    """Default, description and choices of every argument, as `--show-args` prints them."""
    with _stub_modules():
        found = _entities(file, _Declared)
    return {e.name: (e.default_value, e.description, e.choices) for e in found}


def launched(file: str, given: Mapping[str, str]) -> list[Node]:
    """The nodes that `ros2 launch mfba_planner FILE NAME:=VALUE...` starts, in sequence."""
    with _stub_modules():
        declared = {entity.name: entity for entity in _entities(file, _Declared)}
        assert set(given) <= set(declared), f"{file}: {given}"
        for name, value in given.items():
            assert value in (declared[name].choices or [value]), f"{name}:={value}"
        values = {name: argument.default_value for name, argument in declared.items()} | dict(
            given
        )
        (function,) = _entities(file, _Function)
        return list(function.function(values))
