# SPDX-License-Identifier: Apache-2.0
"""Verdicts on synthetic samples: each must change with the samples that it depends on."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from mfba_planner.core.errors import ConfigError
from mfba_planner.evaluation.statistics import Interval
from mfba_planner.paper import published
from mfba_planner.paper.benchmark_functions import FUNCTIONS
from mfba_planner.paper.published import BENCHMARK_COLUMNS, BY_KEY
from mfba_planner.paper.study.plan import (
    EXCEPTIONS,
    LAWS,
    PLANNER_READINGS,
    SWARM_READINGS,
    benchmark_sample,
    trip_sample,
)
from mfba_planner.paper.tables.build_tables import build, check_sections
from mfba_planner.paper.tables.claims import claim_section
from mfba_planner.paper.tables.table_3 import benchmark_section, consistent_rows
from mfba_planner.paper.tables.table_entries import Entry, Grid, Ours, Section, Verdict, inside
from mfba_planner.paper.tables.tables_5_7 import fitting_columns, printed_lengths, trip_section
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.scenario import Scenario

RUNS = 60
Samples = dict[str, Mapping[str, Any]]


@pytest.fixture(scope="module")
def scenarios() -> dict[str, Scenario]:
    return {name: load_scenario(name) for name in ("case1", "case2")}


def find(section: Section, row: str, column: str) -> Entry:
    (entry,) = [e for e in section.entries if (e.row, e.column) == (row, column)]
    return entry


def grid(section: Section, key: str) -> Grid:
    (found,) = [g for g in section.grids if g.key == key]
    return found


def trips(**changed: Any) -> Samples:
    """Synthetic trips of RUNS seeds, the same for all samples; `changed` is added to MFBA's."""
    rng = np.random.default_rng(1)
    common = {
        "length_m": rng.normal(17.3, 0.2, RUNS),
        "clearance_m": rng.normal(0.3, 0.01, RUNS),
        "turning_rad": rng.normal(20.0, 1.0, RUNS),
        "collisions": np.zeros(RUNS),
        "reached": np.ones(RUNS),
        "encounters": np.full(RUNS, 6.0),
    }
    return {
        trip_sample(reading, case, law): {
            column: values + (changed.get(column, 0.0) if law == "mfba" else 0.0)
            for column, values in common.items()
        }
        for reading in PLANNER_READINGS
        for case in ("case1", "case2")
        for law in LAWS
    }


def test_the_verdict_is_that_of_the_meant_reading() -> None:
    printed = BY_KEY["Table 3/F5 BA/best"]
    around, away = Interval(1.0, 0.0121, 2.0), Interval(1.0, 0.0122, 2.0)
    both = [Ours(reading="a", value=around), Ours(reading="b", value=away)]
    yes = inside(printed, both, "a")
    assert (yes.verdict, yes.why) == (
        Verdict.REPRODUCED, "in the 95 % interval of a, outside that of b",
    )  # fmt: skip
    assert inside(printed, both, "b").verdict is Verdict.DIFFERS


def test_an_impossible_number_stays_impossible_for_any_result() -> None:
    printed = BY_KEY["Table 3/F6 BA/best"]
    found = inside(printed, [Ours(reading="a", value=Interval(-1.9, -2.0, -1.8))], "a")
    assert found.verdict is Verdict.IMPOSSIBLE
    assert found.why.endswith("(in the 95 % interval of a)")


def test_printed_lengths_are_reciprocals() -> None:
    found = printed_lengths("case1", "mfba")
    assert [round(x, 4) for x in found.values()] == [17.0919, 17.1094, 17.1517]


def test_trips_with_the_printed_lengths_are_reproduced() -> None:
    made = trips()
    for case, place in published.TRIP_TABLES.items():
        for law in LAWS:
            best, mean, worst = printed_lengths(case, law).values()
            ends = [best * (1.0 - 1e-9), worst * (1.0 + 1e-9)]  # safe from rounding
            ten = [*ends, *[(10 * mean - best - worst) / 8] * 8]
            for reading in PLANNER_READINGS:
                made[trip_sample(reading, case, law)] = {
                    **made[trip_sample(reading, case, law)], "length_m": np.array(ten * 6),
                }  # fmt: skip
        section = trip_section(case, made, 0)
        assert fitting_columns(grid(section, "ten runs")) == {
            law: list(PLANNER_READINGS) for law in LAWS
        }
        for law in ("BA", "MFBA"):
            for column in ("minimum", "maximum", "mean"):
                assert find(section, law, column).verdict is Verdict.REPRODUCED
        assert "Readings that give both columns of this table: section6 and fig1." in section.notes
        assert section.title.startswith(place)


def test_trips_with_other_lengths_differ() -> None:
    section = trip_section("case2", trips(), 0)  # 17.3 m, printed are 18.4 to 19.2
    assert find(section, "BA", "mean").verdict is Verdict.DIFFERS
    assert find(section, "MFBA", "length").verdict is Verdict.DIFFERS
    assert find(section, "MFBA", "standard deviation").verdict is Verdict.IMPOSSIBLE
    assert find(section, "MFBA", "run time").verdict is Verdict.NOT_STATED
    assert any("lie inside the intervals of no reading" in note for note in section.notes)
    assert grid(section, "encounters").rows[0] == ("section6", "BA", "1 and 2: 100 %")


