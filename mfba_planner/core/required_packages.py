# SPDX-License-Identifier: Apache-2.0
"""Which of the package's requirements are not installed; a colcon workspace installs none."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.util import find_spec

# Distribution by module: install_requires of setup.py.
REQUIRED = {
    "eikonalfm": "eikonalfm",
    "matplotlib": "matplotlib",
    "mcap": "mcap",
    "mcap_ros2": "mcap-ros2-support",
    "numpy": "numpy",
    "PIL": "Pillow",
    "pydantic": "pydantic",
    "yaml": "PyYAML",
    "rich": "rich",
    "scipy": "scipy",
    "zstandard": "zstandard",
}


def missing_packages(modules: Iterable[str] = tuple(REQUIRED)) -> str:
    """All that are missing, with the command that installs them; "" if these modules are there."""
    names = [name for module, name in REQUIRED.items() if find_spec(module) is None]
    if all(REQUIRED[module] not in names for module in modules):
        return ""
    return f"not installed: {', '.join(names)}; run pip install {' '.join(names)}"
