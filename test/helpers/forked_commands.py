# SPDX-License-Identifier: Apache-2.0
"""Run `mfba` commands as processes that are forked from one that has imported what they need.

Importing takes as long as the work of many a command that a page shows.
"""

import atexit
import json
import os
import subprocess
import sys
from functools import cache
from importlib import import_module
from pathlib import Path
from select import select

IMPORTED = (
    "matplotlib.backends.backend_agg",
    "mfba_planner.evaluation.sweep.run_sweep",
    "mfba_planner.evaluation.sweep.summary",
    "mfba_planner.launcher.execute_run",
    "mfba_planner.launcher.multi_process_driver",
    "mfba_planner.planning.predictive_planner",
    "mfba_planner.report.run_figure",
    "mfba_planner.scenarios.scenario_files",
    "scipy.ndimage",
    "scipy.stats",
)


def mfba(arguments: list[str], cwd: Path, output: Path, timeout_s: float) -> int:
    """Run a command in cwd; its exit code. stdout and stderr go to a file."""
    server = _server()
    assert server.stdin is not None
    assert server.stdout is not None
    request = {"arguments": arguments, "cwd": str(cwd), "output": str(output)}
    server.stdin.write(json.dumps(request) + "\n")
    server.stdin.flush()
    if not select([server.stdout], [], [], timeout_s)[0]:
        _end(server)
        _server.cache_clear()
        raise TimeoutError(f"mfba {arguments}: no end after {timeout_s:g} s")
    return int(server.stdout.readline())


@cache
def _server() -> "subprocess.Popen[str]":
    server = subprocess.Popen(
        [sys.executable, __file__],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    atexit.register(_end, server)
    return server


def _end(server: "subprocess.Popen[str]") -> None:
    server.kill()
    server.communicate()


def _serve() -> None:
    """Fork a process for each request; answer with its exit code."""
    from mfba_planner import entry_points
    from mfba_planner.core.interrupts import start_own_program

    start_own_program()
    for name in IMPORTED:
        import_module(name)
    for line in iter(sys.stdin.readline, ""):
        request = json.loads(line)
        child = os.fork()
        if not child:
            os.chdir(request["cwd"])
            stdin = os.open(os.devnull, os.O_RDONLY)
            stdout = os.open(request["output"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            for ours, standard in ((stdin, 0), (stdout, 1), (stdout, 2)):
                os.dup2(ours, standard)
            sys.argv = ["mfba", *request["arguments"]]
            sys.exit(entry_points.mfba())
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


if __name__ == "__main__":
    _serve()
