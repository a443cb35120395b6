# SPDX-License-Identifier: Apache-2.0
"""Launcher modules: requests, directories, domains, node processes, console, signals."""

import os
import re
import signal
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from rclpy.context import Context
from rclpy.node import Node

from mfba_planner.core.errors import ConfigError, GraphError, OutputError
from mfba_planner.core.option_specs import flatten
from mfba_planner.core.robot_base import Drive
from mfba_planner.launcher.console import RunConsole
from mfba_planner.launcher.node_processes import parameters_yaml
from mfba_planner.launcher.ros_domain import (
    DOMAINS,
    claim_domain,
    private_domain,
    require_network,
)
from mfba_planner.launcher.run_arguments import read_request
from mfba_planner.launcher.run_directory import RunDirectory
from mfba_planner.launcher.set_option import option_rows
from mfba_planner.launcher.stop_request import StoppedError, StopRequest
from mfba_planner.paper import readings_of_paper
from mfba_planner.planning.planner_params import Method, PerceptionInput, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.scenarios.run_config import Driver, RunConfig, node_parameters, with_perception
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.robot_model import Robot
from mfba_planner.swarm.bat_swarm import Algorithm


def test_request_without_arguments_is_case_study_1() -> None:
    request = read_request([], "launcher")
    usual = preset(PlannerParams(method=Method.PREDICTIVE))
    scenario, usual = with_perception(load_scenario("case1"), usual)
    assert request.config == RunConfig(scenario=scenario, planner=usual)
    assert scenario.robot.lidar.beams == 360
    assert usual.perception is PerceptionInput.SCAN
    assert request.config.driver is Driver.MULTI_PROCESS
    assert (request.out, request.timeout_s, request.picture) == (None, 600.0, True)
    assert request.node_args == {
        name: [] for name in ("world_sim", "virtual_sensor", "planner", "recorder")
    }


def test_request_applies_readings_then_algorithm_then_single_options() -> None:
    request = read_request(
        ["--reading=fig1", "--swarm=table3", "--algorithm=ba", "--set=planner.bat.rho=7"]
        + ["--set=planner.swarm=fresh", "--set=sensor.sectors=16", "--set=planner.speed_mps=1"],
        "launcher",
    )
    planner = request.config.planner
    assert planner.step_length_m == readings_of_paper.planner("fig1").step_length_m
    assert planner.bat.population == readings_of_paper.swarm("table3").population
    assert planner.bat.algorithm is Algorithm.BA
    assert (planner.bat.rho, planner.speed_mps, planner.swarm.value) == (7.0, 1.0, "fresh")
    assert request.config.sensor.sectors == 16


def test_every_option_can_be_set_to_its_default() -> None:
    settings = [
        f"--set={name}={getattr(default, 'value', default)}".replace("False", "false")
        for name, default, _ in option_rows()
    ]
    settings = [setting.replace("True", "true") for setting in settings]
    assert len(settings) > 10
    paper = ["--planner=paper"]  # the defaults are those of this planner
    with_settings, plain = (
        read_request([*paper, *more], "launcher").config for more in (settings, [])
    )
    assert with_settings == plain


@pytest.mark.parametrize(
    ("args", "method", "step_m"),
    [
        ([], "predictive", 0.08),
        (["--set=planner.step_length_m=0.2"], "predictive", 0.2),
        (["--planner=paper"], "paper", 0.3),
        (["--algorithm=ba"], "paper", 0.3),
        (["--algorithm=ba", "--planner=predictive"], "predictive", 0.08),
        (["--reading=section6"], "paper", 0.3),
        (["--reading=fig1"], "paper", 0.1),
        (["--swarm=literal"], "paper", 0.3),
    ],
)
def test_options_of_algorithm_1_select_algorithm_1(
    args: list[str], method: str, step_m: float
) -> None:
    planner = read_request(args, "launcher").config.planner
    assert (planner.method.value, planner.step_length_m) == (method, step_m)
    assert (planner.bat.algorithm is Algorithm.BA) == ("--algorithm=ba" in args)


@pytest.mark.parametrize(
    ("args", "line"),
    [
        ("--planner=predictive --reading=fig1", "--reading: of planner paper only; leave it out"),
        ("--planner=predictive --swarm=literal", "--swarm: of planner paper only; leave it out"),
        (
            "--planner=paper --set=planner.method=predictive",
            "--planner paper: --set planner.method=predictive; leave one of them out",
        ),
        (
            "--algorithm=ba --set=planner.bat.algorithm=mfba",
            "--algorithm ba: --set planner.bat.algorithm=mfba; leave one of them out",
        ),
    ],
)
def test_options_that_contradict_are_refused(args: str, line: str) -> None:
    with pytest.raises(ConfigError, match=f"^{re.escape(line)}"):
        read_request(args.split(), "launcher")


