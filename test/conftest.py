# SPDX-License-Identifier: Apache-2.0
"""Fixtures that isolate tests from each other and from any other ROS graph."""

import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings
from project import ROOT
from waiting import claim_domain

# A busy machine is not a failure: no property has a time limit of its own.
settings.register_profile("mfba", deadline=None)
settings.load_profile("mfba")

# Tests of the rooms that `make test` measures (pyproject.toml), and of bags read again.
MEASURED = {
    "verification",
    *re.findall(r'"mfba_planner\.(\w+)"', (ROOT / "pyproject.toml").read_text("utf-8")),
}


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Measure coverage of MEASURED tests only; of all for `make coverage`.

    Lines that only tests of commands and of the graph run have no test of their own, and
    measuring costs up to twice the time.
    """
    if config.getoption("cov_config", None) != ".coveragerc":
        return
    for item in items:
        if item.path.relative_to(ROOT / "test").parts[0] not in MEASURED:
            item.add_marker("no_cover")


@pytest.fixture(scope="session", autouse=True)
def _isolated_ros(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep discovery on this machine and ROS logs out of the home directory."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        patch.setenv("ROS_LOG_DIR", str(tmp_path_factory.mktemp("ros_log")))
        for name in ("ROS_DOMAIN_ID", "ROS_STATIC_PEERS", "RMW_IMPLEMENTATION"):
            patch.delenv(name, raising=False)
        yield


@pytest.fixture
def domain_id() -> Iterator[int]:
    """Claim a ROS domain for one test."""
    domain, lock = claim_domain()
    with lock:
        yield domain


@pytest.fixture
def ros_context(domain_id: int) -> Iterator[Any]:
    """Open a new rclpy Context in a domain of its own."""
    from rclpy.context import Context

    context = Context()
    context.init(domain_id=domain_id)
    yield context
    context.try_shutdown()
    context.destroy()


@pytest.fixture
def graph(ros_context: Any) -> Iterator[Any]:
    """Open a Graph: nodes under test and a probe, on one executor."""
    from ros_graph import Graph

    opened = Graph(ros_context)
    yield opened
    opened.close()


@pytest.fixture(scope="session")
def tf2_msgs_directory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of the package tf2_msgs, generated for the tests."""
    import tf2_msgs_package

    return tf2_msgs_package.build(tmp_path_factory.mktemp("tf2_msgs"))


@pytest.fixture
def with_tf(tf2_msgs_directory: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """The type TFMessage, with tf2_msgs installed for this test alone."""
    from mfba_planner.ros.interface import topics

    monkeypatch.syspath_prepend(str(tf2_msgs_directory))
    monkeypatch.setattr(topics, "TRANSFORMS", topics.transform_topics())
    assert [topic.name for topic in topics.TRANSFORMS] == ["/tf", "/tf_static"]
    yield topics.TRANSFORMS[0].type
    for name in [name for name in sys.modules if name.split(".")[0] == "tf2_msgs"]:
        del sys.modules[name]


@pytest.fixture
def ros_env(domain_id: int) -> dict[str, str]:
    """Return the environment for a subprocess in this test's domain."""
    return {**os.environ, "ROS_DOMAIN_ID": str(domain_id)}


@pytest.fixture
def scheduler() -> Iterator[str]:
    """The address of a real cluster of two worker processes."""
    from distributed import LocalCluster

    cluster = LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1"
    )
    with cluster:
        yield cluster.scheduler_address
