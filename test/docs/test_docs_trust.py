# SPDX-License-Identifier: Apache-2.0
"""The commands of docs/trust.md, reduced: fuzzing, a mutation test that resumes, coverage."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import shown_commands
from project import ROOT
from shown_commands import PAGES, reduced

FUZZ, *SOAKS, MUTATION = shown_commands.commands(PAGES["docs/trust.md"])


def test_fuzzing_prints_counts(tmp_path: Path) -> None:
    lines = shown_commands.script(reduced(FUZZ), tmp_path).splitlines()
    assert [line.partition(" cases")[0] for line in lines] == ["scenario: 10", "parameters: 10"]
    assert "failed" not in "".join(lines)


@pytest.mark.parametrize("command", SOAKS, ids=lambda words: words[2])
def test_a_soak_reads_its_processes_and_counts_ticks(command: list[str], tmp_path: Path) -> None:
    """Whether memory is flat is not known after some seconds."""
    words = reduced(command)
    done = subprocess.run(
        [sys.executable, ROOT / words[1], *words[2:]],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    nodes = ["all nodes"]
    if words[2] == "disturbed":
        nodes = ["recorder", "world_sim", "virtual_sensor"]
    for name in nodes:
        assert re.search(rf"^{name} +\d+ readings +[+-][\d.]+ MB", done.stdout, re.M), done.stderr
    (last,) = re.findall(r"^/odom: ticks 1 to (\d+), 0 missing", done.stdout, re.M)
    assert int(last) >= 350
    assert done.returncode == int("flat and whole" not in done.stdout)


def test_a_mutation_test_is_kept_and_resumed(tmp_path: Path) -> None:
    first = shown_commands.script(reduced(MUTATION), tmp_path).splitlines()
    results = (tmp_path / "sample.jsonl").read_text(encoding="utf-8").splitlines()
    assert len(results) == 3
    fates = [json.loads(line)["fate"] for line in results]
    assert f"all              3 mutants, {fates.count('survived'):4} survived" in first[-1]
    again = shown_commands.script(reduced(MUTATION), tmp_path).splitlines()
    assert again[-1] == first[-1]
    assert (tmp_path / "sample.jsonl").read_text(encoding="utf-8").splitlines() == results


def test_the_whole_package_and_its_processes_are_measured(tmp_path: Path) -> None:
    test = tmp_path / "test_it.py"
    test.write_text(
        "import subprocess, sys\n"
        "def test_it():\n"
        "    code = 'from mfba_planner.entry_points import mfba; mfba()'\n"
        "    subprocess.run([sys.executable, '-c', code, 'scenarios'], check=True)\n",
        encoding="utf-8",
    )
    config = ROOT / "tools/coverage.toml"
    arguments = ["--cov", f"--cov-config={config}", "--cov-report=", str(test)]
    # A report of all files takes seconds.
    two = "--include=*/cli/scenarios.py,*/ros/nodes/planner.py"
    for program in (
        ["pytest", "-q", "-p", "no:cacheprovider", *arguments],
        ["coverage", "json", "-q", f"--rcfile={config}", two],
    ):
        done = subprocess.run(
            [sys.executable, "-m", *program],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
    files = json.loads((tmp_path / "coverage.json").read_text(encoding="utf-8"))["files"]
    covered = {
        name.rpartition("mfba_planner/")[2]: file["summary"]["percent_covered"]
        for name, file in files.items()
    }
    assert covered["cli/scenarios.py"] > 50.0, "in a process of its own"
    assert covered["ros/nodes/planner.py"] == 0.0, "of the whole package"
