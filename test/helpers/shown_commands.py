# SPDX-License-Identifier: Apache-2.0
"""Find and run the commands and the code that README and docs show."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from tempfile import NamedTemporaryFile

import forked_commands
from project import ROOT

# README and docs, except the generated pages (docs/reference).
PAGES = {
    str(path.relative_to(ROOT)): path.read_text(encoding="utf-8")
    for path in (ROOT / "README.md", *sorted(ROOT.glob("docs/**/*.md")))
    if path.parent.name != "reference"
}
_BENCH = "python bench/benchmark.py"
_SMALL = "--others 2 --few 2 --rounds 1 --workers 1 --docs docs"
_ONE_SUITE = "--worlds 2 --first 10184"
# Commands that take too long for a test, and the reduced command that runs instead.
REDUCED = {
    ".venv/bin/mfba sim case2 --seeds 100": ".venv/bin/mfba sim case2 --seeds 3",
    "mfba sim walled --seeds 100": ("mfba sim walled --seeds 3"),
    ".venv/bin/mfba sim hall.yaml --seeds 20": ".venv/bin/mfba sim hall.yaml --seeds 2",
    ".venv/bin/mfba sim crossing.yaml --seeds 20": ".venv/bin/mfba sim crossing.yaml --seeds 2",
    # Ten robots with a lidar each; the page also simulates and runs three of them.
    ".venv/bin/mfba sim swap --seeds 3": ".venv/bin/mfba sim swap --seeds 2 --planner paper",
    ".venv/bin/mfba run swap --seed 3 --out runs/swap": (
        ".venv/bin/mfba run swap --seed 3 --planner paper --out runs/swap"
    ),
    # Starting two workers and the processes in which they run planners takes longer than the work.
    ".venv/bin/mfba sweep random-10 --planner paper --planner predictive --worlds 6 "
    "--out runs/sweep": (
        ".venv/bin/mfba sweep random-10 --planner paper --planner predictive --worlds 4 "
        "--workers 1 --out runs/sweep"
    ),
    ".venv/bin/mfba sweep random-10 --planner paper --planner predictive --worlds 4 "
    "--out runs/few": (
        ".venv/bin/mfba sweep random-10 --planner paper --planner predictive --worlds 4 "
        "--workers 1 --out runs/few"
    ),
    ".venv/bin/mfba compare paper F5 --quick --worlds 6 --budget 25": (
        ".venv/bin/mfba compare paper F5 --quick --worlds 6 --budget 25 --workers 1"
    ),
    ".venv/bin/mfba sensitivity --quick": ".venv/bin/mfba sensitivity --quick --workers 1",
    ".venv/bin/mfba sweep worlds --planner predictive --planner paper --planner orca "
    "--planner dwa --set planner.speed_mps=1 --out runs/barn": (
        ".venv/bin/mfba sweep worlds --planner predictive --planner paper --planner orca "
        "--planner dwa --set planner.speed_mps=1 --workers 1 --out runs/barn"
    ),
    ".venv/bin/mfba sweep crossings --planner predictive --planner orca "
    "--set planner.speed_mps=1 --out runs/people": (
        ".venv/bin/mfba sweep crossings --planner predictive --planner orca "
        "--set planner.speed_mps=1 --workers 1 --out runs/people"
    ),
    # cli/test_cli_animate.py makes one of the default size.
    ".venv/bin/mfba animate runs/watched runs/watched.webp": (
        ".venv/bin/mfba animate runs/watched runs/watched.webp --fps 4 --width 320"
    ),
    ".venv/bin/mfba animate runs/case2 runs/case2.webp": (
        ".venv/bin/mfba animate runs/case2 runs/case2.webp --fps 4 --width 320"
    ),
    "mfba sweep random-10 --planner skirt:Skirt --planner paper --worlds 100": (
        "mfba sweep random-10 --planner skirt:Skirt --planner paper --worlds 4 --workers 1"
    ),
    "mfba sweep random-10 --planner paper --planner predictive --worlds 100 "
    "--set planner.optimizer=my_swarm:ParticleSwarm --out runs/mine": (
        "mfba sweep random-10 --planner paper --planner predictive --worlds 2 --workers 1 "
        "--set planner.optimizer=my_swarm:ParticleSwarm --out runs/mine"
    ),
    "mfba sweep random-10 --planner paper --planner predictive --worlds 100 --out runs/bats": (
        "mfba sweep random-10 --planner paper --planner predictive --worlds 2 --workers 1 "
        "--out runs/bats"
    ),
    "mfba compare --quick --out runs/quick": (
        "mfba compare --quick --worlds 6 --runs 6 --budget 25 --workers 1 --out runs/quick"
    ),
    "mfba compare paper random-20 rooms F1 F2 F3 F4 F5 F6 --optimizer mfba --optimizer ba "
    "--optimizer random --optimizer grid --optimizer none --optimizer cmaes:CMA "
    "--optimizer niapy:ParticleSwarmAlgorithm --budget 25 --budget 150 --worlds 10 --runs 30 "
    "--first 80000 --update docs/optimizers.md": (
        "mfba compare paper F1 --planner paper --optimizer mfba --optimizer none --optimizer ba "
        "--budget 25 --worlds 2 --runs 6 --workers 1 --update docs/optimizers.md"
    ),
    "mfba compare rooms --planner predictive --optimizer mfba --optimizer none --budget 25 "
    "--worlds 60 --first 80000 --out runs/rooms": (
        "mfba compare rooms --planner predictive --optimizer mfba --optimizer none --budget 25 "
        "--worlds 1 --first 80000 --workers 1 --no-oracle --out runs/rooms"
    ),
    "mfba compare random-10 F5 --planner paper --optimizer mfba --optimizer random "
    "--optimizer my_swarm:ParticleSwarm --worlds 100 --runs 100 --out runs/compared": (
        "mfba compare random-10 F5 --planner paper --optimizer mfba --optimizer random "
        "--optimizer my_swarm:ParticleSwarm --worlds 6 --runs 6 --budget 25 --workers 1 "
        "--no-oracle --out runs/compared"
    ),
    "python bench/fuzz.py scenario map import parameters bag messages --cases 4000 --first 1000 "
    "--budget 40": "python bench/fuzz.py scenario parameters --cases 10",
    "python bench/mutation.py --sample 150 --budget 1300 --jobs 1 --out runs/sample.jsonl": (
        "python bench/mutation.py swarm/search_region --sample 3 --jobs 1 --out sample.jsonl"
    ),
    "python bench/soak.py in-process --ticks 1000000": (
        "python bench/soak.py in-process --ticks 2000"
    ),
    "python bench/soak.py disturbed --hours 8 --speed 20": (
        "python bench/soak.py disturbed --hours 0.01 --speed 20 --every 0.3"
    ),
    "python bench/robots.py": "python bench/robots.py --worlds 1 --only sectors",
    "python bench/kidnapped.py --graph 5": "python bench/kidnapped.py --graph 1 --count 1",
    "python bench/tracking.py --seeds 30": (
        "python bench/tracking.py --seeds 1 --only 1.5 --worlds 1"
    ),
    "python bench/static_map.py --worlds 5": (
        "python bench/static_map.py --worlds 1 --only fast-20"
    ),
    "python bench/tracking.py --memory 100000": "python bench/tracking.py --memory 20",
    "python bench/startup.py --rounds 3": "python bench/startup.py --rounds 1 --only help",
    "python bench/graph_speed.py --pairs 3": "python bench/graph_speed.py --pairs 1 --steps 200",
    "python bench/startup.py --imports verify": "python bench/startup.py --imports verify",
    "python examples/mujoco_robot/run.py --world 1 --film --out runs/physics": (
        "python examples/mujoco_robot/run.py --world 1 --time-limit 2 --out runs/physics"
    ),
    "python examples/mujoco_robot/many_worlds.py --graph 25": (
        "python examples/mujoco_robot/many_worlds.py --worlds 1 --first 1 --workers 1 "
        "--only MuJoCo"
    ),
    "python bench/fleet.py": "python bench/fleet.py --seeds 1 --robots 3 --radius 3",
}
# Lines of a page with the name of the file for a block of YAML.
_SAVED = re.compile(r"^[^`\n]*\b[Ss]aved? (?:this )?as `([\w.]+)`", re.MULTILINE)


def blocks(text: str, language: str) -> list[str]:
    """The contents of the code blocks of a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def commands(text: str) -> list[list[str]]:
    """The shell commands of a page, split into words and at &&."""
    lines = [line for block in blocks(text, "sh") for line in block.splitlines() if line.strip()]
    words = [shlex.split(line, comments=True) for line in lines]
    return [command for line in words for command in _split_at_and(line)]


