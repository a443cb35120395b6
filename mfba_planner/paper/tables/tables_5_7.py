# SPDX-License-Identifier: Apache-2.0
"""Tables 5 and 7 and the numbers of the text on them: ten runs, and a thousand seeds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping

import numpy as np

from ...evaluation import statistics as stats
from ...evaluation.statistics import Array
from .. import published
from ..published import TRIP_RUNS, TRIP_TABLES, Printed
from ..readings_of_paper import PLANNERS
from ..study.plan import LAWS, PLANNER_READINGS, trip_sample
from ..study.run import Sample
from .table_entries import Cell, Entry, Grid, Ours, Section, Verdict, entry, inside

Samples = Mapping[str, Sample]
Draws = Mapping[tuple[str, str], Array]

LENGTH_COLUMNS = ("best", "mean", "worst")
SHOWN_ENCOUNTERS = 4
# {law: the reading of section 6.2 whose intervals decide the verdicts of its column}
MEANT = {"mfba": "section6", "ba": "fig1"}


def trip_section(case: str, samples: Samples, seed: int) -> Section:
    """Every number of Table 5 (case1) or 7 (case2) and of the text about it."""
    place = TRIP_TABLES[case]
    lengths = _draws(case, samples)
    fitness = {pair: 1.0 / drawn for pair, drawn in lengths.items()}
    count = len(_column(samples, case, PLANNER_READINGS[0], LAWS[0], "length_m"))
    seeds = f"{seed}-{seed + count - 1}"
    ten = _ten_runs(case, lengths)
    return Section(
        key=place.split()[1],
        title=f"{place}. Comparison results for case study {case[-1]}",
        entries=(
            *_fitness(place, fitness, seeds),
            *_text(case, samples, lengths, seeds),
        ),
        grids=(
            ten,
            _as_made(case, samples, seed),
            _as_should_be(case, samples),
            _encounters(case, samples),
        ),
        notes=_notes(ten),
    )


def ten_runs(case: str, samples: Samples) -> Grid:
    """The lengths of ten runs compared with the printed ones."""
    return _ten_runs(case, _draws(case, samples))


def _draws(case: str, samples: Samples) -> Draws:
    """Lengths of ten runs, resampled: {(reading, law): (count, 10)}.

    All pairs use the same draws, so differences between them do not come from the resampling.
    """
    return {
        (reading, law): stats.resample(
            _column(samples, case, reading, law, "length_m"), TRIP_RUNS, stats.generator(5)
        )
        for reading in PLANNER_READINGS
        for law in LAWS
    }


def _column(samples: Samples, case: str, reading: str, law: str, column: str) -> Array:
    return samples[trip_sample(reading, case, law)][column]


def _statistics(draws: Array) -> dict[str, Array]:
    """The four columns of the tables for each row of ten values; SD over n - 1, as MATLAB's."""
    return {
        "minimum": draws.min(1),
        "maximum": draws.max(1),
        "standard deviation": draws.std(1, ddof=1),
        "mean": draws.mean(1),
    }


def _ours(draws: Draws, law: str, column: str, seeds: str) -> list[Ours]:
    """The interval of a statistic of ten runs, for each reading."""
    return [
        Ours(
            reading=reading,
            value=stats.interval(_statistics(draws[reading, law])[column]),
            seeds=seeds,
        )
        for reading in PLANNER_READINGS
    ]


def _fitness(place: str, fitness: Draws, seeds: str) -> Iterator[Entry]:
    for printed in published.TRIPS[place]:
        law = printed.row.lower()
        yield inside(printed, _ours(fitness, law, printed.column, seeds), MEANT[law])


def _text(case: str, samples: Samples, lengths: Draws, seeds: str) -> Iterator[Entry]:
    place = f"Section 6.2, case {case[-1]}"
    for printed in published.TEXT:
        if printed.place != place:
            continue
        if printed.column == "length":
            law = printed.row.lower()
            yield inside(printed, _ours(lengths, law, "minimum", seeds), MEANT[law])
        elif printed.column == "run time":
            yield entry(printed, [], Verdict.NOT_STATED,
                        "MATLAB's computing time on the authors' machine: says nothing about "
                        "the robot, whose speed is not stated")  # fmt: skip
        else:
            yield _experiment(printed, case, samples)


