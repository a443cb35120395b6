# SPDX-License-Identifier: Apache-2.0
"""The environment of a private ROS domain: without whatever lets others hear it."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from ..core.errors import GraphError

# Participants of one discovery server find each other whatever their domains, and static peers
# are asked wherever they are. The old ROS_LOCALHOST_ONLY overrides the range that a run sets.
DISCOVERY_VARIABLES = (
    "ROS_DISCOVERY_SERVER",
    "ROS_SUPER_CLIENT",
    "ROS_STATIC_PEERS",
    "ROS_LOCALHOST_ONLY",
)
# A middleware's own configuration can name servers, peers, interfaces and another domain, and
# Fast DDS reads more variables from its environment file.
CONFIGURATION_VARIABLES = (
    "FASTRTPS_DEFAULT_PROFILES_FILE",
    "FASTDDS_DEFAULT_PROFILES_FILE",
    "RMW_FASTRTPS_USE_QOS_FROM_XML",
    "FASTDDS_ENVIRONMENT_FILE",
    "CYCLONEDDS_URI",
)
# Keys and permissions are for a robot's nodes: those of a run have none and would not start.
SECURITY_VARIABLES = (
    "ROS_SECURITY_ENABLE",
    "ROS_SECURITY_STRATEGY",
    "ROS_SECURITY_KEYSTORE",
    "ROS_SECURITY_ENCLAVE_OVERRIDE",
)
IGNORED_VARIABLES = (*DISCOVERY_VARIABLES, *CONFIGURATION_VARIABLES, *SECURITY_VARIABLES)
# Fast DDS reads these from the working directory, unless SKIP_XML is 1.
PROFILE_FILES = ("DEFAULT_FASTRTPS_PROFILES.xml", "DEFAULT_FASTDDS_PROFILES.xml")
SKIP_XML = "SKIP_DEFAULT_XML_FILE"
# Middleware that keeps domains and hosts apart once IGNORED_VARIABLES are removed.
MIDDLEWARE = ("rmw_fastrtps_cpp", "rmw_fastrtps_dynamic_cpp", "rmw_cyclonedds_cpp")


def require_isolating_middleware() -> None:
    """Raise GraphError for middleware whose isolation is not known, as one that uses a router."""
    name = os.environ.get("RMW_IMPLEMENTATION", "")
    if name and name not in MIDDLEWARE:
        raise GraphError(
            f"RMW_IMPLEMENTATION={name}: not known to keep a run apart from other hosts and "
            f"robots; unset it or give one of {', '.join(MIDDLEWARE)}"
        )


def ignored_settings() -> list[str]:
    """Variables and files of the user that do not hold in a private domain."""
    found = [name for name in IGNORED_VARIABLES if os.environ.get(name)]
    if os.environ.get(SKIP_XML) != "1":
        found += [name for name in PROFILE_FILES if Path(name).exists()]
    return found


@contextmanager
def private_environment(variables: Mapping[str, str]) -> Iterator[None]:
    """Set variables for this process and its children, without IGNORED_VARIABLES."""
    variables = {**variables, SKIP_XML: "1"}
    names = dict.fromkeys((*variables, *IGNORED_VARIABLES))
    previous = {name: os.environ.pop(name, None) for name in names}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in previous.items():
            os.environ.pop(name, None)
            if value is not None:
                os.environ[name] = value
