# SPDX-License-Identifier: Apache-2.0
"""Build the sections of tables: which runs they need, and the sections from their samples."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from ...core.errors import ConfigError
from ...core.option_specs import did_you_mean
from ...simulation.scenario import Scenario
from ..study.chunk import SampleChunk
from ..study.plan import Size, benchmark_plan, trip_plan
from ..study.run import Sample
from .claims import claim_section
from .table_3 import benchmark_section
from .table_entries import Section
from .tables_1_2_4_6 import constant_section, function_section, gap_section, obstacle_section
from .tables_5_7 import trip_section

SECTIONS = ("1", "2", "3", "4", "5", "6", "7", "constants", "claims")
# Which sections need episodes of which cases.
_TRIPS = {"5": ("case1",), "7": ("case2",), "claims": ("case1", "case2")}


def check_sections(wanted: Sequence[str]) -> tuple[str, ...]:
    """The wanted sections in the paper's sequence, all if none; ConfigError for an unknown one."""
    for name in wanted:
        if name not in SECTIONS:
            raise ConfigError(f"{name}: unknown table; {did_you_mean(name, list(SECTIONS))}")
    return tuple(name for name in SECTIONS if name in wanted or not wanted)


def plan(
    sections: Sequence[str], scenarios: Mapping[str, Scenario], size: Size, seed: int
) -> list[SampleChunk]:
    """The runs that these sections need, as chunks; scenarios: case1 and case2."""
    found = benchmark_plan(size, seed) if "3" in sections else []
    cases = {case for name in sections for case in _TRIPS.get(name, ())}
    for case in sorted(cases):
        found += trip_plan(case, scenarios[case], size, seed)
    return found


def build(
    sections: Sequence[str],
    scenarios: Mapping[str, Scenario],
    samples: Mapping[str, Sample],
    seed: int,
) -> list[Section]:
    """The sections, from the samples of plan()."""
    makers: dict[str, Callable[[], Section]] = {
        "1": gap_section,
        "2": function_section,
        "3": lambda: benchmark_section(samples, seed),
        "4": lambda: obstacle_section("case1", scenarios["case1"]),
        "5": lambda: trip_section("case1", samples, seed),
        "6": lambda: obstacle_section("case2", scenarios["case2"]),
        "7": lambda: trip_section("case2", samples, seed),
        "constants": lambda: constant_section(scenarios["case1"]),
        "claims": lambda: claim_section(samples, scenarios),
    }
    return [makers[name]() for name in sections]