def _experiment(printed: Printed, case: str, samples: Samples) -> Entry:
    """The number of the best of ten runs: pure chance."""
    ours = [
        Ours(
            reading=reading,
            value=int(
                np.argmin(
                    _column(samples, case, reading, printed.row.lower(), "length_m")[:TRIP_RUNS]
                )
            )
            + 1,
        )
        for reading in PLANNER_READINGS
    ]
    return entry(printed, ours, Verdict.NOT_STATED, "chance: the seeds are not stated")


def printed_lengths(case: str, law: str) -> dict[str, float]:
    """Best, mean and worst length from the printed fitness; the mean is 1 / mean fitness."""
    values = published.values(TRIP_TABLES[case], law.upper())
    return {
        "best": 1.0 / values["maximum"],
        "mean": 1.0 / values["mean"],
        "worst": 1.0 / values["minimum"],
    }


def _ten_runs(case: str, lengths: Draws) -> Grid:
    rows: list[tuple[Cell, ...]] = []
    for reading in PLANNER_READINGS:
        for law in LAWS:
            drawn = lengths[reading, law]
            statistics = np.stack([drawn.min(1), drawn.mean(1), drawn.max(1)], axis=1)
            printed = printed_lengths(case, law)
            joint = stats.consistency(statistics, list(printed.values()), LENGTH_COLUMNS)
            for column, (name, value) in enumerate(printed.items()):
                ours = stats.interval(statistics[:, column])
                rows.append(
                    (reading, law.upper(), name, value, ours, "yes" if value in ours else "no",
                     joint.p if column == 0 else None)
                )  # fmt: skip
    return Grid(
        key="ten runs",
        title="Lengths of ten runs in metres: printed, and ours with 95 % bootstrap intervals",
        head=("reading", "law", "of ten", "printed (1/fitness)", "ours", "inside?", "joint p"),
        rows=tuple(rows),
        digits={"joint p": 2},
        note="joint p: best, mean and worst together.",
    )


def _as_made(case: str, samples: Samples, seed: int) -> Grid:
    rows: list[tuple[Cell, ...]] = []
    for reading in PLANNER_READINGS:
        for law in LAWS:
            ten = _column(samples, case, reading, law, "length_m")[:TRIP_RUNS]
            sd = float(np.std(1.0 / ten, ddof=1))
            best = int(np.argmin(ten))
            rows.append(
                (reading, law.upper(), float(ten.min()), best + 1, float(ten.mean()),
                 float(ten.max()), sd)
            )  # fmt: skip
    return Grid(
        key="as made",
        title=f"As the paper made it: our first ten runs (seeds {seed} to {seed + TRIP_RUNS - 1})",
        head=("reading", "law", "best m", "in run", "mean m", "worst m", "SD of fitness"),
        rows=tuple(rows),
    )


