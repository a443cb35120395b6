# SPDX-License-Identifier: Apache-2.0
"""The sensitivity study: readings, results per reading, and the files of the command."""

import csv
import io
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from project import ROOT

from mfba_planner import cli
from mfba_planner.core.errors import ConfigError, OutputError
from mfba_planner.core.geometry import distance
from mfba_planner.core.option_specs import flatten
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.evaluation.statistics import Interval
from mfba_planner.paper import sensitivity
from mfba_planner.paper.sensitivity import CASES, Reading, Row, Variation, turned
from mfba_planner.paper.study.run import Sample
from mfba_planner.perception.sensory_vector import SensorParams, sense_circles, sensory_vector
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.report import style
from mfba_planner.report.figure_sheet import to_bytes
from mfba_planner.report.figures.sensitivity_heat_map import draw
from mfba_planner.report.sensitivity_table import to_csv, to_markdown, to_table
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.run_episode import run

SCENARIOS = {case: load_scenario(case) for case in CASES}
BASE, *OTHERS = sensitivity.all_readings()


def variation(reading: Reading, case: str = "case1") -> Variation:
    return Variation(scenario=SCENARIOS[case], planner=reading.planner, reading=reading)


def reading(label: str) -> Reading:
    (found,) = (r for r in [BASE, *OTHERS] if r.label == label)
    return found


# --- readings -------------------------------------------------------------------------------


def test_the_first_reading_is_section6_and_every_other_differs_from_it() -> None:
    assert (BASE.planner, BASE.sensor) == (PlannerParams(), SensorParams())
    facts = [variation(r).facts() for r in [BASE, *OTHERS]]
    assert all(f != facts[0] for f in facts[1:])
    assert len({tuple(f.items()) for f in facts}) == len(facts)
    assert len({r.name for r in [BASE, *OTHERS]}) == len(facts)


def test_one_thing_is_changed_at_a_time() -> None:
    base = flatten(PlannerParams())
    for r in OTHERS:
        if r.group in ("preset", "all three"):
            continue
        changed = sum(value != base[name] for name, value in flatten(r.planner).items())
        changed += r.sensor != SensorParams()
        changed += r.sectors_rad != 0.0
        assert changed + (not r.enlarged) in ((1, 2) if r.group == "SR measured" else (1,)), r


def test_the_quick_form_has_some_of_the_readings_unchanged() -> None:
    quick = sensitivity.all_readings(quick=True)
    assert quick[0] == BASE
    assert {r.name for r in quick} < {r.name for r in [BASE, *OTHERS]}
    assert {r.group for r in quick} >= set(sensitivity.GROUPS) - {"SR measured"}


def test_section6_gives_the_same_runs_as_outside_the_study() -> None:
    columns = variation(BASE, "case2").run([3, 4])
    episodes = [run(SCENARIOS["case2"], seed=seed) for seed in (3, 4)]
    assert columns["length_m"] == [evaluate(episode).length_m for episode in episodes]
    assert columns["as_figure"] == [
        int(evaluate(episode).encounters[:2] == (1, 2)) for episode in episodes
    ]


@pytest.mark.parametrize("angle", [math.pi / 12.0, -1.0])
def test_turning_the_world_turns_the_sectors_the_other_direction(angle: float) -> None:
    world = replace(SCENARIOS["case2"], start_m=(0.5, -1.0))
    turned_world = turned(world, angle)
    for t in (0.0, 7.0):
        for a, b in zip(world.centers(t), turned_world.centers(t)):
            assert distance(world.start_m, a) == pytest.approx(distance(turned_world.start_m, b))
    assert distance(turned_world.start_m, turned_world.goal_m) == pytest.approx(
        distance(world.start_m, world.goal_m)
    )
    width = math.pi / 6.0
    ahead, ring = SCENARIOS["case1"], SensorParams(sensing_range_m=1.0, sectors=12)
    circle = [((0.0, 1.2), 0.3)]
    one = sensory_vector(sense_circles(ahead.start_m, circle, ring))
    (moved,) = turned(
        replace(ahead, obstacles=(replace(ahead.obstacles[0], center_m=(0.0, 1.2)),)), width
    ).centers(0.0)
    other = sensory_vector(sense_circles(ahead.start_m, [(moved, 0.3)], ring))
    assert other == one[-1:] + one[:-1]


def test_without_enlargement_the_robot_touches_obstacles() -> None:
    not_enlarged = reading("own edge, not enlarged")
    columns = variation(not_enlarged, "case2").run(range(6))
    assert sum(columns["collisions"]) > 0
    assert sum(variation(BASE, "case2").run(range(6))["collisions"]) == 0


# --- results --------------------------------------------------------------------------------


def samples(
    length: Mapping[str, float], as_figure: float = 1.0, hit: float = 0.0
) -> dict[str, Sample]:
    """Synthetic samples: the lengths of a case's runs differ by at most 5 mm from this length."""
    found: dict[str, Sample] = {}
    for r in sensitivity.all_readings(quick=True):
        for case in CASES:
            spread = np.linspace(-0.005, 0.005, 41)
            found[f"{r.name}/{case}"] = {
                "length_m": length[case] + spread,
                "collisions": np.full(41, hit),
                "reached": np.ones(41),
                "as_figure": np.full(41, as_figure),
            }
    return found


def test_printed_lengths_are_the_reciprocals_of_tables_5_and_7() -> None:
    assert sensitivity.printed_m("case1", "MFBA") == pytest.approx(
        (17.0919, 17.1094, 17.1517), abs=1e-4
    )
    assert sensitivity.printed_m("case2", "BA") == pytest.approx(
        (18.6239, 18.8968, 19.2165), abs=1e-4
    )


