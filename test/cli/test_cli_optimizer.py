# SPDX-License-Identifier: Apache-2.0
"""`--set planner.optimizer`: in sim and sweep; wrong names and faults in one line."""

import csv
from pathlib import Path

import pytest

from mfba_planner import cli
from mfba_planner.entry_points import run_and_return_exit_code

Capture = pytest.CaptureFixture[str]


def mfba(*args: str) -> int:
    return run_and_return_exit_code(lambda: cli.main(list(args)), "mfba")


def rows(directory: Path) -> list[dict[str, str]]:
    with open(directory / "table.csv", encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize(
    ("args", "line"),
    [
        (["sim"], "optimizer 'randon': unknown; did you mean 'random'?"),
        (["sim", "--planner=paper"], "optimizer 'randon': unknown; did you mean 'random'?"),
        (["run"], "optimizer 'randon': unknown; did you mean 'random'?"),
        (["sweep", "random-3"], "optimizer 'randon': unknown; did you mean 'random'?"),
    ],
)
def test_an_unknown_optimizer_is_one_line(args: list[str], line: str, capsys: Capture) -> None:
    assert mfba(*args, "--set", "planner.optimizer=randon") == 1
    out, err = capsys.readouterr()
    assert (out, err) == ("", f"mfba: {line}\n")


@pytest.mark.parametrize("args", [["sim"], ["run"], ["sweep", "random-3"]])
def test_optimizer_is_short_for_set(args: list[str], capsys: Capture) -> None:
    assert mfba(*args, "--optimizer", "randon") == 1
    out, err = capsys.readouterr()
    assert (out, err) == ("", "mfba: optimizer 'randon': unknown; did you mean 'random'?\n")
    assert mfba(*args, "--optimizer=random", "--set=planner.optimizer=grid") == 1
    out, err = capsys.readouterr()
    line = "--optimizer random: --set planner.optimizer=grid; leave one of them out"
    assert (out, err) == ("", f"mfba: {line}\n")


def test_optimizer_decides_as_its_set_does(capsys: Capture) -> None:
    printed = []
    same = "--set=planner.optimizer=random"
    for args in (["--optimizer=random"], [same], ["--optimizer=random", same], []):
        assert mfba("sim", "case1", "--planner=paper", *args) == 0
        printed.append(capsys.readouterr().out)
    assert printed[0] == printed[1] == printed[2] != printed[3]


def test_sim_names_planner_and_optimizer(capsys: Capture) -> None:
    assert mfba("sim", "case1", "--planner=paper", "--set", "planner.optimizer=random") == 0
    assert capsys.readouterr().out.startswith("case1, paper with random, seed 0, core driver\n")


def test_a_fault_ends_a_simulation_in_one_line(capsys: Capture) -> None:
    faulty = "planner.optimizer=faulty_optimizers:NoPoints"
    assert mfba("sim", "case1", "--planner=paper", "--set", faulty) == 1
    assert capsys.readouterr().err == (
        "mfba: optimizer faulty_optimizers:NoPoints: ask() returned no points; see `mfba "
        "check-optimizer faulty_optimizers:NoPoints`\n"
    )


@pytest.mark.parametrize(
    ("name", "fault"),
    [
        ("NoPoints", "raised OptimizerError: optimizer faulty_optimizers:NoPoints: ask() ret"),
        ("Endless", "hung: no end after 2 s of wall time"),
    ],
)
def test_a_sweep_goes_on_with_the_run_marked_failed(name: str, fault: str, tmp_path: Path) -> None:
    args = ["--worlds=2", "--no-oracle", "--workers=1", "--patience=2", "--planner=paper"]
    args += ["--set", f"planner.optimizer=faulty_optimizers:{name}"]
    # A lidar far from all obstacles at first: the first decision searches. It never works: 1.
    assert mfba("sweep", "random-3", *args, "--out", str(tmp_path / "out")) == 1
    assert [row["success"] for row in rows(tmp_path / "out")] == ["false", "false"]
    assert fault in (tmp_path / "out/table.csv").read_text()


def test_a_sweep_with_another_optimizer_is_the_same_for_any_number_of_workers(
    tmp_path: Path,
) -> None:
    args = ["--worlds=4", "--no-oracle", "--planner=paper", "--set=planner.optimizer=random"]
    tables = []
    for workers in "12":
        out = tmp_path / workers
        assert mfba("sweep", "random-3", *args, f"--workers={workers}", "--out", str(out)) == 0
        tables.append((out / "table.csv").read_bytes())
    assert tables[0] == tables[1]
    assert b"planner.optimizer=random" in (tmp_path / "1/report.md").read_bytes()


def test_verify_imports_no_module_because_a_bag_names_it(tmp_path: Path, capsys: Capture) -> None:
    run, name = tmp_path / "run", "mfba_planner.optimizers.baselines:RandomSearch"
    settings = ["--planner=paper", "--set", f"planner.optimizer={name}"]
    assert mfba("run", "case1", "--driver=in-process", "--out", str(run), *settings) == 0
    capsys.readouterr()
    assert mfba("verify", str(run)) == 1
    assert capsys.readouterr().err == (
        f"mfba: {run / 'bag'}: its optimizer {name} is a module that would be imported; if you "
        "trust the bag, give --allow-modules\n"
    )
    assert mfba("verify", str(run), "--allow-modules", "--closed-loop") == 0
    assert capsys.readouterr().out.startswith("identical, ")