def _split_at_and(words: list[str]) -> list[list[str]]:
    found: list[list[str]] = [[]]
    for word in words:
        if word == "&&":
            found.append([])
        else:
            found[-1].append(word)
    return found


def inline(text: str) -> list[list[str]]:
    """The commands with arguments in the running text of a page, split into words."""
    prose = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    return [shlex.split(line) for line in re.findall(r"`((?:python|make) [^`]+)`", prose)]


def reduced(command: list[str]) -> list[str]:
    """The command that a test runs: the same, or its reduced form in REDUCED.

    The whole benchmark becomes one of two worlds per suite; with --out, of one suite.
    """
    if command[:2] == _BENCH.split():
        if "--out" in command:
            out = command[command.index("--out") + 1]
            return shlex.split(f"{_BENCH} {_ONE_SUITE} {_SMALL} --out {out} --suite random-20")
        return shlex.split(f"{_BENCH} --worlds 2 --first 10000 {_SMALL}")
    return shlex.split(REDUCED.get(" ".join(command), " ".join(map(shlex.quote, command))))


def script(command: list[str], cwd: Path, *paths: Path, code: int = 0) -> str:
    """Run `python bench/...` in cwd, with more paths to import from; return its stdout."""
    done = subprocess.run(
        [sys.executable, ROOT / command[1], *command[2:]],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, (*paths, ROOT)))},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == code, f"{command}\n{done.stderr}"
    return done.stdout