def _as_should_be(case: str, samples: Samples) -> Grid:
    rows: list[tuple[Cell, ...]] = []
    comparisons = []
    for reading in PLANNER_READINGS:
        by_law = {law: samples[trip_sample(reading, case, law)] for law in LAWS}
        difference = by_law["mfba"]["length_m"] - by_law["ba"]["length_m"]
        comparison = stats.compare_pairs(by_law["mfba"]["length_m"], by_law["ba"]["length_m"])
        comparisons.append(comparison)
        for law, sample in by_law.items():
            n = len(sample["length_m"])
            touched = int(np.count_nonzero(sample["collisions"]))
            compared: tuple[Cell, ...] = (None,) * 3
            if law == "mfba":
                mean = stats.estimate(difference, lambda x: x.mean(1), stats.generator(6))
                compared = (mean, comparison.superiority, comparison.p)
            rows.append(
                (
                    reading,
                    law.upper(),
                    n,
                    stats.estimate(sample["length_m"], lambda x: x.mean(1), stats.generator(7)),
                    *compared,
                    n - int(sample["reached"].sum()),
                    touched,
                    100.0 * stats.share_interval(touched, n)[1],
                    float(sample["clearance_m"].min()),
                    float(sample["clearance_m"].mean()),
                    float(np.degrees(sample["turning_rad"].mean())),
                )
            )
    corrected = iter(stats.holm([c.p for c in comparisons]))
    rows = [(*row[:6], None if row[6] is None else next(corrected), *row[7:]) for row in rows]
    return Grid(
        key="as should be",
        title="As it should be made: the same seeds for both laws",
        head=("reading", "law", "runs", "mean length m", "MFBA - BA m", "chance that MFBA is "
              "shorter", "p (Holm)", "not arrived", "runs with contact", "at most % (95 %)",
              "least clearance m", "mean clearance m", "mean turning deg"),
        rows=tuple(rows),
        digits={
            "MFBA - BA m": 2,
            "chance that MFBA is shorter": 3,
            "p (Holm)": 2,
            "at most % (95 %)": 2,
            "least clearance m": 2,
            "mean clearance m": 3,
            "mean turning deg": 3,
        },
        note="Differences by seed, Wilcoxon's signed ranks, Holm over the readings; the share of "
        "runs with contact has Wilson's upper end. Clearance is the smallest gap between edges, "
        "turning the sum of all turns of a run.",
    )  # fmt: skip


def _encounters(case: str, samples: Samples) -> Grid:
    rows: list[tuple[Cell, ...]] = []
    for reading in PLANNER_READINGS:
        for law in LAWS:
            masks = _column(samples, case, reading, law, "encounters").astype(int).tolist()
            counted = sorted(Counter(masks).items(), key=lambda item: (-item[1], item[0]))
            shown = [
                f"{_obstacles(mask)}: {_percent(n / len(masks))}"
                for mask, n in counted[:SHOWN_ENCOUNTERS]
            ]
            rows.append((reading, law.upper(), "; ".join(shown)))
    figure = {"case1": "Fig. 7 names obstacle 1", "case2": "Fig. 8 names obstacles 1 and 2"}
    return Grid(
        key="encounters",
        title=f"Obstacles that entered the sensing region ({figure[case]})",
        head=("reading", "law", "share of the runs"),
        rows=tuple(rows),
    )


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %" if share >= 0.005 else "below 0.5 %"


def _obstacles(mask: int) -> str:
    return " and ".join(str(i) for i in range(1, 64) if mask >> i & 1) or "none"


def fitting_columns(ten: Grid) -> dict[str, list[str]]:
    """{law: readings whose intervals contain printed best, mean and worst}."""
    fits: dict[str, list[str]] = {}
    for law in LAWS:
        fits[law] = [
            reading
            for reading in PLANNER_READINGS
            if all(row[5] == "yes" for row in ten.rows if row[:2] == (reading, law.upper()))
        ]
    return fits


def _notes(ten: Grid) -> tuple[str, ...]:
    s, f = PLANNERS["section6"], PLANNERS["fig1"]
    fits = fitting_columns(ten)
    both = [reading for reading in PLANNER_READINGS if all(reading in x for x in fits.values())]
    columns = "; ".join(
        f"{law.upper()}'s printed best, mean and worst lie inside the intervals of "
        f"{' and '.join(readings) if readings else 'no reading'}"
        for law, readings in fits.items()
    )
    return (
        f"Fitted, not stated in the paper: section6 has speed {s.speed_mps:g} m/s, steps of "
        f"{s.step_length_m:g} m and {s.bat.iterations} bat iterations per step; fig1 has speed "
        f"{f.speed_mps:g} m/s, steps of {f.step_length_m:g} m and {f.bat.iterations} iteration of "
        "one lasting swarm per step.",
        f"{columns}.",
        f"Readings that give both columns of this table: {' and '.join(both) or 'none found'}.",
    )
