# SPDX-License-Identifier: Apache-2.0
"""Printed numbers that are impossible, with the reason computed from other printed numbers."""

from __future__ import annotations

import math

from . import published

TABLE_2_MINIMUM = {row[0]: float(row[4]) for row in published.FUNCTION_ROWS}
SMALLEST_FIGURE = 1e-4  # a best of F6 below the minimum by less than this may be rounding


def largest_sd(n: int, low: float, high: float, mean: float) -> float:
    """Largest sample SD of n values in [low, high] with this mean.

    The sum of squares is convex, so all values but one are at an end of the interval.
    """
    at_high, rest = divmod((mean - low) * n, high - low)
    squares = at_high * (high - mean) ** 2 + (low + rest - mean) ** 2
    squares += (n - 1 - at_high) * (low - mean) ** 2
    return math.sqrt(squares / (n - 1))


def smallest_sd(n: int, low: float, high: float, mean: float) -> float:
    """Smallest population SD of n values with this minimum, maximum and mean.

    Two values are minimum and maximum; the other n - 2 are equal.
    """
    rest = (n * mean - low - high) / (n - 2)
    squares = (low - mean) ** 2 + (high - mean) ** 2 + (n - 2) * (rest - mean) ** 2
    return math.sqrt(squares / n)


def _spread(n: int, low: float, high: float, mean: float, sd: float) -> str:
    """Why this SD is impossible, whether divided by n or n - 1; "" if it is possible."""
    largest, smallest = largest_sd(n, low, high, mean), smallest_sd(n, low, high, mean)
    if sd > largest:
        return (
            f"{n} values in [{low:.10g}, {high:.10g}] with mean {mean:.10g} have a standard "
            f"deviation of at most {largest:.3g}: printed {sd / largest:.0f} times that"
        )
    if sd < smallest:
        return (
            f"{n} values with minimum {low:.4g}, maximum {high:.4g} and mean {mean:.4g} have a "
            f"standard deviation of at least {smallest:.3g}"
        )
    return ""


def _benchmark() -> dict[str, str]:
    found = {}
    for row in dict.fromkeys(p.row for p in published.BENCHMARK):
        v = published.values("Table 3", row)
        reason = _spread(published.BENCHMARK_RUNS, v["best"], v["worst"], v["mean"], v["sd"])
        if reason:
            found[f"Table 3/{row}/sd"] = reason
        minimum = TABLE_2_MINIMUM[row.split()[0]]
        for column in ("best", "worst", "mean"):
            if v[column] < minimum - SMALLEST_FIGURE:
                found[f"Table 3/{row}/{column}"] = (
                    f"below {minimum:g}, the least value inside the search range of Table 2: "
                    "the bats must have left it"
                )
    return found


def _trips() -> dict[str, str]:
    found = {}
    for table in published.TRIPS:
        for row in ("BA", "MFBA"):
            v = published.values(table, row)
            reason = _spread(
                published.TRIP_RUNS,
                v["minimum"],
                v["maximum"],
                v["mean"],
                v["standard deviation"],
            )
            if reason:
                found[f"{table}/{row}/standard deviation"] = reason
    return found


def _text() -> dict[str, str]:
    """Compare the best lengths in the text with 1 / the largest fitness in the tables."""
    found = {}
    for case, table in (("case 1", "Table 5"), ("case 2", "Table 7")):
        for row in ("BA", "MFBA"):
            text = published.BY_KEY[f"Section 6.2, {case}/{row}/length"]
            length = 1.0 / published.values(table, row)["maximum"]
            if f"{length:.4f}" != text.text:
                found[text.key] = (
                    f"{table}'s largest fitness means {length:.4f} m: one of the two is wrong"
                )
                found[f"{table}/{row}/maximum"] = (
                    f"means {length:.4f} m, the text says {text.text} m: one of the two is wrong"
                )
    straight = 12.0 * math.sqrt(2.0)
    if f"{straight:.4f}" != "16.9705":
        found["Section 6.2/optimum/length"] = f"12 sqrt(2) is {straight:.4f}: cut, not rounded"
    return found


# {key of a printed number: reason}: impossible for any run; contradicts another printed number.
IMPOSSIBLE: dict[str, str] = {**_benchmark(), **_trips()}
CONTRADICTED: dict[str, str] = _text()
