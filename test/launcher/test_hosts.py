# SPDX-License-Identifier: Apache-2.0
"""Environments of real hosts: each program works, or says in one line why not and what to do."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from launch_standin import launched
from launched_programs import PROGRAM, Program, complete
from project import ROOT
from waiting import wait_until

from mfba_planner.core.errors import ConfigError, InputError
from mfba_planner.launcher.simulate_launch_description import ARGUMENTS, launch_parameters
from mfba_planner.ros import log_directory
from mfba_planner.ros.runtime.environment_notes import environment_notes
from mfba_planner.ros.shared_memory import require_shared_memory

NOT_UTF8 = os.fsdecode(b"b\xe9d")
NO_PICTURE = ("empty", "--driver", "in-process", "--no-picture")


def refusal(name: str, *args: str, cwd: Path, **more_env: str) -> str:
    """The one line of a program that ends with 1."""
    done = complete(name, *args, cwd=cwd, **more_env)
    assert (done.process.returncode, done.stderr.count("\n")) == (1, 1), done.stderr
    assert "; " in done.stderr, "a remedy"
    return done.stderr


@pytest.mark.parametrize("backend", ["module://matplotlib_inline.backend_inline", "no_backend"])
def test_pictures_do_not_depend_on_the_backend_of_a_notebook(tmp_path: Path, backend: str) -> None:
    for words in (
        ["run", "empty", "--driver", "core", "--planner", "paper", "--out", "a"],
        ["figures", "--only", "fig6", "--out", "b"],
    ):
        done = complete("mfba", *words, cwd=tmp_path, MPLBACKEND=backend)
        assert (done.process.returncode, done.stderr) == (0, "")
    assert (tmp_path / "a" / "run.png").exists()


def test_pictures_do_not_depend_on_a_matplotlibrc(tmp_path: Path) -> None:
    pictures: list[list[bytes]] = []
    for text in ("", "axes.facecolor: red\ntext.usetex: True\nfont.size: 40\n"):
        (tmp_path / "matplotlibrc").write_text(text, encoding="utf-8")
        out = tmp_path / f"figure{len(pictures)}"
        done = complete("mfba", "figures", "--only", "fig6", "--out", str(out), cwd=tmp_path)
        assert (done.process.returncode, done.stderr) == (0, "")
        pictures.append([path.read_bytes() for path in sorted(out.iterdir())])
    assert pictures[0] == pictures[1] != []


@pytest.mark.parametrize("kind", ["file", "nowhere", "unwritable"])
@pytest.mark.parametrize("name", ["launcher", "planner"])
def test_logs_go_elsewhere_where_the_home_directory_cannot_be_written(
    tmp_path: Path, kind: str, name: str
) -> None:
    home = tmp_path / "home"
    home.mkdir()
    if kind == "file":
        (home / ".ros").touch()
    elif kind == "unwritable":  # not even for root
        (home / ".ros").mkdir()
        (home / ".ros" / "log").symlink_to("/proc/self")
    else:
        home = Path("/proc/nowhere")
    env = {"HOME": str(home), "ROS_LOG_DIR": "", "TMPDIR": str(tmp_path)}
    logs = tmp_path / f"ros_log_{os.getuid()}"
    if name == "launcher":
        done = complete(name, *NO_PICTURE, cwd=tmp_path, **env)
    else:
        with Program(name, cwd=tmp_path, more_env=env) as done:
            wait_until(lambda: logs.is_dir() and any(logs.iterdir()), timeout_s=60.0)
            done.process.send_signal(signal.SIGTERM)
            done.end()
    assert done.process.returncode == 0
    assert done.stderr.startswith(f"{home}/.ros/log: ")
    assert done.stderr.endswith(f"; ROS logs go to {logs}\n")
    assert done.stderr.count("\n") == 1
    assert any(logs.iterdir())


def test_logs_go_to_the_temporary_directory_without_a_home(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(log_directory.tempfile, "tempdir", str(tmp_path))
    monkeypatch.setenv("ROS_LOG_DIR", "")
    monkeypatch.setenv("HOME", "")
    monkeypatch.delenv("ROS_HOME", raising=False)
    log_directory.choose_log_directory()
    assert os.environ["ROS_LOG_DIR"] == str(tmp_path / f"ros_log_{os.getuid()}")
    monkeypatch.setenv("ROS_LOG_DIR", "")
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "mine"))
    log_directory.choose_log_directory()
    assert os.environ["ROS_LOG_DIR"] == ""
    assert (tmp_path / "mine" / "log").is_dir()
    assert capsys.readouterr() == ("", "")
    monkeypatch.setattr(log_directory.tempfile, "tempdir", "/proc/nowhere")
    monkeypatch.setenv("ROS_HOME", "/proc/nowhere")
    with pytest.raises(ConfigError, match="; set ROS_LOG_DIR to a directory that can be written"):
        log_directory.choose_log_directory()


@pytest.mark.parametrize(
    ("variable", "value"),
    [
        ("ROS_LOG_DIR", "/proc/nowhere"),
        ("RCUTILS_LOGGING_USE_STDOUT", "yes"),
        ("RCUTILS_COLORIZED_OUTPUT", "7"),
        ("RCUTILS_LOGGING_BUFFERED_STREAM", "x"),
        ("RMW_IMPLEMENTATION", "rmw_of_another_vendor"),
    ],
)
def test_a_variable_with_which_nodes_cannot_run_is_refused(
    tmp_path: Path, variable: str, value: str
) -> None:
    for name, args in (("planner", ()), ("launcher", NO_PICTURE)):
        line = refusal(name, *args, cwd=tmp_path, **{variable: value})
        assert line.startswith(f"{name}: {variable}={value}: ")
    assert list(tmp_path.iterdir()) == []


def test_peers_and_keys_that_do_not_exist_are_named(tmp_path: Path) -> None:
    line = refusal("planner", cwd=tmp_path, ROS_STATIC_PEERS="no host")
    assert line.startswith("planner: error creating node: Unable to resolve peer no host; ")
    keys = {"ROS_SECURITY_KEYSTORE": "/nowhere", "ROS_SECURITY_STRATEGY": "Enforce"}
    line = refusal("planner", cwd=tmp_path, ROS_SECURITY_ENABLE="true", **keys)
    assert line.startswith("planner: failed to initialize rcl: SECURITY ERROR: ")
    assert line.endswith("; set ROS_SECURITY_KEYSTORE to the keys, or unset ROS_SECURITY_ENABLE\n")


def test_settings_with_which_a_node_runs_but_not_as_meant_are_logged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("ROS_DISTRO", "ROS_SECURITY_ENABLE", "ROS_SECURITY_STRATEGY"):
        monkeypatch.delenv(name, raising=False)
    port, other_domain = tmp_path / "fastrtps_port8161", tmp_path / "fastrtps_port7411"
    for path in (port, other_domain, tmp_path / "fastrtps_port8161_el"):
        path.touch()
    assert environment_notes(3, tmp_path) == []
    monkeypatch.setattr("os.geteuid", lambda: os.getuid() + 1)
    assert [note.partition(": ")[0] for note in environment_notes(3, tmp_path)] == [str(port)]
    monkeypatch.setenv("ROS_DISTRO", "humble")
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    found = environment_notes(2, tmp_path)
    assert [note.partition(": ")[0] for note in found] == [
        "ROS_DISTRO=humble",
        "ROS_SECURITY_ENABLE=true",
    ]
    monkeypatch.setenv("ROS_SECURITY_STRATEGY", "Enforce")
    assert len(environment_notes(2, tmp_path)) == 1


def test_a_node_logs_what_its_environment_means(tmp_path: Path) -> None:
    with Program("planner", cwd=tmp_path, more_env={"ROS_DISTRO": "humble"}) as done:
        assert done.process.stdout is not None
        lines = [done.process.stdout.readline() for _ in range(2)]  # the first: its inputs
        assert "ROS_DISTRO=humble: this package is made" in lines[1]
        done.process.send_signal(signal.SIGTERM)
        assert done.end() == 0


@pytest.mark.parametrize("free", [0, 15])
def test_full_shared_memory_is_refused(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, free: int
) -> None:
    """Fast DDS and tracing would end the process with a bus error."""
    status = list(os.statvfs("/dev/shm"))
    status[1], status[2], status[4] = 4096, 1024, free  # f_frsize, f_blocks, f_bavail
    monkeypatch.setattr("os.statvfs", lambda _: os.statvfs_result(status))
    with pytest.raises(ConfigError, match=f"^{tmp_path}: {free * 4} kB free, and nodes need 64; "):
        require_shared_memory(tmp_path)
    status[4] = 16
    require_shared_memory(tmp_path)
    status[2] = status[4] = 0  # no limit
    require_shared_memory(tmp_path)


def closed(name: str, *args: str, cwd: Path, close: str) -> "subprocess.CompletedProcess[str]":
    """Run a program of which a shell has closed some descriptors, such as `>&-`."""
    program = [sys.executable, "-c", PROGRAM.format(name), *args]
    return subprocess.run(
        ["sh", "-c", f'exec "$@" {close}', "sh", *program],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize(
    "words", [["sim", "empty"], ["run", *NO_PICTURE], ["scenarios"], ["figures", "--out", "x"]]
)
def test_a_command_whose_stdout_is_closed_does_nothing_and_says_so(
    tmp_path: Path, words: list[str]
) -> None:
    done = closed("mfba", *words, cwd=tmp_path, close=">&-")
    assert (done.returncode, done.stderr) == (
        1,
        "mfba: stdout: closed; redirect it to a file or to /dev/null\n",
    )
    assert list(tmp_path.iterdir()) == []


def test_a_run_whose_other_streams_are_closed_keeps_a_whole_bag(tmp_path: Path) -> None:
    """Without a descriptor 2 the bag's file would get that number, and the log lines."""
    words = ["run", "empty", "--planner", "paper", "--no-picture", "--out", "a"]
    done = closed("mfba", *words, cwd=tmp_path, close="2>&- <&-")
    assert done.returncode == 0
    assert complete("mfba", "verify", "a", cwd=tmp_path).process.returncode == 0


