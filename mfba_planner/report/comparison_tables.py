# SPDX-License-Identifier: Apache-2.0
"""The report of a comparison of optimisers: Markdown, and plain data for JSON."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

from mfba_planner.evaluation.comparison.comparison_groups import ArmResult, Group
from mfba_planner.evaluation.comparison.verdict import (
    RULES,
    Finding,
    finding,
    overall,
    tally,
    verdict,
)
from mfba_planner.evaluation.statistics import Interval
from mfba_planner.evaluation.suites import suite

from .result_json import plain
from .sweep_tables import markdown, percent, points

_NONE = "-"
WORLD_HEAD = (
    "optimiser", "runs", "success", "gap", "loss (1 - SPL)", "turning rad", "decision us",
    "failed", "mean rank",
)  # fmt: skip
FUNCTION_HEAD = ("optimiser", "runs", "median error", "25 % to 75 %", "failed", "mean rank")
PAIR_HEAD = (
    "optimiser", "lower loss", "higher", "ties", "mean difference", "p (Holm)", "effect",
    "finding",
)  # fmt: skip
NOTE = (
    "95 % intervals: Wilson's for success, bootstrap over worlds for means. Gap to the oracle's "
    "path and turning: of successes. Loss: 1 - SPL in worlds with an optimum, 1 for a failure; "
    "equal if they agree to six digits. Decision: median by this machine's clock. Mean rank: 1 is "
    "best. Effect: rank-biserial correlation, 1 if the optimiser is better in every case that is "
    "not a tie, -1 if the reference is. Errors of functions below 1e-12 are equal."
)


def to_markdown(
    found: Sequence[Group], against: str, title: str, facts: Sequence[str], pictures: Sequence[str]
) -> str:
    """The report: verdicts first, then the tables of each group."""
    blocks = [f"# {title}", "\n".join(f"- {fact}" for fact in facts), "## Verdicts"]
    blocks += [*verdicts(found, against), RULES, NOTE]
    blocks += [f"![{name.partition('.')[0]}]({name})" for name in pictures]
    for group in found:
        blocks += [f"## {group.title}", _facts_of(group), arm_table(group)]
        if group.pairs:
            blocks += [f"Against {group.pairs[0].against}:", pair_table(group)]
        blocks += failures(group)
    return "\n\n".join(blocks) + "\n"


def page_block(
    found: Sequence[Group], against: str, facts: Sequence[str], pictures: Sequence[str]
) -> str:
    """The same for a page of the documentation: without pairs, and without functions' tables."""
    blocks = ["\n".join(f"- {fact}" for fact in facts), *verdicts(found, against), RULES]
    blocks += [f"![{caption}]({name})" for caption, name in zip(("Ranks", "Losses"), pictures)]
    blocks.append(NOTE)
    for group in found:
        if not group.is_function:
            blocks += [f"**{group.title}**: {_facts_of(group)}", arm_table(group)]
    return "\n\n".join(blocks)


def verdicts(found: Sequence[Group], against: str) -> list[str]:
    """Paragraphs: the sentence about all groups, counts, and a sentence for each group."""
    lines = (f"- {group.title}: {verdict(group)}" for group in found)
    return [overall(found, against), *tally_tables(found), "\n".join(lines)]


def tally_tables(found: Sequence[Group]) -> list[str]:
    """How often which finding, one line per optimiser; worlds and functions apart."""
    blocks = []
    for title, some in (
        ("suites", [group for group in found if not group.is_function]),
        ("functions", [group for group in found if group.is_function]),
    ):
        head = (f"in {title}", *(which.value for which in Finding))
        lines = [
            [name, *(str(counts[which]) for which in Finding)]
            for name, counts in tally(some).items()
        ]
        blocks += [markdown(head, lines)] * bool(lines)
    return blocks


def _facts_of(group: Group) -> str:
    text = f"{group.cases} {'seeds' if group.is_function else 'worlds'}"
    distinct = None if group.is_function else suite(group.suite).distinct
    if distinct is not None:
        text += f" ({distinct} different ones, repeated with other seeds: it holds for these only)"
    if group.left_out:
        text += f", {group.left_out} without an optimum left out of losses and ranks"
    if group.ranks is not None:
        text += f"; critical difference of mean ranks {group.ranks.critical_difference:.2f}"
    return text + "."


def arm_table(group: Group) -> str:
    """One line per optimiser, as Markdown."""
    head = FUNCTION_HEAD if group.is_function else WORLD_HEAD
    ranks = group.ranks.mean if group.ranks else [math.nan] * len(group.arms)
    line = _function_line if group.is_function else _world_line
    return markdown(head, (line(arm, rank) for arm, rank in zip(group.arms, ranks)))


def _world_line(arm: ArmResult, mean_rank: float) -> list[str]:
    s = arm.summary
    assert s is not None
    return [
        arm.optimizer,
        str(arm.runs),
        percent(s.success),
        percent(s.gap),
        percent(arm.loss) if math.isfinite(arm.loss.middle) else _NONE,
        _interval(arm.turning_rad),
        _NONE if s.decision_us is None else f"{s.decision_us:.0f}",
        str(arm.failed),
        _rank(mean_rank),
    ]


def _function_line(arm: ArmResult, mean_rank: float) -> list[str]:
    assert arm.errors is not None
    low, middle, high = arm.errors
    return [
        arm.optimizer,
        str(arm.runs),
        f"{middle:.2g}",
        f"{low:.2g} to {high:.2g}",
        str(arm.failed),
        _rank(mean_rank),
    ]


def _rank(mean_rank: float) -> str:
    return f"{mean_rank:.2f}" if math.isfinite(mean_rank) else _NONE


def _interval(interval: Interval | None) -> str:
    if interval is None:
        return _NONE
    return f"{interval.middle:.2f} [{interval.low:.2f}, {interval.high:.2f}]"


def pair_table(group: Group) -> str:
    """One line per optimiser against the reference, as Markdown."""
    return markdown(PAIR_HEAD, _pair_lines(group))


def _pair_lines(group: Group) -> Iterator[list[str]]:
    for pair in group.pairs:
        found = pair.paired
        yield [
            pair.optimizer,
            str(found.wins),
            str(found.losses),
            str(found.ties),
            _NONE if group.is_function else points(found.difference),
            "< 1e-4" if pair.p < 1e-4 else f"{pair.p:.4f}",
            f"{pair.effect:+.2f}",
            finding(group, pair).value,
        ]


def failures(group: Group) -> list[str]:
    """A paragraph on failures of optimisers, by reason; none without any."""
    lines = [
        f"- {arm.optimizer}: {count} x {reason}"
        for arm in group.arms
        for reason, count in (arm.summary.failures if arm.summary else ())
    ]
    return ["\n".join(lines)] if lines else []


def to_json(found: Sequence[Group], against: str) -> dict[str, Any]:
    """All figures but computing times as plain data; null where there is none."""
    groups = []
    for group in found:
        data = asdict(group)
        for arm in data["arms"]:
            if arm["summary"] is not None:
                del arm["summary"]["decision_us"]
        for pair, data_of_pair in zip(group.pairs, data["pairs"]):
            data_of_pair["finding"] = finding(group, pair).value
        groups.append({**data, "verdict": verdict(group)})
    return {"schema_version": 1, "verdict": overall(found, against), "groups": plain(groups)}
