# SPDX-License-Identifier: Apache-2.0
"""Load scenarios: by name, from a YAML or JSON file, or from a text; checked on loading."""

from __future__ import annotations

import json
import os
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..core.errors import ConfigError
from ..core.input_files import MOST_YAML_BYTES
from ..core.option_specs import did_you_mean
from ..core.shipped_files import scenario_names, scenario_path
from ..simulation.scenario import Scenario
from .scenario_json import EXAMPLE, UnusualError, as_written
from .short_form import completed
from .text_files import read_text
from .trajectory_file import with_trajectory_files


def load_scenario(source: str) -> Scenario:
    """Load a scenario by the name of a shipped one, by file, or from YAML/JSON text ('{...').

    Raises ConfigError, in one line, for anything that is no scenario.
    """
    if source.lstrip().startswith("{"):
        return parse_scenario(source, "inline scenario")
    if source.endswith((".yaml", ".yml", ".json")):
        return _parse_file(Path(source), source)
    known = scenario_names()
    if source in known:
        return _parse_file(scenario_path(source), source)
    if os.path.isfile(source):
        return _parse_file(Path(source), source)
    raise ConfigError(
        f"{source!r}: no such scenario; {did_you_mean(source, known)} (or give a .yaml file)"
    )


def _parse_file(path: Path, origin: str) -> Scenario:
    text = read_text(path, "give a readable scenario .yaml")
    return parse_scenario(text, origin, path.parent)


def parse_scenario(text: str, origin: str, directory: Path = Path()) -> Scenario:
    """Turn YAML or JSON text into a Scenario; files that it names are searched in directory.

    Raises ConfigError naming origin, value, reason and remedy.
    """
    if len(text) > MOST_YAML_BYTES:
        most = MOST_YAML_BYTES // 10**6
        raise ConfigError(f"{origin}: more than {most} MB; give fewer or simpler obstacles")
    data = _plain(text, origin)
    if data is None:
        raise ConfigError(f"{origin}: empty; {EXAMPLE}")
    if not isinstance(data, dict):
        raise ConfigError(f"{origin}: a {type(data).__name__}, not a mapping; {EXAMPLE}")
    try:
        data = with_trajectory_files(data, directory)
        with suppress(UnusualError):
            return as_written(completed(data))
        from .yaml_schema import checked

        return checked(data, directory)
    except ConfigError as error:
        raise ConfigError(f"{origin}: {error}") from None


def _plain(text: str, origin: str) -> Any:
    """The parsed text; JSON first, since YAML reads some JSON escapes differently."""
    with suppress(ValueError, RecursionError):
        return json.loads(text)
    from .read_yaml import from_yaml

    return from_yaml(text, origin)
