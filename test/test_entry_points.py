# SPDX-License-Identifier: Apache-2.0
"""Entry points: errors, signals and closed pipes as a user gets them, and import cost."""

import errno
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable

import pytest
from project import ROOT

from mfba_planner.core.errors import BagError
from mfba_planner.core.required_packages import REQUIRED
from mfba_planner.entry_points import run_and_return_exit_code


def start(code: str, **options: object) -> "subprocess.Popen[str]":
    """Run a few lines of Python in a process of their own, so that signals and pipes are real."""
    return subprocess.Popen(  # type: ignore[call-overload, no-any-return]
        [sys.executable, "-c", f"import sys\nfrom mfba_planner import entry_points\n{code}"],
        cwd=ROOT,
        text=True,
        stderr=subprocess.PIPE,
        **{"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, **options},
    )


def outcome(process: "subprocess.Popen[str]") -> tuple[int, str | None, str]:
    out, err = process.communicate(timeout=30)
    return process.returncode, out, err


def raiser(error: BaseException) -> Callable[[], int]:
    def run() -> int:
        raise error

    return run


def rclpy_init(*args: str) -> Callable[[], int]:
    """The first call of a node, with a user's arguments."""

    def run() -> int:
        from rclpy.context import Context

        Context().init(args=["--ros-args", *args])
        return 0

    return run


def test_a_program_without_error_keeps_its_exit_code(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_and_return_exit_code(lambda: 0, "mfba") == 0
    assert run_and_return_exit_code(lambda: 3, "mfba") == 3
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("run", "line"),
    [
        (raiser(BagError("run1: empty; give a bag")), "run1: empty; give a bag"),
        (raiser(BagError("run1: odd\nvalue; give a bag")), "run1: odd value; give a bag"),
        (
            raiser(OSError(errno.ENOSPC, "No space left on device", "/x/bag.mcap")),
            "/x/bag.mcap: No space left on device; free some space or write elsewhere",
        ),
        (
            raiser(PermissionError(errno.EACCES, "Permission denied", "/x")),
            "/x: Permission denied; give a path this user may use",
        ),
        (
            raiser(ModuleNotFoundError("No module named 'mcap'", name="mcap")),
            "No module named 'mcap'; pip install what setup.py and requirements-ros.txt name",
        ),
        (rclpy_init("--odd"), "['--odd']: unknown ROS arguments; after --ros-args give"),
        (rclpy_init("-p", "vmax"), "failed to initialize rcl: Couldn't parse parameter override"),
        (
            rclpy_init("--params-file", "/no.yaml"),
            "failed to initialize rcl: Couldn't parse params",
        ),
    ],
)
def test_an_error_the_user_can_fix_becomes_one_line(
    run: Callable[[], int], line: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run_and_return_exit_code(run, "mfba") == 1
    lines = [text for text in capfd.readouterr().err.splitlines() if "[rcl]" not in text]
    assert len(lines) == 1
    assert lines[0].startswith(f"mfba: {line}")


@pytest.mark.parametrize(
    "bug",
    [
        ValueError("a bug"),
        RuntimeError("failed to initialize"),
        OSError(errno.EBADF, "a bug"),
        ModuleNotFoundError("a bug", name="mfba_planner.ros.plannr"),
    ],
)
def test_a_bug_keeps_its_traceback(bug: Exception) -> None:
    with pytest.raises(type(bug)) as raised:
        run_and_return_exit_code(raiser(bug), "mfba")
    assert raised.value is bug


@pytest.mark.parametrize(("interrupted", "code"), [({}, 130), ({"interrupted": 0}, 0)])
def test_ctrl_c_is_quiet(
    interrupted: dict[str, int], code: int, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_and_return_exit_code(raiser(KeyboardInterrupt()), "mfba", **interrupted) == code
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(("error", "code"), [(KeyboardInterrupt(), 130), (SystemExit(143), 143)])
def test_a_signal_in_a_class_statement_is_no_bug(error: BaseException, code: int) -> None:
    """As in an import: Python 3.11 makes a RuntimeError of it."""

    class Interrupted:
        def __set_name__(self, *_: object) -> None:
            raise error

    def run() -> int:
        type("Late", (), {"field": Interrupted()})
        return 0

    try:
        found = run_and_return_exit_code(run, "mfba")
    except SystemExit as ended:  # not wrapped: it ends the process with its code
        found = int(ended.code or 0)
    assert found == code


def test_importing_entry_points_imports_nothing_heavy() -> None:
    heavy = "{'numpy', 'rclpy', 'matplotlib', 'yaml', 'pydantic', 'rich', 'argparse'}"
    code, out, err = outcome(start(f"print(sorted({heavy} & set(sys.modules)))"))
    assert (code, out, err) == (0, "[]\n", "")


def print_and_exit(size: int) -> str:
    """A program that prints so many characters and exits."""
    run = f"lambda: int(bool(print('x' * {size})))"
    return f"sys.exit(entry_points.run_and_return_exit_code({run}, 'mfba'))"


@pytest.mark.parametrize("size", [1, 100_000])
def test_a_closed_pipe_on_stdout_is_no_error(size: int) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    code = print_and_exit(size)
    try:
        assert outcome(start(code, stdout=writer)) == (141, None, "")
    finally:
        os.close(writer)


@pytest.mark.parametrize("size", [1, 100_000])
def test_a_full_disk_on_stdout_is_one_line(size: int) -> None:
    code = print_and_exit(size)
    with open("/dev/full", "w", encoding="utf-8") as full:
        status, _, err = outcome(start(code, stdout=full))
    assert (status, err) == (
        1,
        "mfba: output: No space left on device; free some space or write elsewhere\n",
    )


SLOW_IMPORT = """
def slow(name):
    print("importing", flush=True)
    sys.stdin.read()
entry_points.import_module = slow
sys.exit(entry_points.{program}())
"""


@pytest.mark.parametrize(
    ("program", "signum", "code"),
    [
        ("planner", signal.SIGINT, 0),
        ("planner", signal.SIGTERM, 0),
        ("mfba", signal.SIGINT, 130),
        ("mfba", signal.SIGTERM, 143),
    ],
)
def test_a_signal_during_the_imports_is_quiet(program: str, signum: int, code: int) -> None:
    process = start(SLOW_IMPORT.format(program=program), stdin=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stdout.readline() == "importing\n"
    process.send_signal(signum)
    assert outcome(process) == (code, "", "")


RUNNING_COMMAND = """
from types import SimpleNamespace
def main(argv):
    try:
        print("running", argv, flush=True)
        sys.stdin.read()
    finally:
        print("closed", flush=True)
entry_points.import_module = lambda name: SimpleNamespace(main=main)
sys.argv = ["mfba", "run"]
sys.exit(entry_points.mfba())
"""


@pytest.mark.parametrize(("signum", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_unwinds_a_running_command(signum: int, code: int) -> None:
    process = start(RUNNING_COMMAND, stdin=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stdout.readline() == "running ['run']\n"
    process.send_signal(signum)
    assert outcome(process) == (code, "closed\n", "")


@pytest.mark.parametrize(
    ("before", "line"),
    [
        (
            "import os; os.environ['RMW_IMPLEMENTATION'] = 'rmw_nope'",
            "planner: RMW_IMPLEMENTATION=rmw_nope: librmw_nope.so: cannot open",
        ),
        (
            "import os; os.environ['ROS_DOMAIN_ID'] = '500'",
            "planner: ROS_DOMAIN_ID=500: no such domain; give 0 to 232",
        ),
        ("sys.modules['rclpy'] = None", "planner: rclpy: import of rclpy halted"),
    ],
)
def test_a_node_without_ros_fails_in_one_line(before: str, line: str) -> None:
    code, out, err = outcome(start(f"{before}; sys.exit(entry_points.planner())"))
    assert (code, out) == (1, "")
    assert err.startswith(line)
    assert len(err.splitlines()) == 1
    assert "; " in err  # followed by a remedy


HIDE = """
from importlib.machinery import PathFinder
found = PathFinder.find_spec
PathFinder.find_spec = lambda name, *rest: None if name in HIDDEN else found(name, *rest)
"""


@pytest.mark.parametrize("program", ["mfba", "launcher"])
def test_missing_packages_are_named_together_before_anything_else(program: str) -> None:
    code = f"HIDDEN = ('rich', 'matplotlib', 'scipy')\n{HIDE}\nsys.argv[1:] = ['case1']\n"
    expected = (
        f"{program}: not installed: matplotlib, rich, scipy; run pip install matplotlib rich "
        "scipy\n"
    )
    assert outcome(start(f"{code}sys.exit(entry_points.{program}())")) == (1, "", expected)


def test_a_node_names_missing_packages_only_where_it_needs_one() -> None:
    code = f"HIDDEN = ('rich', 'eikonalfm', 'yaml')\n{HIDE}\nsys.argv[1:] = ['--help']\n"
    returncode, out, err = outcome(start(f"{code}sys.exit(entry_points.recorder())"))
    assert (returncode, err) == (0, "")
    assert out is not None
    assert out.startswith("usage: recorder")
    code = f"HIDDEN = ('rich', 'eikonalfm')\n{HIDE}\n"
    expected = "planner: not installed: eikonalfm, rich; run pip install eikonalfm rich\n"
    code += "sys.argv[1:] = []\n"
    assert outcome(start(f"{code}sys.exit(entry_points.planner())")) == (1, "", expected)


def test_what_is_required_is_what_setup_installs() -> None:
    text = (ROOT / "setup.py").read_text(encoding="utf-8")
    block = text[text.index("install_requires=[") : text.index("extras_require")]
    assert set(re.findall(r'"([\w-]+)[<>=]', block)) == set(REQUIRED.values())
