# SPDX-License-Identifier: Apache-2.0
"""The user's own suite: scenario files, read once; from then on their content counts."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from ...core.errors import ConfigError
from ...core.input_files import read_input_text
from ...planning.planner_params import PlannerParams
from ...scenarios.scenario_files import load_scenario
from ...scenarios.scenario_json import scenario_to_json
from ...simulation.scenario import Scenario
from .named_suites import Suite, suite_names

ENDINGS = (".yaml", ".yml", ".json")
FILES = "scenarios"  # name of a suite that is a list of files
# A map of nav2's map_server lies beside the scenarios that name it.
_MAP = re.compile(r"^(image|resolution|origin)\s*:", re.MULTILINE)
_LARGEST_MAP_YAML = 10_000  # bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class ScenarioSet:
    """Scenarios as worlds of a suite, each as JSON by its number; some numbers may be missing.

    sources are the arguments of the command line that name the files, without folders.
    """

    name: str
    count: int
    worlds: Mapping[int, str]
    names: tuple[str, ...]  # of the scenarios, by number
    sources: tuple[str, ...] = ()

    def suite(self) -> Suite:
        """The suite; its worlds do not depend on a speed."""
        return Suite(
            name=self.name,
            description=f"{self.count} scenario files",
            number=-1,  # its worlds are not drawn from seeds
            make=lambda _, k, __: _parsed(self.worlds[k]),
            count=self.count,
            speed_mps=PlannerParams().speed_mps,
        )

    def only(self, numbers: Iterable[int]) -> ScenarioSet:
        """The same suite with the content of some worlds only, for a worker."""
        wanted = set(numbers)
        return replace(self, worlds={k: text for k, text in self.worlds.items() if k in wanted})

    def digest(self) -> str:
        """SHA-256 of the content."""
        text = "\n".join(f"{k} {self.worlds[k]}" for k in sorted(self.worlds))
        return hashlib.sha256(text.encode()).hexdigest()

    def facts(self) -> dict[str, Any]:
        """All of it as plain data; from_facts() makes an equal one of it."""
        worlds = [self.worlds[k] for k in range(self.count)]
        return {"name": self.name, "sources": list(self.sources), "worlds": worlds}


def from_facts(facts: Mapping[str, Any]) -> ScenarioSet:
    """The inverse of ScenarioSet.facts(). Raises ConfigError for what is no scenario."""
    return _set_of(facts["name"], facts["worlds"], facts["sources"])


@lru_cache(maxsize=64)
def _parsed(text: str) -> Scenario:
    return load_scenario(text)


def _set_of(name: str, texts: Sequence[str], sources: Iterable[str]) -> ScenarioSet:
    return ScenarioSet(
        name=name,
        count=len(texts),
        worlds=dict(enumerate(texts)),
        names=tuple(_parsed(text).name for text in texts),
        sources=tuple(sources),
    )


def single_scenario(scenario: Scenario) -> ScenarioSet:
    """The suite of one scenario."""
    return _set_of(FILES, [scenario_to_json(scenario)], [])


def are_files(arguments: Sequence[str]) -> bool:
    """Whether the arguments name scenario files or a directory, and not a built-in suite."""
    if len(arguments) > 1:
        return True
    (argument,) = arguments
    is_path = "/" in argument or argument.endswith(ENDINGS) or Path(argument).is_dir()
    return is_path and argument not in suite_names()


def read_scenario_files(arguments: Sequence[str]) -> tuple[ScenarioSet, list[str]]:
    """The suite of a directory or of a list of files, and one line for each file left out.

    Worlds are numbered by sorted file name. Left out are files that are no scenario, that name a
    fleet, or whose scenario has the name of one before. Raises ConfigError if none is left.
    """
    found: dict[str, Path] = {}  # by name of the scenario
    texts: list[str] = []
    left_out: list[str] = []
    for path in _files(arguments):
        try:
            scenario = load_scenario(str(path))
            _check(scenario, path, found)
        except ConfigError as error:
            if not _is_map(path):
                left_out.append(str(error))
            continue
        found[scenario.name] = path
        texts.append(scenario_to_json(scenario))
    if not texts:
        first = left_out[0] if left_out else f"{arguments[0]}: only maps, no scenario"
        more = f" (and {len(left_out) - 1} more files)" if len(left_out) > 1 else ""
        raise ConfigError(f"no scenario to sweep: {first}{more}")
    return _set_of(_name_of(arguments), texts, [Path(a).name or a for a in arguments]), left_out


def _files(arguments: Sequence[str]) -> list[Path]:
    directory = Path(arguments[0])
    if len(arguments) == 1 and directory.is_dir():
        files = [path for path in directory.iterdir() if path.suffix in ENDINGS]
        if not files:
            raise ConfigError(
                f"{directory}: no scenario file in it; give a directory of .yaml or .json files "
                "(`mfba import` makes them)"
            )
    else:
        files = [Path(argument) for argument in arguments]
        for path in files:
            if path.is_dir():
                raise ConfigError(
                    f"{path}: a directory among other arguments; give one directory, or files"
                )
            if len(files) == 1 and path.suffix not in ENDINGS:
                raise ConfigError(
                    f"{path}: no such directory; give a built-in suite, a directory of scenario "
                    "files, or files"
                )
            if path.suffix not in ENDINGS:
                raise ConfigError(
                    f"{path}: not a scenario file; give one suite, one directory, or "
                    "several .yaml files"
                )
    return sorted(files, key=lambda path: (path.name, str(path)))


def _check(scenario: Scenario, path: Path, found: Mapping[str, Path]) -> None:
    if scenario.robots:
        raise ConfigError(
            f"{path}: names {len(scenario.robots)} robots; a sweep runs one, take the file away"
        )
    if scenario.name in found:
        raise ConfigError(
            f"{path}: name {scenario.name!r} is that of {found[scenario.name]} as well; "
            "rename one of them"
        )


def _is_map(path: Path) -> bool:
    with suppress(OSError, ValueError):
        if path.suffix != ".json":
            return len(set(_MAP.findall(read_input_text(path, _LARGEST_MAP_YAML)))) == 3
    return False


def _name_of(arguments: Sequence[str]) -> str:
    """Of the directory; runs are written SUITE/WORLD/PLANNER/SEED, and chunks are files."""
    path = Path(arguments[0])
    if len(arguments) > 1 or not path.is_dir():
        return FILES
    name = re.sub(r"[^\w.+-]+", "-", path.resolve().name, flags=re.ASCII)
    return name or FILES
