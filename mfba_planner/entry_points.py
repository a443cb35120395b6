# SPDX-License-Identifier: Apache-2.0
"""Entry points: one function per program, and how errors become exit codes."""

import errno
import gc
import os
import signal
import sys
import warnings
from collections.abc import Callable
from importlib import import_module
from types import FrameType

from mfba_planner.core.errors import ConfigError, MfbaError
from mfba_planner.core.interrupts import start_own_program
from mfba_planner.core.required_packages import missing_packages
from mfba_planner.core.ros_arguments import split_ros_args
from mfba_planner.core.standard_streams import open_closed_streams, require_stdout

_PACKAGE = "mfba_planner"
_INSTALL = "pip install what setup.py and requirements-ros.txt name"
_ROS_ARGS = "after --ros-args give -p NAME:=VALUE, -r FROM:=TO or --params-file FILE"

_SIGINT_CODE = 128 + signal.SIGINT
_SIGPIPE_CODE = 128 + signal.SIGPIPE
_SIGTERM_CODE = 128 + signal.SIGTERM

_REMEDIES = {
    errno.ENOSPC: "free some space or write elsewhere",
    errno.EDQUOT: "free some space or write elsewhere",
    errno.EROFS: "write elsewhere",
    errno.EACCES: "give a path this user may use",
    errno.EPERM: "give a path this user may use",
}


def planner() -> int:
    """Run the planner node."""
    return _node("planner")


def world_sim() -> int:
    """Run the simulated world."""
    return _node("world_sim")


def virtual_sensor() -> int:
    """Run the node that turns obstacles or a scan into sectors."""
    return _node("virtual_sensor")


def recorder() -> int:
    """Run the node that writes a bag."""
    return _node("recorder")


def replay() -> int:
    """Run the node that replays a bag."""
    return _node("replay")


def launcher() -> int:
    """Run one episode with every node as a process of its own."""
    return _command("launcher", "mfba_planner.launcher")


def mfba() -> int:
    """Run the user command."""
    return _command("mfba", "mfba_planner.cli")


def run_and_return_exit_code(
    run: Callable[[], int], program: str, interrupted: int = _SIGINT_CODE
) -> int:
    """Return run's exit code; an error the user can fix becomes one line on stderr and 1.

    Ctrl-C gives `interrupted`, a closed pipe on stdout gives 141; a bug keeps its traceback.
    """
    try:
        code = run()
    except (KeyboardInterrupt, Exception) as error:
        code = _exit_code_of(error, program, interrupted)
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except OSError as error:
        # Python flushes again at exit: send that to /dev/null, or it fails again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = code or _exit_code_of(error, program, interrupted)
    return code


def _exit_code_of(error: BaseException, program: str, interrupted: int) -> int:
    """Print an error in one line and return its exit code; raise it again when it is a bug.

    A signal's exception is a cause where it fell into an import: Python 3.11 and before wrap what
    a class statement raises.
    """
    if isinstance(error, KeyboardInterrupt) or isinstance(error.__cause__, KeyboardInterrupt):
        return interrupted
    if isinstance(error.__cause__, SystemExit):
        return int(error.__cause__.code or 0)
    if isinstance(error, BrokenPipeError):
        return _SIGPIPE_CODE
    line = _one_line(error)
    if line is None:
        raise error
    print(f"{program}: {' '.join(line.splitlines())}", file=sys.stderr)
    return 1


def _node(name: str) -> int:
    """Run a node, which ends with 0 on SIGINT and SIGTERM; its runtime handles both."""
    _start(on_sigint=0, on_sigterm=0)

    def run() -> int:
        if name != "replay":  # which has arguments of its own
            own, _ = split_ros_args(sys.argv[1:])
            import_module("mfba_planner.ros.node_help").check_arguments(name, own)
        if name == "planner" and (missing := missing_packages(["eikonalfm"])):
            raise ConfigError(missing)  # imported among walls only: too late on a robot
        return int(import_module(f"mfba_planner.ros.nodes.{name}").main(sys.argv[1:]))

    code = run_and_return_exit_code(run, name, interrupted=0)
    for signum in (signal.SIGINT, signal.SIGTERM):
        # A late signal must not change the exit code while the interpreter ends.
        signal.signal(signum, signal.SIG_IGN)
    return code


def _command(name: str, module: str) -> int:
    """Run a command; once it is loaded, both signals raise, so that `finally` is reached."""
    _start(on_sigint=_SIGINT_CODE, on_sigterm=_SIGTERM_CODE)
    # Imports create 100 000 objects that stay: by default a tenth of the time goes into looking.
    gc.set_threshold(20_000)

    def run() -> int:
        require_stdout()
        if missing := missing_packages():
            raise ConfigError(missing)
        main = import_module(module).main
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.signal(signal.SIGTERM, _unwind)
        return int(main(sys.argv[1:]))

    code = run_and_return_exit_code(run, name)
    # The process ends: this saves the last garbage collection, 0.02 s per command.
    gc.freeze()
    return code


def _unwind(_signum: int, _frame: FrameType | None) -> None:
    sys.exit(_SIGTERM_CODE)


def _start(on_sigint: int, on_sigterm: int) -> None:
    """Set environment and signal handlers before the heavy imports; a signal exits at once."""
    start_own_program()
    # Node logs go to stdout; stderr is for errors.
    os.environ.setdefault("RCUTILS_LOGGING_USE_STDOUT", "1")
    # A notebook's backend is not there in another process; pictures need none.
    os.environ["MPLBACKEND"] = "agg"
    open_closed_streams()
    # Of a node that cannot be made rclpy warns too; the error says why.
    warnings.filterwarnings("ignore", "Failed to fini", RuntimeWarning)
    # No file is open yet, and an exception could be caught by an import's except clause.
    signal.signal(signal.SIGINT, lambda *_: os._exit(on_sigint))
    signal.signal(signal.SIGTERM, lambda *_: os._exit(on_sigterm))


def _one_line(error: BaseException) -> str | None:
    """Value, reason and remedy of an error that the user can fix; None for a bug."""
    if isinstance(error, MfbaError):
        return str(error)
    if isinstance(error, OSError) and error.errno in _REMEDIES:
        name = error.filename or "output"
        return f"{name}: {error.strerror}; {_REMEDIES[error.errno]}"
    if isinstance(error, ImportError) and not (error.name or _PACKAGE).startswith(_PACKAGE):
        if missing := missing_packages():
            return missing
        return f"{error}; {_INSTALL}"
    if isinstance(error, UnicodeEncodeError) and error.reason == "surrogates not allowed":
        return f"{error.object}: not UTF-8, as ROS 2 needs; rename that file or directory"
    if type(error).__module__.startswith("rclpy."):
        return _explain_rclpy(type(error).__name__, str(error))
    from mfba_planner.core.broken_library import explain_broken_library

    broken = explain_broken_library(error)
    return None if broken is None else f"{broken}; {_INSTALL}"


def _explain_rclpy(kind: str, text: str) -> str | None:
    """One line for what rclpy.init refuses (arguments, environment); None for a bug."""
    if kind == "UnknownROSArgsError":
        return f"{text}: unknown ROS arguments; {_ROS_ARGS}"
    reason = text.partition(", at /")[0].strip()
    if "SECURITY" in reason:
        return f"{reason}; set ROS_SECURITY_KEYSTORE to the keys, or unset ROS_SECURITY_ENABLE"
    if text.startswith("error creating node"):
        return f"{reason}; correct or unset what ROS_*, RMW_* and FASTRTPS_* variables name"
    return f"{reason}; {_ROS_ARGS}" if text.startswith("failed to initialize") else None
