# SPDX-License-Identifier: Apache-2.0
"""A process that imports what the nodes need once, and starts each node by a fork.

It runs no ROS itself: rclpy.init and all that follows happen in the forked processes. Its only
other threads are the two that tracing (LTTng) starts while rclpy is loaded; both sleep.
"""

from __future__ import annotations

import ctypes
import gc
import inspect
import json
import os
import select
import socket
import sys
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib import import_module
from typing import Any, NoReturn

from ..core.child_process import end_with_parent, set_command_line

MAX_BYTES = 100_000  # of one message
_PRELOADED = (
    "mfba_planner.ros.node_help",
    "mfba_planner.ros.nodes.recorder",
    "mfba_planner.ros.nodes.world_sim",
    "mfba_planner.ros.nodes.virtual_sensor",
    "mfba_planner.ros.nodes.planner",
    # What these import when they start.
    "mfba_planner.planning.algorithm_1",
    "mfba_planner.planning.predictive_planner",
)


def main(connection_fd: int) -> None:
    """Serve ForkServer's requests on a socket; in a forked process run its node and exit."""
    with suppress(Exception):  # a node that cannot import it names it in its output
        _preload()
    connection = socket.socket(fileno=connection_fd)
    with suppress(BrokenPipeError, ConnectionResetError):  # the launcher has ended
        if (run_node := _serve(connection)) is not None:
            _run_and_exit(run_node)


def _preload() -> None:
    gc.disable()  # nothing that is imported is garbage
    for name in _PRELOADED:
        import_module(name)
    from rcl_interfaces import srv as parameter_services
    from rclpy.type_support import check_for_type_support
    from std_srvs.srv import SetBool, Trigger

    from ..ros.interface import topics

    services = [one for one in vars(parameter_services).values() if hasattr(one, "Request")]
    for kind in (*(topic.type for topic in topics.GRAPH), *services, SetBool, Trigger):
        check_for_type_support(kind)
    # The first line that rclpy logs in a process looks for its caller among all modules' files.
    inspect.getframeinfo(sys._getframe())
    # Else a collection in a node would write to, and so copy, the memory that all share.
    gc.collect()
    gc.freeze()
    gc.enable()


def _serve(connection: socket.socket) -> Callable[[], int] | None:
    """Fork for every request. Return None at the launcher's end, the node to run in a child."""
    running: dict[int, int] = {}  # pid by pidfd
    events = select.poll()
    events.register(connection, select.POLLIN)
    while True:
        for fd, _ in events.poll():
            if fd in running:
                pid = running.pop(fd)
                events.unregister(fd)
                os.close(fd)
                status = os.waitpid(pid, 0)[1]
                _send(connection, {"ended": pid, "code": os.waitstatus_to_exitcode(status)})
                continue
            data, fds, _, _ = socket.recv_fds(connection, MAX_BYTES, 1)
            if not data:
                return None
            server, pid = os.getpid(), os.fork()
            if pid == 0:
                for other in running:
                    os.close(other)
                connection.close()
                return _become(json.loads(data), fds[0], server)
            os.close(fds[0])
            pidfd = os.pidfd_open(pid)
            running[pidfd] = pid
            events.register(pidfd, select.POLLIN)
            _send(connection, {"started": pid}, [pidfd])


def _send(connection: socket.socket, message: dict[str, int], fds: Sequence[int] = ()) -> None:
    socket.send_fds(connection, [json.dumps(message).encode()], list(fds))


def _become(request: dict[str, Any], output: int, server: int) -> Callable[[], int]:
    """Make this forked process the one that was requested."""
    # Ctrl-C must reach the launcher only, which then ends the nodes: the recorder first.
    os.setsid()
    end_with_parent(server)
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.close(output)
    for name, value in request["environment"].items():
        os.environ.pop(name, None)
        if value is not None:
            os.environ[name] = value
    module, _, function = request["function"].partition(":")
    sys.argv = [function, *request["args"]]
    set_command_line([*request["title"], *request["args"]])
    run: Callable[[], int] = getattr(import_module(module), function)
    return run


def _run_and_exit(run_node: Callable[[], int]) -> NoReturn:
    """Exit as multiprocessing does: without freeing every module, which takes 0.1 s."""
    code = 1
    try:
        code = run_node()
        gc.collect()  # the last handles of a node, with which its shared memory goes
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        ctypes.CDLL(None).fflush(None)  # ROS logs by C's stdout
        os._exit(code)
