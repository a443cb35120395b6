# SPDX-License-Identifier: Apache-2.0
"""The conformance check finds each fault under its name, and passes sound optimisers."""

import random
import re
import signal

import numpy as np
import pytest

from mfba_planner import cli
from mfba_planner.core.errors import ConfigError, MfbaError
from mfba_planner.evaluation import optimizer_check
from mfba_planner.evaluation.optimizer_check import Property, check

ALL = [
    "ends", "region", "budget", "best", "small budget", "same seed", "other seed",
    "random numbers", "hash seed", "failed values",
]  # fmt: skip
# Of optimisers whose fault ends the search.
ENDED = {
    "CannotBeMade": ("ends", r"the factory raised TypeError \(no idea how\)"),
    "RaisesInAsk": ("ends", r"ask\(\) raised ValueError \(no idea where\)"),
    "RaisesInTell": ("ends", r"tell\(\) raised ZeroDivisionError \(mean of nothing\)"),
    "NoPoints": ("ends", r"ask\(\) returned no points"),
    "Outside": ("region", r"the point \(3, 3\) is outside the region"),
    "NotANumber": ("region", r"the point \(nan, 0\) is outside the region"),
    "ThreeNumbers": ("ends", r"a point of 3 numbers; give 2"),
    "Text": ("ends", r"list instead of points \(could not convert .*'n'\); give lists of numbers"),
    "Endless": ("ends", r"does not end: 0 evaluations in 0\.2 s"),
    "RunsNever": ("ends", r"run\(\) ended without an evaluation"),
    "CatchesAll": ("ends", r"does not end: 30 evaluations in 0\.2 s"),
}
OTHERS = {
    "TooMany": ("budget", "asks for 50 points at once of 30"),
    "Unseeded": ("same seed", r"other points \(\w{16}, then \w{16}\)"),
    "OneSeed": ("other seed", "the same points; use the generator, or set deterministic = True"),
    "GlobalNumpy": ("random numbers", r"changes the state of numpy\.random; draw from the gen"),
    "GlobalPython": ("random numbers", r"changes the state of Python's random; draw from the g"),
    "HashSeed": ("hash seed", r"other points: \w+ here, \w+ and \w+ with 0 and 1"),
    "TrustsValues": ("failed values", r"is NaN: tell\(\) raised OverflowError"),
    "WrongBest": ("best", r"best_value is [\d.]+, the best told [\d.]+"),
}


def faults(name: str, patience_s: float = 5.0) -> list[Property]:
    return [found for found in check(name, patience_s) if not found.ok]


@pytest.mark.parametrize("name", ["bats", "ba", "random", "grid", "faulty_optimizers:Sound"])
def test_sound_optimizers_have_every_property(name: str) -> None:
    found = list(check(name))
    assert [one.name for one in found] == ALL
    assert all(one.ok for one in found), found
    used = {one.name: one.text for one in found}
    assert used["budget"] == "30 of 30 evaluations"
    assert used["small budget"] == "10 of 10 evaluations"


def test_a_library_that_only_runs_is_sound_too() -> None:
    assert not faults("faulty_optimizers:Runs")
    found = {one.name: one.text for one in check("faulty_optimizers:RunsAFew")}
    assert found["budget"] == "3 of 30 evaluations, then it ends"


@pytest.mark.parametrize("name", ENDED)
def test_a_fault_that_ends_the_search_is_the_only_line(name: str) -> None:
    (found,) = check(f"faulty_optimizers:{name}", 0.2)
    expected, text = ENDED[name]
    assert (found.name, found.ok) == (expected, False)
    assert re.search(text, found.text), found.text


@pytest.mark.parametrize("name", OTHERS)
def test_every_other_fault_is_found_under_its_name(name: str) -> None:
    found = {one.name: one for one in faults(f"faulty_optimizers:{name}")}
    expected, text = OTHERS[name]
    assert expected in found
    assert re.search(text, found[expected].text), found[expected].text
    # An unseeded one differs in every process, too.
    assert set(found) - {expected} <= ({"hash seed"} if name == "Unseeded" else set())


def test_the_check_leaves_global_generators_and_alarms_as_they_were() -> None:
    before = random.getstate(), repr(np.random.get_state())  # noqa: NPY002
    handler = signal.getsignal(signal.SIGALRM)
    faults("faulty_optimizers:GlobalNumpy")
    faults("faulty_optimizers:GlobalPython")
    assert (random.getstate(), repr(np.random.get_state())) == before  # noqa: NPY002
    assert signal.getsignal(signal.SIGALRM) is handler
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


def test_a_process_that_cannot_be_compared_is_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(optimizer_check.sys, "executable", "/bin/false")
    (found,) = faults("random")
    assert (found.name, found.text) == ("hash seed", "a process of its own fails: exit code 1")


def test_the_command_prints_a_line_per_property(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["check-optimizer", "random"]) == 0
    head, *lines = capsys.readouterr().out.splitlines()
    assert head == "random"
    assert [line[9:29].strip() for line in lines] == ALL
    assert all(line.startswith("  ok     ") for line in lines)


def test_the_command_refuses_by_name_with_the_reasons(capsys: pytest.CaptureFixture[str]) -> None:
    names = ["faulty_optimizers:TooMany", "random", "faulty_optimizers:NoPoints"]
    with pytest.raises(MfbaError) as raised:
        cli.main(["check-optimizer", *names])
    assert str(raised.value) == (
        "optimizer faulty_optimizers:TooMany: refused: budget (asks for 50 points at once of 30); "
        "optimizer faulty_optimizers:NoPoints: refused: ends (ask() returned no points)"
    )
    assert "  fault  budget" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["none"], "optimizer none: no search, only the planner's own candidate"),
        (["randon"], r"optimizer 'randon': unknown; did you mean 'random'\?"),
        (
            ["random", "--patience=0"],
            "--patience=0: out of range; give more than 0, at most 3600 s",
        ),
    ],
)
def test_the_command_refuses_names_and_arguments(args: list[str], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        cli.main(["check-optimizer", *args])
