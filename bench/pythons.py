# SPDX-License-Identifier: Apache-2.0
"""The same digests from other Pythons, other numpys and other hash seeds.

Give the interpreters to compare; each needs numpy, pydantic and PyYAML. Every one computes the
digests of both case studies, both algorithms and both readings, with several PYTHONHASHSEEDs.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]

DIGESTS = """
import hashlib, platform, numpy
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.run_episode import run
from mfba_planner.core.option_specs import override
from mfba_planner.paper.readings_of_paper import PLANNERS
from mfba_planner.scenarios import load_scenario
sums, runs = hashlib.sha256(), 0
for seed in range(5):
    for case in ("case1", "case2"):
        for algorithm in ("mfba", "ba"):
            for reading in PLANNERS.values():
                params = override(reading, {"bat.algorithm": algorithm})
                ticks = run(load_scenario(case), planner=params, seed=seed).ticks
                sums.update(digest(ticks).encode())
                runs += 1
print(platform.python_version(), numpy.__version__, runs, sums.hexdigest())
"""


def main() -> int:
    """Print one line per interpreter and hash seed; exit 1 unless all digests are equal."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pythons", nargs="*", default=[sys.executable], metavar="PYTHON")
    parser.add_argument("--hash-seeds", nargs="+", default=["0", "1", "random"])
    options = parser.parse_args()
    found = set()
    for python in options.pythons:
        for hash_seed in options.hash_seeds:
            env = os.environ | {"PYTHONHASHSEED": hash_seed, "PYTHONPATH": str(ROOT)}
            done = subprocess.run(
                [python, "-c", DIGESTS], env=env, capture_output=True, text=True, check=False
            )
            if done.returncode:
                raise SystemExit(f"{python}: {done.stderr.strip().splitlines()[-1]}")
            version, numpy, runs, sums = done.stdout.split()
            found.add(sums)
            print(
                f"Python {version:<8} numpy {numpy:<7} PYTHONHASHSEED={hash_seed:<7} "
                f"{runs} runs  {sums[:16]}",
                flush=True,
            )
    print("all equal" if len(found) == 1 else f"{len(found)} DIFFERENT sums of digests")
    return int(len(found) > 1)


if __name__ == "__main__":
    raise SystemExit(main())
