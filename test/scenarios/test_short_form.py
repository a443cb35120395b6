# SPDX-License-Identifier: Apache-2.0
"""The usual form of a scenario file: read without yaml_schema, and never otherwise than by it."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.shipped_files import scenario_names, scenario_path
from mfba_planner.scenarios.read_yaml import from_yaml
from mfba_planner.scenarios.scenario_json import UnusualError, as_written
from mfba_planner.scenarios.short_form import completed
from mfba_planner.scenarios.yaml_schema import checked
from mfba_planner.simulation.scenario import Scenario

BASE = {"name": "a", "start_m": [0, 0], "goal_m": [9.0, 1]}
PARTS: dict[str, list[Any]] = {
    "description": ["", "one", 3],
    "robot_radius_m": [0.2, 1, True, -1.0, "0.3"],
    "time_limit_s": [30, 0.5, 0],
    "obstacles": [
        [],
        {},
        [{"center_m": [4, 4], "radius_m": 0.3}],
        [{"center_m": [4, 4], "radius_m": 1, "speed_mps": 0.1, "heading_deg": 111.8}],
        [{"center_m": [4, 4], "radius_m": 1, "heading_deg": True}],
        [{"center_m": [4, 4], "radius_m": 1, "heading_deg": 1e300}],
        [{"center_m": [4, 4], "radius_m": 1, "heading_deg": 1, "heading_rad": 1.0}],
        [{"center_m": [4, 4], "radius_m": 1, "heading_rad": 1.0}],
        [{"radius_m": 1, "trajectory": [[0, 4, 4], [1, 4, 5]]}],
        [{"center_m": [4, 4], "radius_m": 1, "trigger": {"within_m": 2}}],
        [{"center_m": [4, 4], "radius_m": 1, "turns": [{"at_s": 1, "speed_mps": 0.2}]}],
        [{"center_m": [4, 4], "radius_m": 1, "size": 2}],
        [7],
    ],
    "walls": [None, {"lower_m": [-20, -20], "upper_m": [20, 20]}],
    "robot": [{}, {"drive": "differential"}, {"footprint_m": [[0.0, 0.0, 0.4]]}],
    "kidnappings": [[], [{"at_s": 3, "to_m": [1, 1]}]],
    "robots": [[], [{"name": "r", "start_m": [0, 0], "goal_m": [9, 1]}], [{"name": "r"}]],
    "segments_m": [[], [[1, 2, 3, 4]]],
    "boxes": [[{"center_m": [5.0, 5.0], "size_m": [1.0, 1.0]}]],
    "colour": ["red"],
}


def outcome(read: Any, data: dict[str, Any]) -> Scenario | str | None:
    """The scenario, the refusal, or None for an unusual form."""
    try:
        return read(data)  # type: ignore[no-any-return]
    except UnusualError:
        return None
    except ConfigError:
        return "refused"


@given(st.fixed_dictionaries({}, optional={k: st.sampled_from(v) for k, v in PARTS.items()}))
def test_what_is_read_without_the_schema_is_what_the_schema_reads(parts: dict[str, Any]) -> None:
    data = BASE | parts
    found = outcome(lambda data: as_written(completed(data)), data)
    assert found is None or found == outcome(checked, data)


@pytest.mark.parametrize("name", scenario_names())
def test_shipped_scenarios_without_solids_need_no_schema(name: str) -> None:
    data = from_yaml(scenario_path(name).read_text(encoding="utf-8"), name)
    found = outcome(lambda data: as_written(completed(data)), data)
    assert found == (None if {"boxes", "polygons_m", "map"} & set(data) else checked(data))
