# SPDX-License-Identifier: Apache-2.0
"""`mfba sweep` on two hosts: a dask worker in each of two network namespaces (needs root).

The namespaces share a veth pair and nothing else of the network; scheduler and client are in the
first. Prints how much each worker computed, and whether the table equals that of local processes.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

HOSTS = {"mfba-a": "10.77.0.1", "mfba-b": "10.77.0.2"}
ADDRESS = f"tcp://{HOSTS['mfba-a']}:8786"
MFBA = "import sys; from mfba_planner import entry_points; sys.exit(entry_points.mfba())"
COUNT = """
from collections import Counter
from distributed import Client
with Client({address!r}) as client:
    client.wait_for_workers(2, timeout=60)
    counts = client.run(lambda dask_worker: len(dask_worker.state.log))
    for address, events in counts.items():
        print("  worker", address, "events", events)
"""


def ip(*words: str) -> None:
    """Run the command of that name."""
    subprocess.run(["ip", *words], check=True)


@contextmanager
def hosts() -> Iterator[None]:
    """Two namespaces with an address each; removed afterwards, with all that is in them."""
    with ExitStack() as stack:
        for name in HOSTS:
            ip("netns", "add", name)
            stack.callback(ip, "netns", "del", name)
        first, second = HOSTS
        ip(
            "link",
            "add",
            "veth0",
            "netns",
            first,
            "type",
            "veth",
            "peer",
            "veth0",
            "netns",
            second,
        )
        for name, address in HOSTS.items():
            ip("-n", name, "addr", "add", f"{address}/24", "dev", "veth0")
            ip("-n", name, "link", "set", "veth0", "up")
            ip("-n", name, "link", "set", "lo", "up")
        yield


def inside(host: str, *words: str) -> list[str]:
    """A command of this Python in a namespace."""
    return ["ip", "netns", "exec", host, sys.executable, *words]


@contextmanager
def daemon(host: str, *words: str) -> Iterator[None]:
    """A quiet process in a namespace."""
    with tempfile.TemporaryDirectory() as directory:
        process = subprocess.Popen(
            inside(host, "-m", *words), cwd=directory,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        try:
            yield
        finally:
            process.terminate()
            process.wait()


def swept(command: list[str]) -> str:
    """The sorted hash that a sweep prints."""
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    found = re.search(r"^sorted hash (\w+)$", done.stdout, re.MULTILINE)
    assert found, done.stdout
    return found.group(1)


def main() -> None:
    """Sweep on both hosts and with local processes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--worlds", type=int, default=400)
    options = parser.parse_args()
    sweep_arguments = ["sweep", "random-10", "--planner", "paper", "--planner", "straight"]
    sweep_arguments += ["--worlds", str(options.worlds)]
    with tempfile.TemporaryDirectory() as root, ExitStack() as stack:
        stack.enter_context(hosts())
        first = next(iter(HOSTS))
        stack.enter_context(
            daemon(
                first, "distributed.cli.dask_scheduler", "--host", HOSTS[first], "--no-dashboard"
            )
        )
        for name, address in HOSTS.items():
            worker = ["distributed.cli.dask_worker", ADDRESS, "--host", address]
            stack.enter_context(daemon(name, *worker, "--nthreads", "1", "--no-dashboard"))
        wait = COUNT.format(address=ADDRESS)
        subprocess.run(inside(first, "-c", wait), check=True, stdout=subprocess.DEVNULL)
        out = str(Path(root) / "hosts")
        two_hosts = swept(
            inside(first, "-c", MFBA, *sweep_arguments, "--scheduler", ADDRESS, "--out", out)
        )
        subprocess.run(inside(first, "-c", wait), check=True)
        one_host = swept(
            [sys.executable, "-c", MFBA, *sweep_arguments, "--out", str(Path(root) / "local")]
        )
    same = two_hosts == one_host
    print(f"two hosts {two_hosts}\none host  {one_host}\n{'identical' if same else 'DIFFERENT'}")
    sys.exit(not same)


if __name__ == "__main__":
    main()
