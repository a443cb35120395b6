# SPDX-License-Identifier: Apache-2.0
"""Scores against an optimum: worked examples."""

import math

import pytest
from trip_samples import trip

from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.evaluation.optimality_scores import (
    barn_score,
    optimality_gap,
    spl,
    time_to_goal_s,
)
from mfba_planner.simulation.episode import Outcome


def test_gap_of_a_run_that_is_a_tenth_too_long() -> None:
    assert optimality_gap(18.7, 17.0) == pytest.approx(0.1)
    assert optimality_gap(17.0, 17.0) == 0.0
    assert optimality_gap(16.99, 17.0) < 0.0


def test_spl_is_optimum_over_length() -> None:
    assert spl(True, 20.0, 17.0) == pytest.approx(0.85)
    assert spl(True, 16.9, 17.0) == 1.0, "nothing is better than the optimum"
    assert spl(False, 17.0, 17.0) == 0.0


def test_barn_score_is_clipped_at_twice_and_eight_times_the_optimal_time() -> None:
    # the optimum takes 10 s: up to 20 s the score is 0.5, from 80 s on 0.125
    for time_s, score in ((10.0, 0.5), (20.0, 0.5), (25.0, 0.4), (80.0, 0.125), (900.0, 0.125)):
        assert barn_score(True, time_s, 10.0) == pytest.approx(score)
    assert barn_score(False, 10.0, 10.0) == 0.0


def test_time_to_goal_is_infinite_without_arrival() -> None:
    points = [(0.0, 0.0), (1.0, 0.0)]
    assert time_to_goal_s(evaluate(trip(points))) == 1.0
    assert time_to_goal_s(evaluate(trip(points, outcome=Outcome.TIME_LIMIT))) == math.inf