def mfba_arguments(command: list[str]) -> list[str] | None:
    """The arguments of an `mfba` command; None for other programs."""
    return command[1:] if command[0] in (".venv/bin/mfba", "mfba") else None


def mfba(arguments: list[str], cwd: Path, *, code: int = 0) -> str:
    """Run `mfba` in cwd; return stdout and stderr."""
    with NamedTemporaryFile() as output:
        found = forked_commands.mfba(arguments, cwd, Path(output.name), 180.0)
        printed = output.read().decode()
    assert found == code, f"mfba {arguments}\n{printed}"
    return printed


def python(code: str, cwd: Path) -> str:
    """Run a block of Python in cwd; return its stdout."""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=cwd, capture_output=True, text=True, timeout=90
    )
    assert done.returncode == 0, f"{code}\n{done.stderr}"
    return done.stdout


def save(text: str, cwd: Path) -> None:
    """Save the YAML blocks of a page under the file names in its text."""
    for name, content in zip(_SAVED.findall(text), blocks(text, "yaml"), strict=True):
        (cwd / name).write_text(content, encoding="utf-8")


def run_page(text: str, cwd: Path) -> None:
    """Save the YAML of a page, run its commands, then its Python.

    A block of `console` must print just what it shows.
    """
    for name in ("config", "test"):
        (cwd / name).symlink_to(ROOT / name)
    save(text, cwd)
    for command in commands(text):
        arguments = mfba_arguments(reduced(command))
        if arguments is not None:
            mfba(arguments, cwd)
    for shown in blocks(text, "console"):
        line, _, expected = shown.removeprefix("$ ").partition("\n")
        arguments = mfba_arguments(shlex.split(line))
        assert arguments is not None
        assert mfba(arguments, cwd, code=int(expected.startswith("mfba: "))) == expected
    for code in blocks(text, "python"):
        python(code, cwd)
