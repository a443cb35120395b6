# SPDX-License-Identifier: Apache-2.0
"""The claims of the paper's abstract, each compared with our runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...core.geometry import distance
from ...evaluation import statistics as stats
from ...evaluation.statistics import Array, Comparison
from ...simulation.contact import step_clearances
from ...simulation.scenario import Scenario
from .. import published
from ..readings_of_paper import PLANNERS
from ..study.plan import LAWS, PLANNER_READINGS, trip_sample
from ..study.run import Sample
from .table_entries import Entry, Ours, Section, Verdict
from .tables_5_7 import fitting_columns, ten_runs

Samples = Mapping[str, Sample]
CASES = tuple(published.TRIP_TABLES)
SIGNIFICANT = 0.01
# Smaller differences do not count, even if they are significant.
NOTICEABLE = {"length_m": 0.05, "clearance_m": 0.01, "turning_rad": np.radians(5.0)}


def claim_section(samples: Samples, scenarios: Mapping[str, Scenario]) -> Section:
    """Collision-free, shorter, safer, smoother, faster: judged by thousands of runs."""
    return Section(
        key="claims",
        title="Claims. What the abstract claims",
        entries=(
            _collision_free(samples),
            _shortest(samples, scenarios),
            _compared(samples, "shorter", "path length", "length_m", "m", 1.0),
            _compared(samples, "safer", "smallest clearance", "clearance_m", "m", -1.0),
            _compared(samples, "smoother", "sum of turns", "turning_rad", "rad", 1.0),
            _run_time(),
        ),
        notes=(
            _columns(samples),
            "Both laws have the same seeds, so each difference is one of pairs (Wilcoxon, Holm "
            "over all comparisons of a claim). A difference counts as noticeable from "
            + ", ".join(f"{limit:.2g} {name.rsplit('_', 1)[1]} ({name.rsplit('_', 1)[0]})"
                        for name, limit in NOTICEABLE.items())
            + " on.",
        ),
        digits=3,
    )  # fmt: skip


def _columns(samples: Samples) -> str:
    """The printed columns of lengths that each reading contains."""
    fits = {case: fitting_columns(ten_runs(case, samples)) for case in CASES}
    held = {
        reading: [
            f"{law.upper()} of {case}"
            for case in CASES
            for law in LAWS
            if reading in fits[case][law]
        ]
        for reading in PLANNER_READINGS
    }
    columns = "; ".join(f"{reading} holds {', '.join(x) or 'none'}" for reading, x in held.items())
    whole = [reading for reading, x in held.items() if len(x) == len(CASES) * len(LAWS)]
    return (
        "Printed columns of Tables 5 and 7 whose best, mean and worst length all lie inside our "
        f"intervals of ten runs: {columns}. All four at once: {', '.join(whole) or 'no reading'}."
    )


def _collision_free(samples: Samples) -> Entry:
    ours, all_free = [], True
    for reading in PLANNER_READINGS:
        touched = runs = 0
        for case in CASES:
            for law in LAWS:
                collisions = samples[trip_sample(reading, case, law)]["collisions"]
                touched += int(np.count_nonzero(collisions))
                runs += len(collisions)
        high = 100.0 * stats.share_interval(touched, runs)[1]
        text = f"{touched} of {runs} runs with contact (at most {high:.2g} %)"
        ours.append(Ours(reading=reading, value=text))
        all_free = all_free and touched == 0
    return _claim(
        "a collision-free path",
        ours,
        Verdict.REPRODUCED if all_free else Verdict.DIFFERS,
        "in these two scenarios, at the fitted speed and with SR measured to the enlarged edge; "
        "the paper states neither",
    )


def _shortest(samples: Samples, scenarios: Mapping[str, Scenario]) -> Entry:
    """Compare with the straight line, if driving it at the same speed is collision-free."""
    clear = []
    ours = []
    for reading in PLANNER_READINGS:
        excesses = []
        for case in CASES:
            task, speed = scenarios[case], PLANNERS[reading].speed_mps
            straight = distance(task.start_m, task.goal_m)
            gaps = step_clearances(task, 0.0, straight / speed, task.start_m, task.goal_m)
            lengths = samples[trip_sample(reading, case, "mfba")]["length_m"]
            excess = 100.0 * (float(lengths.mean()) / straight - 1.0)
            excesses.append(f"{case} {excess:+.2g} % over the straight line")
            if min(gaps) > 0.0:
                clear.append(f"{case}, {speed:g} m/s, {min(gaps):.2g} m to spare")
        ours.append(Ours(reading=reading, value=", ".join(excesses)))
    found = "; ".join(dict.fromkeys(clear))
    return _claim(
        "the shortest path",
        ours,
        Verdict.DIFFERS if clear else Verdict.NOT_STATED,
        f"driven at the same speed the straight line itself is collision-free ({found})"
        if clear
        else "the straight line is not collision-free, and the shortest path is not known here",
    )


def _compared(
    samples: Samples, claim: str, what: str, column: str, unit: str, better: float
) -> Entry:
    """Differences MFBA - BA by case and reading; better: 1.0 if less is better, else -1.0."""
    found: list[tuple[str, str, Array, Comparison]] = []
    for reading in PLANNER_READINGS:
        for case in CASES:
            mfba, ba = (
                better * samples[trip_sample(reading, case, law)][column] for law in ("mfba", "ba")
            )
            found.append((reading, case, mfba - ba, stats.compare_pairs(mfba, ba)))
    corrected = stats.holm([comparison.p for *_, comparison in found])
    ours, supported = [], []
    for reading in PLANNER_READINGS:
        means = []
        for (which, case, difference, _), p in zip(found, corrected):
            if which != reading:
                continue
            mean = stats.estimate(difference, lambda x: x.mean(1), stats.generator(8))
            means.append(f"{case} {better * mean.middle:+.3g} {unit} (p {p:.2g})")
            supported.append(p < SIGNIFICANT and mean.middle <= -NOTICEABLE[column])
        ours.append(Ours(reading=reading, value=", ".join(means)))
    names = [f"{reading} {case}" for reading, case, *_ in found]
    fits = [name for name, holds in zip(names, supported) if holds]
    return _claim(
        f"{claim} than BA",
        ours,
        Verdict.REPRODUCED if all(supported) else Verdict.DIFFERS,
        f"{what}, MFBA - BA, mean; noticeably {claim} in {', '.join(fits) or 'none of the four'}",
    )


def _run_time() -> Entry:
    times = {
        case: [
            float(published.BY_KEY[f"Section 6.2, {case}/{law}/run time"].text)
            for law in ("MFBA", "BA")
        ]
        for case in ("case 1", "case 2")
    }
    pairs = ", ".join(f"{case} {mfba:g} s against {ba:g} s" for case, (mfba, ba) in times.items())
    return _claim(
        "shortest time",
        [],
        Verdict.NOT_STATED,
        f"the printed run times (MFBA against BA) are {pairs}: computing times, of one run each",
    )


def _claim(text: str, ours: Sequence[Ours], verdict: Verdict, why: str) -> Entry:
    return Entry(
        place="abstract",
        row=text,
        column="claim",
        printed="claimed",
        ours=tuple(ours),
        verdict=verdict,
        why=why,
    )
