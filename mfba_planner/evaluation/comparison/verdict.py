# SPDX-License-Identifier: Apache-2.0
"""Verdicts of a comparison, by rule: sentences about a group, and what all groups add up to."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from enum import Enum

from ..statistics import LEVEL
from .comparison_groups import Group, Pair

ALPHA = 1.0 - LEVEL
FEWEST_CASES = 6  # the least in which Wilcoxon's test can reach p < 0.05
MARGIN = 0.01  # of a mean loss: 1 - SPL of one point is taken as equal

RULES = (
    "An optimiser is *better* or *worse* than the reference where Wilcoxon's signed-rank test "
    "over the cases, corrected by Holm over the pairs of the group, has "
    f"p < {ALPHA:.2f}. Else they are *equal* where the 95 % interval of the mean difference of "
    f"losses lies within {100 * MARGIN:g} point, and *open* where it does not: neither a "
    "difference nor equality is shown. Of functions, whose values have no common scale, "
    f"equality is not judged. Below {FEWEST_CASES} cases, and where no run succeeds, everything "
    "is open and not counted. Groups are not corrected for each other: of twenty groups without "
    "any difference one shows some."
)


class Finding(Enum):
    """What is shown about an optimiser against the reference."""

    BETTER = "better"
    WORSE = "worse"
    EQUAL = "equal"
    OPEN = "open"


def is_judged(group: Group) -> bool:
    """Whether a group has enough cases for findings, and runs that succeed."""
    return group.cases >= FEWEST_CASES and not _all_fail(group)


def _all_fail(group: Group) -> bool:
    return not group.is_function and all(arm.loss.middle == 1.0 for arm in group.arms)


def finding(group: Group, pair: Pair) -> Finding:
    """The finding of a pair, by the rules in RULES."""
    if not is_judged(group):
        return Finding.OPEN
    if pair.p < ALPHA:
        return Finding.BETTER if pair.effect > 0.0 else Finding.WORSE
    return Finding.EQUAL if is_small(group, pair) else Finding.OPEN


def is_small(group: Group, pair: Pair) -> bool:
    """Whether a difference of losses lies within the margin, whatever its p."""
    interval = pair.paired.difference
    return not group.is_function and -MARGIN < interval.low <= interval.high < MARGIN


def verdict(group: Group) -> str:
    """One or two sentences about a group."""
    if group.ranks is None:
        return "No world has an optimum: nothing to compare."
    if group.cases < FEWEST_CASES:
        return f"{group.cases} cases are too few for a verdict (at least {FEWEST_CASES})."
    if _all_fail(group):
        return f"No run succeeds in any of {group.cases} worlds: nothing to compare."
    return " ".join([_by_ranks(group), *_by_pairs(group)])


def _by_ranks(group: Group) -> str:
    assert group.ranks is not None
    p, means = group.ranks.p, group.ranks.mean
    if p is None:
        return f"Two optimisers in {group.cases} cases."
    shown = "p < 0.0001" if p < 1e-4 else f"p = {p:.4f}"
    if p >= ALPHA:
        return f"No difference between the {len(means)} optimisers is shown (Friedman, {shown})."
    best = min(means)
    named = sorted(zip(means, [arm.optimizer for arm in group.arms]))
    near = [name for mean, name in named if mean - best < group.ranks.critical_difference]
    text = f"The optimisers differ (Friedman, {shown}); lowest mean rank: {near[0]}"
    if near[1:]:
        text += f", within the critical difference of it: {', '.join(near[1:])}"
    return text + "."


def _by_pairs(group: Group) -> Iterator[str]:
    if not group.pairs:
        return
    sorted_pairs: dict[Finding, list[str]] = {}
    for pair in group.pairs:
        found = finding(group, pair)
        name = pair.optimizer
        if found in (Finding.BETTER, Finding.WORSE) and is_small(group, pair):
            name += f" (by less than {100 * MARGIN:g} point)"
        sorted_pairs.setdefault(found, []).append(name)
    parts = [
        f"{which.value}: {', '.join(sorted_pairs[which])}"
        for which in Finding
        if which in sorted_pairs
    ]
    yield f"Against {group.pairs[0].against} {'; '.join(parts)}."


def tally(found: Sequence[Group]) -> dict[str, Counter[Finding]]:
    """For each optimiser, how often which finding, over all groups that are judged."""
    counts: dict[str, Counter[Finding]] = {}
    for group in filter(is_judged, found):
        for pair in group.pairs:
            counts.setdefault(pair.optimizer, Counter())[finding(group, pair)] += 1
    return counts


def overall(found: Sequence[Group], against: str) -> str:
    """A sentence about all groups of worlds: how often the search matters, and by how much."""
    places = [g for g in found if not g.is_function and is_judged(g)]
    if not places:
        return "No suite has enough worlds, and runs that succeed, for a verdict."
    pairs = [(g, pair) for g in places for pair in g.pairs if pair.against == against]
    of = Counter(finding(g, pair) for g, pair in pairs)
    large = sum(
        finding(g, pair) in (Finding.BETTER, Finding.WORSE) and not is_small(g, pair)
        for g, pair in pairs
    )
    counts = ", ".join(f"{which.value} {of[which]}" for which in Finding)
    return (
        f"Against {against}, in {len(places)} combinations of suite, planner and budget, "
        f"{len(pairs)} comparisons: {counts}. A difference that is shown and may exceed "
        f"{100 * MARGIN:g} point of loss: {large} of {len(pairs)}."
    )
