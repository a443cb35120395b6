# SPDX-License-Identifier: Apache-2.0
import re
from glob import glob
from pathlib import Path

from setuptools import find_packages, setup

NAME = "mfba_planner"
SHARE = f"share/{NAME}"
INIT = (Path(__file__).parent / NAME / "__init__.py").read_text(encoding="utf-8")
PROGRAMS = (
    "planner",
    "world_sim",
    "virtual_sensor",
    "recorder",
    "replay",
    "launcher",
    "mfba",
)

setup(
    name=NAME,
    version=re.findall(r'^__version__ = "(.+)"$', INIT, re.MULTILINE)[0],
    description="Path planning among moving obstacles with the modified frequency bat algorithm",
    author="Mfba Planner Maintainers",
    author_email="maintainers@mfba-planner.example",
    maintainer="Mfba Planner Maintainers",
    maintainer_email="maintainers@mfba-planner.example",
    license="Apache-2.0",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={
        NAME: ["py.typed"],
        f"{NAME}.report.html": ["*.css", "*.html", "*.js"],
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (SHARE, ["package.xml"]),
        (f"{SHARE}/config", glob("config/*.yaml") + glob("config/*.xml")),
        (f"{SHARE}/config/scenarios", glob("config/scenarios/*.yaml")),
        (f"{SHARE}/launch", glob("launch/*launch.*")),
        (f"{SHARE}/layout", glob("layout/*")),
    ],
    entry_points={
        "console_scripts": [f"{program} = {NAME}.entry_points:{program}" for program in PROGRAMS],
    },
    python_requires=">=3.10",
    # Each has its line in docs/dependencies.md. rclpy and the messages are not here: a sourced
    # workspace brings its own, requirements-ros.txt the wheels.
    install_requires=[
        "eikonalfm>=0.9.9",
        "matplotlib>=3.8",
        "mcap>=1.5",
        "mcap-ros2-support>=0.5.5",
        "numpy>=1.26,<3",
        "Pillow>=10",
        "pydantic>=2,<3",
        "PyYAML>=6",
        "rich>=13",
        "scipy>=1.11",
        "zstandard>=0.22",
    ],
    # Not tests_require: with it `colcon test` runs no test and stays green.
    extras_require={
        "bags": ["rosbags>=0.11"],
        "dask": ["distributed>=2024.1"],
        "docs": [
            "furo>=2024.8",
            "myst-parser>=4",
            "sphinx>=8",
        ],
        "orca": ["pyrvo>=0.4"],
        "parquet": ["pyarrow>=15"],
        "physics": ["mujoco>=3.2,<4"],
        "test": [
            "cmaes>=0.11,<1",
            "distributed>=2024.1",
            "hypothesis>=6.100",
            "mealpy>=3.0.2,<4",
            "mujoco>=3.2,<4",
            "niapy>=2.7,<3",
            "pyarrow>=15",
            "pybag-sdk>=0.13",
            "pyrvo>=0.4",
            "pytest>=8",
            "pytest-cov>=6",
            "pytest-xdist>=3.6",
            "rerun-sdk>=0.29",
            "rosbags>=0.11",
            "selenium>=4.25",
            "small-mcap>=0.10",
        ],
        "view": ["rerun-sdk>=0.29"],
        "optimizers": [
            "cmaes>=0.11,<1",
            "mealpy>=3.0.2,<4",
            "niapy>=2.7,<3",
        ],
        "lint": [
            "mypy>=2.4,<2.5",
            "ruff>=0.17,<0.18",
            "types-PyYAML",
        ],
    },
    zip_safe=False,
)
