# SPDX-License-Identifier: Apache-2.0
"""Node processes: a fork server starts them; each is a process with all that is its own."""

import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from launched_programs import Program, complete
from waiting import wait_until

from mfba_planner.core.errors import GraphError
from mfba_planner.launcher import node_processes
from mfba_planner.launcher.forked_process import ForkServer
from mfba_planner.launcher.node_processes import NodeProcess, NodeProcesses
from mfba_planner.launcher.ros_domain import FIRST_PORT, PORTS


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Iterator[ForkServer]:
    """A fork server whose programs are those of child_programs.py."""
    monkeypatch.setattr(node_processes, "PROGRAM", "child_programs:{}")
    with ForkServer() as server:
        yield server


class Lines:
    """A sink that stores its lines."""

    def __init__(self) -> None:
        self.all: list[tuple[str, str]] = []

    def __call__(self, node: str, text: str) -> None:
        self.all.append((node, text))


def test_all_output_and_the_exit_of_a_node_process(server: ForkServer) -> None:
    lines = Lines()
    child = NodeProcess(server, "prints", [], lines)
    assert child.wait_for_exit(10.0)
    assert lines.all == [("prints", "one"), ("prints", "two")]
    assert child.describe_exit() == "exit code 3"
    garbled = NodeProcess(server, "prints_bytes", [], lines)
    assert garbled.wait_for_exit(10.0)
    assert lines.all[-1] == ("prints_bytes", "\ufffd\ufffd ok")


@pytest.mark.parametrize(
    ("names", "own"),
    [(["describes_itself"], []), (["r1/describes_itself"], ["--no-parameter-services"])],
)
def test_nodes_of_a_fleet_have_no_parameter_services(
    server: ForkServer, names: list[str], own: list[str]
) -> None:
    lines = Lines()
    with NodeProcesses(server, lines, lambda: False) as processes:
        processes.start({name: {"seed": 1} for name in names}, {})
        for child in processes.children:
            assert child.wait_for_exit(10.0)
    about = lines.all[0][1]
    assert f"['describes_itself', {', '.join(map(repr, [*own, '--ros-args']))}, " in about


def test_the_first_log_line_of_a_node_process_looks_for_no_file(server: ForkServer) -> None:
    lines = Lines()
    child = NodeProcess(server, "knows_all_files", [], lines)
    assert child.wait_for_exit(10.0)
    assert lines.all == [("knows_all_files", "True")]


def test_a_bug_in_a_node_is_a_traceback_in_its_output(server: ForkServer) -> None:
    child = NodeProcess(server, "raises", [], Lines())
    assert child.wait_for_exit(10.0)
    assert child.describe_exit() == "exit code 1"
    assert child.last_lines[-1] == "RuntimeError: a bug"


def test_a_node_process_has_its_own_session_environment_and_files(
    server: ForkServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    up = Lines()
    first = NodeProcess(server, "waits", [], up)
    wait_until(lambda: bool(up.all))  # it names itself after the fork
    monkeypatch.setenv("MFBA_TEST_NEW", "set after the server's start")
    lines = Lines()
    child = NodeProcess(server, "robot/describes_itself", ["--some", "arg"], lines)
    assert child.wait_for_exit(10.0)
    about, files = (text for _, text in lines.all)
    args = ["describes_itself", "--some", "arg", "-r", "__ns:=/robot"]
    parent = about.split()[1]
    assert about == f"True {parent} {args} set after the server's start"
    assert int(parent) != os.getpid()
    assert re.fullmatch(r"\['/dev/null', '(pipe:\[\d+\])', '\1'\]", files)
    command = Path(f"/proc/{first.pid}/cmdline").read_bytes()
    assert command.rstrip(b"\0") == b"waits"
    assert Path(f"/proc/{first.pid}/comm").read_text() == "waits\n"


def test_stop_kills_processes_that_ignore_sigterm(
    server: ForkServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mfba_planner.launcher.node_processes.GRACE_S", 0.2)
    lines = Lines()
    processes = NodeProcesses(server, lines, lambda: False)
    processes.start({"ignores_sigterm": {}, "waits": {}}, {})
    children = [*processes.children]
    wait_until(lambda: len(lines.all) == 2, timeout_s=10.0)
    with pytest.raises(RuntimeError, match="inside"), processes:
        raise RuntimeError("inside")
    assert [child.describe_exit() for child in children] == [
        "killed by SIGKILL",
        "killed by SIGTERM",
    ]


def test_stop_kills_without_waiting_when_urgent(server: ForkServer) -> None:
    lines, is_urgent = Lines(), threading.Event()
    processes = NodeProcesses(server, lines, is_urgent.is_set)
    processes.start({"ignores_sigterm": {}}, {})
    wait_until(lambda: bool(lines.all), timeout_s=10.0)
    children = [*processes.children]
    is_urgent.set()
    processes.stop()
    assert children[0].describe_exit() == "killed by SIGKILL"


@pytest.mark.parametrize("check", [True, False])
def test_an_ended_process_and_a_bad_exit_code_are_errors(server: ForkServer, check: bool) -> None:
    def run_one() -> None:
        with NodeProcesses(server, Lines(), lambda: False) as processes:
            processes.start({"prints": {}}, {})
            wait_until(lambda: not processes.is_running("prints"), timeout_s=10.0)
            if check:
                processes.check()

    last_line = "; last line: two$" if check else ""
    with pytest.raises(GraphError, match=rf"^prints ended \(exit code 3\){last_line}"):
        run_one()


def test_the_processes_end_with_a_killed_server(server: ForkServer) -> None:
    lines = Lines()
    child = NodeProcess(server, "waits", [], lines)
    wait_until(lambda: bool(lines.all), timeout_s=10.0)
    os.kill(_parent(child.pid), signal.SIGKILL)
    assert child.wait_for_exit(10.0)
    assert child.describe_exit() == "killed by SIGTERM"
    with pytest.raises(GraphError, match=r"^the process that starts the nodes has ended"):
        NodeProcess(server, "waits", [], lines)


def _parent(pid: int) -> int:
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])


def test_the_server_runs_only_the_threads_of_tracing_when_it_forks(server: ForkServer) -> None:
    """A lock that another thread holds during a fork would stay locked in the child."""
    child = NodeProcess(server, "waits", [], Lines())  # it answers when it has imported all
    count = "import os, rclpy; print(len(os.listdir('/proc/self/task')))"
    threads = len(os.listdir(f"/proc/{_parent(child.pid)}/task"))

    done = subprocess.run([sys.executable, "-c", count], capture_output=True, text=True)
    assert threads <= int(done.stdout)


def test_a_run_leaves_nothing_in_shared_memory(tmp_path: Path) -> None:
    before = os.listdir("/dev/shm")  # also of processes that were killed
    done = complete("launcher", "--planner=paper", "--no-picture", cwd=tmp_path)
    assert done.process.returncode == 0, done.stderr
    found = re.search(r"ROS_DOMAIN_ID=(\d+)", done.stdout)
    assert found
    first = FIRST_PORT + PORTS * int(found[1])
    names = {f"fastrtps_port{port}" for port in range(first, first + PORTS)}
    assert names.isdisjoint(set(os.listdir("/dev/shm")).difference(before))


def test_the_nodes_end_when_the_launcher_is_killed(tmp_path: Path) -> None:
    with Program("launcher", "--set=planner.step_length_m=0.002", cwd=tmp_path) as program:
        wait_until(lambda: len(program.processes()) == 6, timeout_s=60.0)
        program.process.kill()
        wait_until(lambda: not program.processes(), timeout_s=20.0)