def test_pairs_are_compared_by_seed() -> None:
    section = trip_section("case1", trips(length_m=-0.01), 0)  # a twentieth of the spread
    rows = {row[:2]: row for row in grid(section, "as should be").rows}
    difference, chance, p = rows["section6", "MFBA"][4:7]
    assert isinstance(difference, Interval)
    assert difference.high == pytest.approx(-0.01)
    assert isinstance(chance, Interval)
    assert chance.middle == 1.0
    assert isinstance(p, float)
    assert p < 1e-9


def verdicts(samples: Samples, scenarios: dict[str, Scenario]) -> dict[str, Verdict]:
    return {e.row: e.verdict for e in claim_section(samples, scenarios).entries}


def test_verdicts_of_claims_follow_the_samples(scenarios: dict[str, Scenario]) -> None:
    none = verdicts(trips(), scenarios)
    assert none["a collision-free path"] is Verdict.REPRODUCED
    assert none["shortest time"] is Verdict.NOT_STATED
    for claim, better in {
        "shorter than BA": {"length_m": -0.1},
        "safer than BA": {"clearance_m": 0.1},
        "smoother than BA": {"turning_rad": -1.0},
    }.items():
        ((column, step),) = better.items()
        assert none[claim] is Verdict.DIFFERS
        assert verdicts(trips(**better), scenarios)[claim] is Verdict.REPRODUCED
        assert verdicts(trips(**{column: -step}), scenarios)[claim] is Verdict.DIFFERS
        # real but too small to notice
        assert verdicts(trips(**{column: step / 100}), scenarios)[claim] is Verdict.DIFFERS
    one = np.zeros(RUNS)
    one[7] = 1.0
    assert verdicts(trips(collisions=one), scenarios)["a collision-free path"] is Verdict.DIFFERS


def test_the_straight_line_of_case_1_is_shorter_and_collision_free(
    scenarios: dict[str, Scenario],
) -> None:
    found = find(claim_section(trips(), scenarios), "the shortest path", "claim")
    assert found.verdict is Verdict.DIFFERS
    assert "case1, 0.785 m/s, 0.37 m to spare" in found.why
    assert "case2" not in found.why


def benchmarks(factor: float) -> Samples:
    """RUNS values per sample; MFBA's are BA's times factor."""
    rng = np.random.default_rng(2)
    made: Samples = {}
    for reading in (*SWARM_READINGS, EXCEPTIONS):
        for function in FUNCTIONS:
            for law in LAWS:
                sample = rng.lognormal(0.0, 0.2, RUNS) * (factor if law == "mfba" else 1.0)
                made[benchmark_sample(reading, function, law)] = {"best": sample}
    return made


@pytest.mark.parametrize(
    ("factor", "sign", "verdict"),
    [
        (0.3, "+", Verdict.REPRODUCED),
        (1.0, "-", Verdict.DIFFERS),
        (3.0, ".", Verdict.DIFFERS),
    ],
)
def test_signs_follow_the_samples(factor: float, sign: str, verdict: Verdict) -> None:
    section = benchmark_section(benchmarks(factor), 0)
    for function in FUNCTIONS:
        found = find(section, f"{function} MFBA", "significant")
        assert {o.value for o in found.ours} == {sign}
        assert found.verdict is verdict
    chance = [row[-1] for row in grid(section, "as made").rows if row[-1] is not None]
    expected = {"+": 1.0, ".": 0.0}.get(sign)
    assert expected is None or chance == [expected] * 6


def test_rows_are_consistent_with_similar_samples() -> None:
    made = benchmarks(1.0)
    assert consistent_rows(grid(benchmark_section(made, 0), "joint")) == 0
    rng = np.random.default_rng(3)
    for row in ("F1 BA", "F5 MFBA"):
        v = published.values("Table 3", row)
        best, worst, mean, sd = (v[column] for column in BENCHMARK_COLUMNS)
        shape = (mean / sd) ** 2
        sample = np.clip(rng.gamma(shape, mean / shape, 4000), best * 0.7, worst * 1.1)
        made[benchmark_sample("table3", *row.lower().replace("f", "F", 1).split())] = {
            "best": sample
        }
    assert consistent_rows(grid(benchmark_section(made, 0), "joint")) >= 1


def test_sections_have_the_sequence_of_the_paper() -> None:
    assert check_sections(["7", "1", "7"]) == ("1", "7")
    assert len(check_sections([])) == 9
    with pytest.raises(ConfigError, match="tabel 3: unknown table"):
        check_sections(["tabel 3"])


def test_a_changed_scenario_differs(scenarios: dict[str, Scenario]) -> None:
    swapped = {"case1": scenarios["case2"], "case2": scenarios["case2"]}
    fifth = build(["6"], swapped, {}, 0)[0]
    assert {e.verdict for e in fifth.entries} == {Verdict.REPRODUCED}
    fourth = build(["4"], swapped, {}, 0)[0]
    assert Verdict.DIFFERS in {e.verdict for e in fourth.entries}
