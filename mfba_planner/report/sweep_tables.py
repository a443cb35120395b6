# SPDX-License-Identifier: Apache-2.0
"""The tables of a sweep's report: for terminals, and as Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from rich.table import Table

from mfba_planner.evaluation.statistics import Interval
from mfba_planner.evaluation.sweep.summary import PlannerSummary, Versus

_NONE = "-"
HEAD = (
    "planner", "runs", "success", "certified", "collided", "by robot / standing", "time limit",
    "failed", "length m", "time s", "gap", "gap 95 %", "SPL", "BARN", "clearance m", "decision us",
)  # fmt: skip
NOTE = (
    "95 % intervals: Wilson's for rates, bootstrap over worlds for means. certified: success "
    "where the oracle holds a collision-free trajectory; gap, length, time, clearance: of "
    "successes; "
    "gap 95 %: 95th percentile; collided: runs; decision: median by this machine's clock"
)
VERSUS_HEAD = (
    "planner", "against", "only it succeeds", "only the other", "p (sign)", "worlds with gaps",
    "shorter", "longer", "mean difference of gaps", "p (sign)", "p (Wilcoxon)",
)  # fmt: skip
VERSUS_NOTE = "the same worlds with the same seeds; gaps where both succeeded, negative: shorter"


def tables(
    summaries: Sequence[PlannerSummary], versus: Sequence[Versus], title: str
) -> list[Table]:
    """Tables for a terminal."""
    found = [_table(title, HEAD, _summary_lines(summaries), NOTE)]
    if versus:
        found.append(_table("In pairs", VERSUS_HEAD, _versus_lines(versus), VERSUS_NOTE))
    return found


def to_markdown(
    summaries: Sequence[PlannerSummary], versus: Sequence[Versus], title: str, facts: Sequence[str]
) -> str:
    """The same as a Markdown page; facts: lines about how the sweep was made."""
    blocks = [f"# {title}", "\n".join(f"- {fact}" for fact in facts)]
    blocks += [summary_table(summaries), NOTE + "."]
    failures = [
        f"- {s.planner}: {count} x {reason}" for s in summaries for reason, count in s.failures
    ]
    if failures:
        blocks += ["## Failures of planners", "\n".join(failures)]
    if versus:
        blocks += ["## In pairs", versus_table(versus), VERSUS_NOTE + "."]
    return "\n\n".join(blocks) + "\n"


def summary_table(summaries: Sequence[PlannerSummary]) -> str:
    """One line per planner, as Markdown."""
    return markdown(HEAD, _summary_lines(summaries))


def versus_table(versus: Sequence[Versus]) -> str:
    """One line per pair of planners, as Markdown."""
    return markdown(VERSUS_HEAD, _versus_lines(versus))


def _summary_lines(summaries: Sequence[PlannerSummary]) -> Iterator[list[str]]:
    for s in summaries:
        yield [
            s.planner,
            str(s.runs),
            percent(s.success),
            f"{percent(s.certified)} of {s.certified_runs}" if s.certified else _NONE,
            str(s.collisions),
            f"{s.hits_moving} / {s.hits_standing}",
            str(s.timeouts),
            str(sum(count for _, count in s.failures)),
            _number(s.length_m, 3),
            _number(s.time_s, 2),
            percent(s.gap),
            percent(s.gap_95),
            _number(s.spl, 3),
            _number(s.barn, 3),
            _number(s.clearance_m, 3),
            _NONE if s.decision_us is None else f"{s.decision_us:.0f}",
        ]


def _versus_lines(versus: Sequence[Versus]) -> Iterator[list[str]]:
    for v in versus:
        gap = [_NONE] * 6
        if v.gap is not None:
            counts = [str(n) for n in (v.gap.n, v.gap.wins, v.gap.losses)]
            gap = [*counts, points(v.gap.difference), _p(v.gap.sign_p), _p(v.gap.rank_p)]
        yield [v.planner, v.other, str(v.wins), str(v.losses), _p(v.p), *gap]


def _table(title: str, head: Sequence[str], lines: Iterator[list[str]], note: str) -> Table:
    """One column per planner or pair: too many numbers for one line."""
    columns = [head, *lines]
    table = Table(title=title, title_justify="left", box=None, pad_edge=False, show_header=False)
    table.caption, table.caption_justify = note, "left"
    for k in range(len(columns)):
        table.add_column(style="" if k else "dim", no_wrap=not k)
    for cells in zip(*columns):
        table.add_row(*cells)
    return table


def markdown(head: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    rows = [head, ["---"] * len(head), *lines]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in rows)


def percent(interval: Interval | None) -> str:
    """A share and its interval, in per cent."""
    if interval is None:
        return _NONE
    middle, low, high = (100.0 * v for v in (interval.middle, interval.low, interval.high))
    return f"{middle:.2f} % [{low:.2f}, {high:.2f}]"


def points(interval: Interval) -> str:
    """A difference of shares and its interval, in percentage points."""
    middle, low, high = (100.0 * v for v in (interval.middle, interval.low, interval.high))
    return f"{middle:+.2f} [{low:+.2f}, {high:+.2f}] points"


def _number(interval: Interval | None, digits: int) -> str:
    if interval is None:
        return _NONE
    return f"{interval.middle:.{digits}f} [{interval.low:.{digits}f}, {interval.high:.{digits}f}]"


def _p(p: float) -> str:
    return "< 1e-4" if p < 1e-4 else f"{p:.4f}"