def test_speed_implies_real_time_and_a_longer_timeout() -> None:
    request = read_request(["--speed=0.1"], "launcher")
    assert request.config.real_time
    assert request.config.speed_factor == 0.1
    assert request.timeout_s > request.config.scenario.time_limit_s / 0.1


def test_node_arguments_are_split_as_in_a_shell() -> None:
    args = ["--planner-args=-p a:='x y'", "--planner-args", "--log-level debug"]
    assert read_request(args, "launcher").node_args["planner"] == [
        "-p",
        "a:=x y",
        "--log-level",
        "debug",
    ]


@given(
    st.dictionaries(
        st.from_regex(r"[a-z_]{1,20}", fullmatch=True),
        st.one_of(
            st.booleans(),
            st.integers(-(2**63), 2**63 - 1),
            st.floats(allow_nan=False, allow_infinity=False),
            st.text(st.characters(codec="utf-8", exclude_categories=("Cs", "Cc"))),
            st.lists(st.floats(0.1, 1e300), min_size=1),
        ),
    )
)
def test_parameter_files_keep_values_and_types(parameters: dict[str, object]) -> None:
    read = yaml.safe_load(parameters_yaml(parameters))["/**"]["ros__parameters"]
    assert {k: (type(v), v) for k, v in read.items()} == {
        k: (type(v), v) for k, v in parameters.items()
    }


def test_ros_reads_parameter_files_unchanged(tmp_path: Path, domain_id: int) -> None:
    from rclpy.context import Context
    from rclpy.node import Node

    config = read_request(["case2", "--seed", str(2**63 - 1)], "launcher").config
    by_node = node_parameters(config, ("planner", "recorder"))
    by_node["planner"]["bat.rho"] = 1e-5
    for name, parameters in by_node.items():
        path = tmp_path / f"{name}.yaml"
        path.write_text(parameters_yaml(parameters), encoding="utf-8")
        context = Context()
        context.init(args=["--ros-args", "--params-file", str(path)], domain_id=domain_id)
        node = Node(name, context=context, automatically_declare_parameters_from_overrides=True)
        found = {key: node.get_parameter(key).value for key in parameters}
        node.destroy_node()
        context.try_shutdown()
        context.destroy()
        for key, value in parameters.items():
            plain = list(found[key]) if isinstance(value, list) else found[key]
            assert (key, type(plain), plain) == (key, type(value), value)
    assert flatten(config.planner)["bat.rho"] == 0.01


