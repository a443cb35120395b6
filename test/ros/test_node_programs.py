# SPDX-License-Identifier: Apache-2.0
"""The nodes as programs: an error is one line and exit code 1, signals end them without output."""

import os
import re
import resource
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import rclpy
from launched_programs import PROGRAM, ROOT, Program
from nav_msgs.msg import Path as PathMsg
from rclpy.context import Context
from ros_graph import Graph
from std_srvs.srv import Trigger
from waiting import wait_until

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.option_specs import walk
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.bag_writer import CHUNK_BYTES
from mfba_planner.recording.recover import recover
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.to_messages import path_msg
from mfba_planner.ros.node_help import PARAMETERS
from mfba_planner.ros.runtime.given_parameters import check_given_parameters

PARAMS_FILE = "/**: {ros__parameters: {bat.population: 1}}\n"


def start(
    node: str, *args: str, env: dict[str, str], file_limit: int | None = None, cwd: Path = ROOT
) -> "subprocess.Popen[str]":
    """A node by its console entry."""

    def limit() -> None:
        if file_limit is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (file_limit, file_limit))

    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM.format(node), *args],
        cwd=cwd,
        env={**env, "PYTHONPATH": str(ROOT)},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=limit,
    )


def refused(node: str, *args: str, env: dict[str, str], cwd: Path = ROOT) -> str:
    """The one line of a node that could not start."""
    process = start(node, *args, env=env, cwd=cwd)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 1
    # rcl also logs that it cannot parse arguments.
    assert [line for line in out.splitlines() if "[rcl]: Failed to parse" not in line] == []
    assert err.endswith("\n")
    assert err.count("\n") == 1
    return err.rstrip()


def parameters(*values: str) -> list[str]:
    return ["--ros-args", *(word for value in values for word in ("-p", value))]


@pytest.mark.parametrize(
    ("node", "value", "line"),
    [
        (
            "planner",
            "bat.population:=1",
            "planner: population=1: out of range; give a value in [2",
        ),
        (
            "planner",
            "speed_mps:=1",
            "planner: parameter speed_mps=1: wrong type; give a float (wr",
        ),
        ("planner", "speed_mps:=-0.5", "planner: speed_mps=-0.5: out of range; give a value in ["),
        ("planner", "speed_mps:=.nan", "planner: speed_mps=nan: not finite; give a value in"),
        ("planner", "bat.algorithm:=bee", "planner: algorithm='bee': unknown; choose one of ba,"),
        ("world_sim", "scenario:=case3", "world_sim: 'case3': no such scenario; did you mean 'ca"),
        ("world_sim", "scenario:=a.yaml", "world_sim: a.yaml: No such file or directory; give"),
        ("world_sim", "tick_ns:=0", "world_sim: tick_ns=0: out of range; give a value in [1000,"),
        ("virtual_sensor", "sectors:=2", "virtual_sensor: sectors=2: out of range; give a value"),
        ("virtual_sensor", "source:=gps", "virtual_sensor: source='gps': unknown; choose one of"),
        ("recorder", "output:=/proc/bag", "recorder: /proc/bag: cannot be created ("),
        ("recorder", "output:=.", f"recorder: {ROOT}: exists already and is never overwritten"),
        (
            "recorder",
            "run:=ran",
            "recorder: parameter run='ran': not JSON of an object; give '{}'",
        ),
    ],
)
def test_a_bad_parameter_is_one_line(
    ros_env: dict[str, str], node: str, value: str, line: str
) -> None:
    assert refused(node, *parameters(value), env=ros_env).startswith(line)