def row(
    best: float, mean: float, worst: float, contacts: float = 0.0, reached: float = 1.0
) -> Row:
    middles = (best, mean, worst)
    return Row(
        reading=BASE,
        case="case1",
        intervals=tuple(Interval(m, m - 0.01, m + 0.01) for m in middles),
        contacts=contacts,
        reached=reached,
        as_figure=0.4,
    )


def test_a_row_is_reproduced_when_all_its_lengths_lie_within() -> None:
    good = row(17.09, 17.11, 17.15)
    assert good.reproduces == ("MFBA",)
    assert good.holds("BA") == (True, False, False)
    assert good.off_m("BA") == pytest.approx((-0.0032, -0.2763, -0.6528), abs=1e-4)
    assert row(17.09, 17.11, 17.17).reproduces == ()
    assert row(17.09, 17.11, 17.15, contacts=0.01).reproduces == ()
    assert row(17.09, 17.11, 17.15, reached=0.99).reproduces == ()
    assert row(17.0932, 17.3863, 17.8028).reproduces == ("BA",)


def test_shares_and_intervals_come_from_the_samples() -> None:
    rows = sensitivity.rows(samples({"case1": 17.0, "case2": 18.0}, as_figure=1.0, hit=2.0), True)
    assert [r.case for r in rows[:2]] == list(CASES)
    for r in rows:
        length = 17.0 if r.case == "case1" else 18.0
        best, mean, worst = r.intervals
        assert length - 0.005 <= best.low <= best.middle < mean.middle < worst.middle
        assert worst.high <= length + 0.005
        assert mean.middle == pytest.approx(length, abs=0.001)
        assert (r.contacts, r.reached, r.as_figure, r.mostly_as_figure) == (1.0, 1.0, 1.0, True)


def test_csv_table_and_picture_have_the_same_rows() -> None:
    rows = sensitivity.rows(samples({"case1": 17.1, "case2": 18.5}), True)
    lines = list(csv.DictReader(to_csv(rows).splitlines()))
    assert [(line["reading"], line["case"]) for line in lines] == [
        (r.reading.label, r.case) for r in rows
    ]
    assert float(lines[0]["mean_median_m"]) == pytest.approx(17.1, abs=0.001)
    assert lines[0]["holds_MFBA_mean"] == "0"
    table = to_table(rows, "title")
    assert table.row_count == len(rows) / len(CASES)
    assert len(to_table(rows, "title", 80).columns) == len(table.columns) - 1
    marked = to_markdown(rows).splitlines()
    assert len(marked) == 2 + table.row_count
    assert marked[2].startswith("| preset | section6 | 17.1")
    with style.context():
        figure = draw(rows)
        assert to_bytes(figure, "svg") == to_bytes(draw(rows), "svg")
        numbers = [text.get_text() for ax in figure.axes for text in ax.texts]
    assert numbers.count("100") == table.row_count * 2  # all have the encounters of the figure
    assert "preset" in numbers


def test_the_docs_page_has_the_readings_of_this_code() -> None:
    page = (ROOT / "docs/sensitivity.md").read_text(encoding="utf-8")
    lines = [line.split(" | ") for line in page.splitlines() if line.startswith("|")][2:]
    assert [line[1].strip() for line in lines] == [r.label for r in [BASE, *OTHERS]]
    marks = {line[1].strip(): (line[3].strip(), line[6].strip()) for line in lines}
    assert marks["section6"] == ("● MFBA", "● MFBA")
    assert marks["fig1, BA"] == ("● BA", "● BA")
    assert marks["4 per step, 0.2 m, 0.83 m/s"] == ("● MFBA", "● MFBA")


# --- the command ----------------------------------------------------------------------------


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three readings and two seeds, for a fast test of the command."""
    few = [BASE, reading("0.6 m/s"), reading("turned by half a sector")]
    monkeypatch.setattr(sensitivity, "all_readings", lambda quick=False: few)
    monkeypatch.setattr(sensitivity, "QUICK_SEEDS", 2)


@pytest.mark.usefixtures("small")
def test_an_interrupted_command_is_resumed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "s"
    args = ["sensitivity", "--quick", "--workers", "1", "--out", str(out)]
    assert cli.main(args) == 0
    text = capsys.readouterr().out
    assert "turned by half a sector" in text
    names = {"sensitivity.csv", "sensitivity.md", "sensitivity.png", "sensitivity.svg"}
    before = {name: (out / name).read_bytes() for name in names}
    (out / "sensitivity.csv").unlink()
    next((out / "chunks").iterdir()).unlink()
    assert cli.main(args) == 0
    assert {name: (out / name).read_bytes() for name in names} == before
    with pytest.raises(OutputError):
        cli.main([*args, "--seed", "5"])


@pytest.mark.usefixtures("small")
def test_a_terminal_without_these_characters_is_no_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    console = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    monkeypatch.setattr("sys.stdout", console)
    out = str(tmp_path / "s")
    assert cli.main(["sensitivity", "--quick", "--workers", "1", "--out", out]) == 0
    console.seek(0)
    assert "? the printed row lies within ours" in " ".join(console.read().split())


@pytest.mark.usefixtures("small")
def test_impossible_arguments_are_refused(tmp_path: Path) -> None:
    out = ["--out", str(tmp_path / "s")]
    with pytest.raises(ConfigError, match="--workers=0"):
        cli.main(["sensitivity", "--workers", "0", *out])
    with pytest.raises(ConfigError, match="--seed=-1"):
        cli.main(["sensitivity", "--seed", "-1", *out])
    assert not (tmp_path / "s").exists()