def test_directories_claimed_at_once_are_different(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    start = threading.Barrier(8)

    def claim(_: int) -> Path:
        start.wait()
        return RunDirectory(None).path

    with ThreadPoolExecutor(8) as pool:
        claimed = list(pool.map(claim, range(8)))
    assert sorted(map(str, claimed)) == [f"runs/run-{k:03d}" for k in range(1, 9)]


def test_directory_is_claimed_once_and_discarded_completely(tmp_path: Path) -> None:
    wanted = tmp_path / "a" / "b"
    directory = RunDirectory(wanted)
    with pytest.raises(OutputError, match="a/b: exists already and is never overwritten"):
        RunDirectory(wanted)
    (wanted / "file").touch()
    directory.discard()
    assert [*tmp_path.iterdir()] == []


def test_discard_keeps_a_parent_that_others_use(tmp_path: Path) -> None:
    first, second = RunDirectory(tmp_path / "runs/1"), RunDirectory(tmp_path / "runs/2")
    first.discard()
    assert second.path.is_dir()
    assert not first.path.exists()


def test_domains_are_held_once_and_given_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
    with private_domain() as first, private_domain() as second:
        assert first != second
        assert {first, second} <= set(DOMAINS)
        assert os.environ["ROS_DOMAIN_ID"] == str(second)
        assert os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"
    assert os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "SUBNET"
    assert "ROS_DOMAIN_ID" not in os.environ


def test_domain_is_free_again_after_kill_9() -> None:
    program = (
        "import os, signal; from mfba_planner.launcher.ros_domain import claim_domain;"
        "print(claim_domain()[0], flush=True); os.kill(os.getpid(), signal.SIGKILL)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, text=True, check=False
    )
    assert int(done.stdout) in free_domains()


def free_domains() -> set[int]:
    """All domains that claim_domain returns at present; none of them stays locked."""
    found = set()
    for _ in DOMAINS:
        domain, lock = claim_domain()
        lock.close()
        found.add(domain)
    return found


def test_a_domain_that_another_program_uses_is_skipped() -> None:
    """For example a robot's own nodes, which hold no lock of this package."""
    domain, lock = claim_domain()
    context = Context()
    context.init(domain_id=domain)
    node = Node("other", context=context)
    lock.close()
    try:
        found = free_domains()
        assert domain not in found
        assert len(found) > len(DOMAINS) / 2
    finally:
        node.destroy_node()
        context.try_shutdown()
        context.destroy()
    assert domain in free_domains()


def test_lines_of_several_threads_stay_whole(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    console = RunConsole()
    console.log_to(tmp_path / "log.txt")

    def print_lines(node: str) -> None:
        for k in range(200):
            console.print_node_line(node, f"{k} " + node * 50)

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(print_lines, "abcd"))
    console.close()
    output = capfd.readouterr().out
    assert sorted(output.splitlines()) == sorted(
        f"[{node}] {k} " + node * 50 for node in "abcd" for k in range(200)
    )
    assert (tmp_path / "log.txt").read_text() == output


def test_stop_request_counts_signals_and_gives_the_handlers_back() -> None:
    before = signal.getsignal(signal.SIGINT)
    with StopRequest(60.0) as stop:
        stop.check()
        os.kill(os.getpid(), signal.SIGINT)
        with pytest.raises(StoppedError, match="interrupted by SIGINT") as caught:
            stop.check()
        assert (caught.value.exit_code, stop.is_urgent()) == (130, False)
        os.kill(os.getpid(), signal.SIGTERM)
        assert stop.is_urgent()
    assert signal.getsignal(signal.SIGINT) is before


def test_stop_request_has_a_timeout() -> None:
    with StopRequest(-1.0) as stop, pytest.raises(StoppedError, match="timeout of") as caught:
        stop.check()
    assert caught.value.exit_code == 1


def test_without_a_network_the_reason_is_reported() -> None:
    require_network()
    with pytest.raises(GraphError, match=r"^255.255.255.255: .*ip link set lo up"):
        require_network("255.255.255.255")  # fails like 127.0.0.1 without loopback


@pytest.mark.parametrize(
    ("arguments", "beams", "perception"),
    [
        (["case2"], 360, "scan"),
        (["case2", "--set=robot.lidar.beams=180"], 180, "scan"),
        (["case2", "--set=planner.perception=sectors"], 0, "sectors"),
        (["case2", "--planner=paper"], 0, "auto"),
        (["case2", "--algorithm=ba"], 0, "auto"),
    ],
)
def test_predictive_perceives_by_a_lidar_without_being_asked(
    arguments: list[str], beams: int, perception: str
) -> None:
    config = read_request(arguments, "launcher").config
    assert config.scenario.robot.lidar.beams == beams
    assert config.planner.perception.value == perception
    parameters = node_parameters(config, peers=())
    assert parameters["planner"]["perception"] == perception
    assert parameters["virtual_sensor"].get("source", "obstacles") == (
        "scan" if beams else "obstacles"
    )


def test_the_robot_is_given_once() -> None:
    scenario = replace(
        load_scenario("case1"), robot_radius_m=0.2, robot=Robot(drive=Drive.DIFFERENTIAL)
    )
    parameters = node_parameters(RunConfig(scenario=scenario), peers=())
    assert parameters["planner"]["robot_radius_m"] == 0.2
    assert parameters["virtual_sensor"]["robot_radius_m"] == 0.2
    assert parameters["planner"]["drive"] == "differential"


@pytest.mark.parametrize(
    ("setting", "remedy"),
    [
        ("planner.drive=differential", "give robot.drive"),
        ("planner.max_speed_mps=2", "give robot.max_speed_mps"),
        ("planner.robot_radius_m=0.2", "set robot_radius_m in the scenario file"),
    ],
)
def test_the_robot_is_not_set_for_the_planner_alone(setting: str, remedy: str) -> None:
    with pytest.raises(ConfigError, match=rf"is the scenario's; {re.escape(remedy)}$"):
        read_request([f"--set={setting}"], "launcher")


def test_algorithm_1_reads_no_scan() -> None:
    with pytest.raises(ConfigError, match=r"^perception=scan: method=paper reads sectors only"):
        read_request(["--planner=paper", "--set=planner.perception=scan"], "launcher")