def test_bad_arguments_are_one_line(ros_env: dict[str, str], tmp_path: Path) -> None:
    def line(*args: str) -> str:
        return refused("planner", "--ros-args", *args, env=ros_env)

    assert line("--odd").startswith("planner: ['--odd']: unknown ROS arguments; after --ros-args")
    assert line("-p", "speed_mps").startswith("planner: failed to initialize rcl: Couldn't parse")
    missing = line("--params-file", "/nowhere.yaml")
    assert missing.startswith("planner: failed to initialize rcl: Couldn't parse params file")
    file = tmp_path / "planner.yaml"
    file.write_text(PARAMS_FILE)
    assert line("--params-file", str(file)).startswith("planner: population=1: out of range")
    file.write_text("planner: [1, 2")
    assert "planner.yaml" in line("--params-file", str(file))


@pytest.mark.parametrize(
    ("given", "line"),
    [
        (
            ["speed_mps:=abc"],  # rcl drops it without a word: the file has a number
            "planner: -p speed_mps:=abc has no effect: a parameter file says 0.4 for this node; "
            "change it there, or give -p planner:speed_mps:=abc",
        ),
        (
            ["step_length_m:=0.3"],  # the file's section of this node counts more
            "planner: -p step_length_m:=0.3 has no effect: a parameter file says 0.2 for this "
            "node; change it there, or give -p planner:step_length_m:=0.3",
        ),
        (
            ["planner:speed_mps:=abc"],
            "planner: parameter speed_mps='abc': wrong type; give",
        ),
        (["use_sim_time:=5"], "planner: use_sim_time: wrong type; give true or false"),
        (["recovery.enabled:=2.0"], "planner: -p recovery.enabled:=2.0 has no effect: a param"),
    ],
)
def test_a_parameter_beside_a_file_counts_or_is_refused(
    tmp_path: Path, ros_env: dict[str, str], given: list[str], line: str
) -> None:
    file = tmp_path / "planner.yaml"
    file.write_text(
        "/**: {ros__parameters: {speed_mps: 0.4, recovery: {enabled: true}}}\n"
        "planner: {ros__parameters: {step_length_m: 0.2}}\n"
    )
    arguments = ["--ros-args", "--params-file", str(file), *parameters(*given)[1:]]
    assert refused("planner", *arguments, env=ros_env).startswith(line)


def test_a_file_that_follows_a_parameter_counts_and_says_so(
    tmp_path: Path, ros_env: dict[str, str]
) -> None:
    file = tmp_path / "planner.yaml"
    file.write_text("/**: {ros__parameters: {speed_mps: 0.4}}\n")
    given = [*parameters("speed_mps:=0.5", "step_length_m:=0.2"), "--params-file", str(file)]
    environment = {**ros_env, "RCUTILS_LOGGING_BUFFERED_STREAM": "1"}
    with start("planner", *given, env=environment) as planner:
        assert planner.stdout is not None
        line = planner.stdout.readline()
        planner.terminate()
        rest, err = planner.communicate(timeout=60)
    assert line.endswith(
        "[planner]: -p speed_mps:=0.5 has no effect: a parameter file that follows it says 0.4; "
        "give -p after the file\n"
    )
    assert (rest.count("has no effect"), err, planner.returncode) == (0, "", 0)


def test_in_a_namespace_no_option_names_the_node(tmp_path: Path, ros_env: dict[str, str]) -> None:
    file = tmp_path / "planner.yaml"
    file.write_text("/**: {ros__parameters: {speed_mps: 0.4}}\n")
    given = ["--ros-args", "--params-file", str(file), "-r", "__ns:=/ns"]
    assert refused("planner", *given, "-p", "planner:speed_mps:=0.6", env=ros_env) == (
        "planner: -p speed_mps:=0.6 has no effect: a parameter file says 0.4 for this node; "
        "change it there"
    )


