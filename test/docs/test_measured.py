# SPDX-License-Identifier: Apache-2.0
"""Figures in README and docs are those that the commands named printed: docs/measured/.

A page ties a paragraph, list or table to outputs by a comment line before it:
`<!-- measured: fuzz.txt soak.txt; not: 95 2.0 -->`. Every number of the block then stands in one
of the outputs, rounded as the page rounds it, or after `not:` (goals, settings, older versions);
`none` stands for no output.
"""

from __future__ import annotations

import re

import pytest
from project import ROOT
from shown_commands import PAGES

MEASURED = ROOT / "docs/measured"
# On these pages nothing is left untied.
WHOLE = ("docs/trust.md", "docs/performance.md")
TIE = re.compile(r"<!-- measured: (?P<files>[\w. -]+?)(?:; not: (?P<other>[\w. :-]+))? -->")
# Neither part of a name or version (v2, F1, 0.1.0) nor an exponent; thousands may be set apart.
NUMBER = re.compile(r"(?<![\w.^/-])-?\d+(?: \d{3})*(?:\.\d+)?(?![\w^]|\.\d)")
WITH_UNIT = re.compile(r"\d ?(?:%|m?s\b|us\b|[kMG]B\b|ticks\b|of \d)")


def blocks(page: str) -> list[tuple[str, str]]:
    """Each block of a page without code: its tie, "" without one, and its text."""
    text = re.sub(r"^```.*?^```$", "", page, flags=re.M | re.S)
    found = []
    for block in re.split(r"\n\s*\n", text):
        first, _, rest = block.strip().partition("\n")
        found.append((first, rest) if first.startswith("<!-- measured") else ("", block))
    return found


def numbers(text: str) -> set[str]:
    """The numbers of a text, without those in backticks, of links and of headings of tables."""
    text = re.sub(r"`[^`]*`|\]\([^)]*\)|^#.*$", " ", text, flags=re.M)
    return {match[0].replace(" ", "") for match in NUMBER.finditer(text)}


def is_rounded(number: str, values: set[float]) -> bool:
    """Whether a number is one of the values, rounded to its own digits."""
    digits = len(number.partition(".")[2])
    return any(abs(float(number) - value) <= 0.5000001 * 10.0**-digits for value in values)


def printed(name: str) -> set[float]:
    """The numbers that a command has printed, signs left out as well."""
    text = (MEASURED / name).read_text(encoding="utf-8")
    values = {float(word) for word in re.findall(r"-?\d+(?:\.\d+)?", text.replace(",", ""))}
    return values | {abs(value) for value in values}


TIED = [
    pytest.param(
        tie, text, id=f"{name}:{PAGES[name].count(chr(10), 0, PAGES[name].find(tie)) + 1}"
    )
    for name in PAGES
    for tie, text in blocks(PAGES[name])
    if tie
]


@pytest.mark.parametrize(("tie", "text"), TIED)
def test_figures_are_those_that_were_printed(tie: str, text: str) -> None:
    match = TIE.fullmatch(tie)
    assert match, f"{tie}: not as {TIE.pattern}"
    values = set().union(*(printed(name) for name in match["files"].split() if name != "none"))
    other = set((match["other"] or "").split())
    found = numbers(text)
    untied = {number for number in found - other if not is_rounded(number, values)}
    assert not untied, f"in none of {match['files']}"
    assert other <= found, "named as not measured, and not there"


@pytest.mark.parametrize("name", WHOLE)
def test_no_figure_of_the_page_is_untied(name: str) -> None:
    untied = [text for tie, text in blocks(PAGES[name]) if not tie and WITH_UNIT.search(text)]
    assert untied == []


def test_each_output_begins_with_its_command_and_is_used() -> None:
    files = {path.name: path.read_text(encoding="utf-8") for path in MEASURED.iterdir()}
    used = {
        name
        for page in PAGES.values()
        for tie in TIE.finditer(page)
        for name in tie["files"].split()
    }
    assert set(files) == used - {"none"}
    for name, text in files.items():
        command = re.match(r"\$ (?:\w+=\w+ )*(?:python (bench/\w+\.py)|make \w+|mfba \w+)", text)
        assert command, name
        assert command[1] is None or (ROOT / command[1]).is_file(), name


@pytest.mark.parametrize(
    ("number", "value", "equal"),
    [
        ("1.81", 1.8149, True),
        ("1.81", 1.816, False),
        ("119728", 119728.0, True),
        ("71", 71.4, True),
        ("71", 72.0, False),
        ("0.5", 0.45, True),
    ],
)
def test_a_number_is_compared_as_it_is_rounded(number: str, value: float, equal: bool) -> None:
    assert is_rounded(number, {value}) is equal


def test_numbers_of_a_block() -> None:
    text = "- **1250** of 119 728 in `x 7`, F1, v2, 0.1.0, 10^5; 71 % [64, 77], -0.5 to +2.5 s"
    assert numbers(text) == {"1250", "119728", "71", "64", "77", "-0.5", "2.5"}