@pytest.mark.parametrize(
    "args",
    [
        ["launcher", f"{NOT_UTF8}/s.yaml", "--driver", "in-process"],
        ["launcher", f"{NOT_UTF8}/s.yaml"],
        ["launcher", "empty", "--out", f"{NOT_UTF8}/out"],
        ["planner", "--ros-args", "--params-file", f"{NOT_UTF8}/p.yaml"],
        ["world_sim", "--ros-args", "-p", f"scenario:={NOT_UTF8}/s.yaml"],
    ],
)
def test_a_path_that_is_not_utf8_is_refused_by_what_uses_ros(
    tmp_path: Path, args: list[str]
) -> None:
    place = tmp_path / NOT_UTF8
    place.mkdir()
    (place / "s.yaml").write_bytes((ROOT / "config/scenarios/empty.yaml").read_bytes())
    line = refusal(*args, cwd=tmp_path)
    assert "b\\udce9d" in line
    assert line.endswith(": not UTF-8, as ROS 2 needs; rename that file or directory\n")
    assert [path.name for path in place.iterdir()] == ["s.yaml"]


def test_a_working_directory_that_is_not_utf8_is_refused_where_its_name_is_needed(
    tmp_path: Path,
) -> None:
    place = tmp_path / NOT_UTF8
    place.mkdir()
    line = refusal("launcher", "empty", "--out", "out", cwd=place)
    assert line.endswith("/out/bag: not UTF-8, as ROS 2 needs; rename that file or directory\n")
    assert list(place.iterdir()) == []
    done = complete("mfba", "sim", "empty", "--planner", "paper", cwd=place)
    assert (done.process.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("source", ["raise ImportError('no libopenblas')", "def f(: x", ""])
@pytest.mark.parametrize("args", [["mfba", "sim"], ["mfba", "run"], ["planner"], ["replay", "x"]])
def test_a_broken_numpy_is_one_line(tmp_path: Path, source: str, args: list[str]) -> None:
    (tmp_path / "numpy").mkdir()
    (tmp_path / "numpy" / "__init__.py").write_text(source, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(args[0]), *args[1:]],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": f"{tmp_path}:{ROOT}"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr.count("\n")) == (1, 1), done.stderr
    assert "numpy" in done.stderr
    assert done.stderr.endswith("; pip install what setup.py and requirements-ros.txt name\n")


def test_simulate_launch_refuses_what_it_would_not_use() -> None:
    given = {name: argument.default for name, argument in ARGUMENTS.items()}
    with pytest.raises(ConfigError, match=r"^bag:=mine: nothing is recorded; add record:=true$"):
        launch_parameters(given | {"bag": "mine"})
    assert "recorder" in launch_parameters(given | {"bag": "mine", "record": "true"})
    for file in ("simulate.launch.py", "planner.launch.py", "replay.launch.py"):
        more = {"bag": "x", "planner": "true"} if file.startswith("replay") else {}
        with pytest.raises(InputError, match=r"^params_file:=nowhere: does not exist; give a "):
            launched(file, {**more, "params_file": "nowhere"})