@pytest.mark.parametrize(
    "given",
    [
        "speed_mps:=5e-1", "speed_mps:=.5", "speed_mps:='0.6'", "use_sim_time:=Y",
        "recovery.enabled:=off", "bat.iterations:=+9", "odom_frame:='12:30'", "seed:=0x10",
    ],
)  # fmt: skip
def test_what_rcl_reads_in_another_form_has_an_effect(given: str) -> None:
    context = Context()
    context.init(args=["--ros-args", "-p", given])
    node = rclpy.create_node("planner", context=context, start_parameter_services=False)
    try:
        check_given_parameters(node, ["--ros-args", "-p", given])
        name = given.partition(":=")[0]
        with pytest.raises(ConfigError, match=f"-p {name}:=another has no effect: a param"):
            check_given_parameters(node, ["-p", f"{name}:=another"])
        check_given_parameters(node, ["-p", f"{name}:=another", "-p", given])
        check_given_parameters(node, ["-p", f"other_node:{name}:=another"])
    finally:
        node.destroy_node()
        context.shutdown()


def test_a_misspelt_parameter_is_named(ros_env: dict[str, str]) -> None:
    arguments = parameters("sped_mps:=0.5", "use_sim_time:=false")
    planner = start("planner", *arguments, env={**ros_env, "RCUTILS_LOGGING_BUFFERED_STREAM": "1"})
    assert planner.stdout is not None
    assert "[planner]: listening to " in planner.stdout.readline()
    line = planner.stdout.readline()
    assert line.endswith("[planner]: sped_mps: no such parameter; did you mean 'speed_mps'?\n")
    planner.terminate()
    assert planner.communicate(timeout=60) == ("", "")
    assert planner.returncode == 0


@pytest.mark.parametrize("node", ["planner", "virtual_sensor", "world_sim"])
def test_a_node_may_go_without_the_services_of_parameters(
    graph: Graph, ros_env: dict[str, str], node: str
) -> None:
    less = parameters("start_type_description_service:=false")
    with start(node, "--no-parameter-services", *less, env=ros_env) as process:
        try:
            graph.call(Trigger, f"{node}/ready")  # advertised last
            services = dict(graph.probe.get_service_names_and_types())
        finally:
            process.terminate()
        assert process.wait(timeout=60) == 0
    own = {"planner": {"cancel"}, "world_sim": {"pause", "reset", "step"}}.get(node, set())
    offered = {name for name in services if name.startswith(f"/{node}/")}
    assert offered == {f"/{node}/{name}" for name in own | {"ready"}}


def test_a_world_without_commands_gives_up_in_one_line(
    graph: Graph, ros_env: dict[str, str]
) -> None:
    odom = graph.collect(topics.ODOM)
    arguments = parameters("lockstep:=true", "answer_timeout_s:=0.1", "answer_retries:=2")
    world = start("world_sim", *arguments, env=ros_env)
    graph.until(lambda: world.poll() is not None, timeout_s=60.0)
    _, err = world.communicate()
    assert world.returncode == 1
    assert err == (
        "world_sim: tick 0: no goal_step of its stamp and cmd_vel though published 3 times, "
        "0.1 s apart; "
        "is the planner running?\n"
    )
    graph.settle()
    assert len(odom) == 3


def test_a_full_disk_is_one_line_and_a_bag_that_can_be_recovered(
    graph: Graph, ros_env: dict[str, str], tmp_path: Path
) -> None:
    """RLIMIT_FSIZE: the kernel refuses as it does on a full disk, which one chunk fits on."""
    arguments = parameters(f"output:={tmp_path / 'bag'}")
    recorder = start("recorder", *arguments, env=ros_env, file_limit=CHUNK_BYTES + 200_000)
    plans = graph.writer(topics.PLAN)
    count = 0

    def feed() -> bool:
        nonlocal count
        if plans.get_subscription_count():
            count += 1
            plans.publish(noise(count))
        return recorder.poll() is not None

    graph.until(feed, timeout_s=60.0)
    _, err = recorder.communicate()
    assert recorder.returncode == 1
    assert err.startswith(f"recorder: {tmp_path / 'bag'}: disk full after ")
    assert err.endswith(f"make room and run `mfba recover {tmp_path / 'bag'}`\n")
    assert err.count("\n") == 1
    saved = recover(tmp_path / "bag", tmp_path / "saved").messages
    assert 0 < saved <= count
    with BagReader(tmp_path / "saved") as reader:
        assert reader.topics["/plan"].message_count == saved


