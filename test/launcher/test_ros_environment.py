# SPDX-License-Identifier: Apache-2.0
"""A run is received by nobody outside, whatever the environment says."""

import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from xml.etree import ElementTree

import pytest
from launched_programs import complete
from waiting import claim_domain, wait_until

from mfba_planner.core.errors import GraphError
from mfba_planner.launcher.ros_domain import private_domain
from mfba_planner.launcher.ros_environment import (
    IGNORED_VARIABLES,
    MIDDLEWARE,
    PROFILE_FILES,
    SKIP_XML,
    ignored_settings,
)

PREFIX = "44.53.00.5f.45.50.52.4f.53.49.4d.41"  # that of a discovery server with id 0
PROFILE = """\
<?xml version="1.0" encoding="UTF-8"?>
<profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
 <participant profile_name="test" is_default_profile="true"><rtps>{prefix}<builtin>
  <discovery_config><discoveryProtocol>{protocol}</discoveryProtocol>{servers}</discovery_config>
  {own}
 </builtin></rtps></participant>
</profiles>
"""
LOCATORS = """<metatrafficUnicastLocatorList><locator><udpv4><address>127.0.0.1</address>
<port>{port}</port></udpv4></locator></metatrafficUnicastLocatorList>"""
LISTENER = """
import rclpy
from geometry_msgs.msg import Twist
rclpy.init()
node = rclpy.create_node("listener")
node.create_subscription(Twist, "/cmd_vel", lambda m: print(m.linear.x, flush=True), 1000)
print("listening", flush=True)
rclpy.spin(node)
"""
TALKER = """
import rclpy
from geometry_msgs.msg import Twist, Vector3
rclpy.init()
node = rclpy.create_node("talker")
publisher = node.create_publisher(Twist, "/cmd_vel", 10)
node.create_timer(0.1, lambda: publisher.publish(Twist(linear=Vector3(x=9.0))))
rclpy.spin(node)
"""


def profiles(directory: Path) -> tuple[Path, Path, int]:
    """Profiles of a discovery server and of its clients, and the server's port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    locators = LOCATORS.format(port=port)
    servers = f'<RemoteServer prefix="{PREFIX}">{locators}</RemoteServer>'
    server, client = directory / "server.xml", directory / "client.xml"
    server.write_text(
        PROFILE.format(
            prefix=f"<prefix>{PREFIX}</prefix>", protocol="SERVER", servers="", own=locators
        )
    )
    client.write_text(
        PROFILE.format(
            prefix="",
            protocol="CLIENT",
            servers=f"<discoveryServersList>{servers}</discoveryServersList>",
            own="",
        )
    )
    return server, client, port


@contextmanager
def process(program: str, output: Path, domain: int, profile: Path) -> Iterator[None]:
    """A ROS process in a domain with a profile; what it prints goes to a file."""
    env = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
    # With LOCALHOST a discovery server cannot open its port.
    env["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "SYSTEM_DEFAULT"
    env["FASTRTPS_DEFAULT_PROFILES_FILE"] = str(profile)
    with (
        output.open("w") as out,
        subprocess.Popen([sys.executable, "-c", program], env=env, stdout=out) as running,
    ):
        try:
            yield
        finally:
            running.kill()


@pytest.mark.parametrize("driver", ["in-process", "multi-process"])
@pytest.mark.parametrize("setting", ["FASTRTPS_DEFAULT_PROFILES_FILE", "file", "server"])
def test_a_listener_in_the_users_domain_hears_nothing_of_a_run(
    tmp_path: Path, driver: str, setting: str
) -> None:
    """It would hear every command: both are told to use the same discovery server."""
    server, client, port = profiles(tmp_path)
    received, more_env = tmp_path / "received.txt", {}
    if setting == "file":
        name = PROFILE_FILES[0]
        (tmp_path / name).write_text(client.read_text())
    elif setting == "server":
        name = "ROS_DISCOVERY_SERVER"
        more_env = {name: f"127.0.0.1:{port}"}
    else:
        name = setting
        more_env = {name: str(client)}
    words = ("empty", "--driver", driver, "--planner", "paper", "--no-picture")
    users_domain, lock = claim_domain()
    other_domain, other_lock = claim_domain()
    with lock, other_lock, process(LISTENER, received, users_domain, server):
        wait_until(lambda: "listening" in received.read_text())
        done = complete("launcher", *words, cwd=tmp_path, **more_env)
        assert (done.process.returncode, done.stderr) == (0, "")
        assert f"ignored, since a run is private: {name}\n" in done.stdout
        # The listener does hear whoever is told so, in any domain.
        with process(TALKER, tmp_path / "none.txt", other_domain, client):
            wait_until(lambda: "9.0" in received.read_text())
        assert set(received.read_text().split()) == {"listening", "9.0"}


@pytest.mark.parametrize("name", IGNORED_VARIABLES)
def test_what_would_open_a_private_domain_is_removed_meanwhile_and_named(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(name, "anything")
    notes: list[str] = []
    with private_domain(notes.append):
        assert os.environ.get(name, "") != "anything"
        assert (name in os.environ) == (name == "FASTRTPS_DEFAULT_PROFILES_FILE")
    assert os.environ[name] == "anything"
    assert notes == [f"ignored, since a run is private: {name}"]


def test_nodes_of_a_private_run_announce_themselves_often(domain_id: int) -> None:
    """The profile is taken by the middleware: it names what it cannot read, and then goes on."""
    with private_domain() as domain:
        profile = Path(os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"])
        root = ElementTree.parse(profile).getroot()
        texts = {e.tag.rpartition("}")[2]: "".join(e.itertext()).split() for e in root.iter()}
        assert texts["initialAnnouncements"] == ["20", "0", "50000000"]
        code = "import rclpy; rclpy.init(); rclpy.create_node('a'); rclpy.shutdown()"
        env = {**os.environ, "RCUTILS_LOGGING_USE_STDOUT": "0"}
        done = subprocess.run(
            [sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True
        )
        assert done.stdout + done.stderr == ""
        broken = {**env, "FASTRTPS_DEFAULT_PROFILES_FILE": __file__}
        done = subprocess.run(
            [sys.executable, "-c", code], env=broken, capture_output=True, text=True, check=True
        )
        assert __file__ in done.stdout, "what is read is what the variable names"
    assert domain != domain_id


def test_a_profile_in_the_working_directory_is_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv(SKIP_XML, raising=False)
    with private_domain():
        assert os.environ[SKIP_XML] == "1"
    assert SKIP_XML not in os.environ
    assert capsys.readouterr().err == "", "nothing is ignored"
    for name in PROFILE_FILES:
        Path(name).touch()
    assert ignored_settings() == [*PROFILE_FILES]
    with private_domain():
        pass
    assert capsys.readouterr().err.count("\n") == 1
    monkeypatch.setenv(SKIP_XML, "1")  # the user reads none either
    assert ignored_settings() == []


@pytest.mark.parametrize("name", ["rmw_zenoh_cpp", "rmw_connextdds"])
def test_middleware_that_may_not_isolate_is_refused(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RMW_IMPLEMENTATION", name)
    with pytest.raises(GraphError, match=f"^RMW_IMPLEMENTATION={name}: .*; unset it or give "):
        private_domain().__enter__()


@pytest.mark.parametrize("name", MIDDLEWARE)
def test_middleware_that_isolates_is_accepted(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RMW_IMPLEMENTATION", name)
    with private_domain() as domain:
        assert domain > 0