def noise(seed: int) -> PathMsg:
    """A message that does not compress."""
    digits = [int.from_bytes(os.urandom(6), "little") + seed for _ in range(200)]
    return path_msg([(1.0 / (1 + d), d * 1e-3) for d in digits], seed, "odom")


def test_only_the_main_thread_of_a_node_takes_an_interrupt(tmp_path: Path) -> None:
    """Another one would get it while the main thread computes the distance to go."""
    with Program("planner", cwd=tmp_path) as program:
        tasks = Path(f"/proc/{program.process.pid}/task")
        held_by: dict[str, bool] = {}

        def count() -> bool:
            for task in tasks.iterdir():
                status = (task / "status").read_text()
                blocked = re.search(r"^SigBlk:\s*(\w+)", status, re.MULTILINE)
                assert blocked
                held_by[task.name] = bool(int(blocked[1], 16) >> (signal.SIGINT - 1) & 1)
            return len(held_by) > 8 and not held_by[tasks.parent.name]

        wait_until(count, timeout_s=60.0)
        program.process.send_signal(signal.SIGINT)
        assert program.end() == 0
    assert [name for name, held in held_by.items() if not held] == [tasks.parent.name]


def test_signals_at_random_moments_are_quiet() -> None:
    """Three of each to each node; the script judges exit code, stderr and bag."""
    done = subprocess.run(
        [sys.executable, str(ROOT / "bench" / "signals.py"), "3"],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines()[-1] == "30 of 30 ended well"


@pytest.mark.parametrize("node", ["planner", "virtual_sensor", "world_sim", "recorder"])
def test_help_answers_instead_of_starting_a_node(ros_env: dict[str, str], node: str) -> None:
    # With a middleware that does not exist no node could start.
    process = start(node, "--help", env={**ros_env, "RMW_IMPLEMENTATION": "rmw_none"})
    out, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (0, "")
    assert out.startswith(f"usage: {node} [-h] [--no-parameter-services] [--ros-args ...]")
    documented = {name for settings in PARAMETERS[node] for name, _, _ in walk(settings)}
    assert set(re.findall(r"^  ([a-z_0-9.]+) \(", out, re.MULTILINE)) == documented


def test_an_unknown_argument_is_refused(ros_env: dict[str, str]) -> None:
    line = refused("planner", "--speed", "1.0", "--ros-args", "-p", "seed:=1", env=ros_env)
    assert line == "planner: --speed: unknown argument; known: --help, --no-parameter-services"
    line = refused("recorder", "runs/mine", env=ros_env)
    assert line == "recorder: runs/mine: unknown argument; see `recorder --help`"


@pytest.mark.parametrize(
    ("node", "given", "line"),
    [
        (
            "planner",
            ["method:=predictive", "scan_x:=0.1", "scan_flipped:=true"],
            "[planner]: listening to /scan, /odom, /sectors, /goal_pose, /waypoints; decides: "
            "predictive, perception auto, omnidirectional, robot radius 0.3 m, 0.785 m/s; lidar "
            "mounted at (0.1, 0) m, yaw 0, upside down\n",
        ),
        (
            "virtual_sensor",
            ["source:=scan", "robot_radius_m:=0.25"],
            "[virtual_sensor]: listening to /odom, /scan; 12 sectors up to 0.8 m from scan, robot "
            "radius 0.25 m; lidar mounted at (0, 0) m, yaw 0\n",
        ),
    ],
)
def test_a_node_says_what_it_listens_to_and_what_decides(
    ros_env: dict[str, str], node: str, given: list[str], line: str
) -> None:
    env = {**ros_env, "RCUTILS_LOGGING_BUFFERED_STREAM": "1"}
    process = start(node, *parameters(*given), env=env)
    assert process.stdout is not None
    found = process.stdout.readline()
    process.terminate()
    process.communicate(timeout=60)
    assert found.endswith(line)
