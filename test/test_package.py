# SPDX-License-Identifier: Apache-2.0
"""The house itself: one version, licences, who may import whom, short files, sound packaging."""

import ast
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from configparser import ConfigParser
from graphlib import CycleError, TopologicalSorter
from importlib import import_module
from pathlib import Path
from typing import Any

import import_graph
import pytest
import yaml
from import_graph import PACKAGE, ROOMS, ROS_ROOMS, imports_of, module_graph, tree_of
from project import ROOT

from mfba_planner import __version__
from mfba_planner.cli import COMMANDS as COMMANDS_OF_MFBA
from mfba_planner.core import shipped_files
from mfba_planner.core.errors import InputError

SOURCES = sorted(PACKAGE.rglob("*.py"))
EXAMPLES = sorted((ROOT / "examples").rglob("*.py"))
NODES = ("planner", "world_sim", "virtual_sensor", "recorder", "replay")
COMMANDS = ("launcher", "mfba")

# What a room may import from outside the package, beside the standard library.
ROS = (
    {"rclpy", "tf2_msgs", "builtin_interfaces", "rcl_interfaces", "ament_index_python"}
    | {f"{kind}_msgs" for kind in ("diagnostic", "geometry", "nav", "rosgraph", "sensor", "std")}
    | {"std_srvs", "visualization_msgs"}
)
OUTSIDE: dict[str, set[str]] = {
    "": set(),
    "core": {"numpy"},
    "swarm": {"numpy"},
    "optimizers": {"cmaes", "mealpy", "niapy", "numpy", "scipy"},
    "perception": {"numpy", "scipy"},
    "planning": {"eikonalfm", "numpy", "pyrvo", "scipy"},
    "simulation": {"numpy"},
    "scenarios": {"PIL", "numpy", "pydantic", "yaml"},
    "evaluation": {"distributed", "numpy", "pyarrow", "scipy"},
    "paper": {"numpy", "scipy"},
    "recording": {"mcap", "mcap_ros2", "numpy", "rosbags", "yaml", "zstandard"},
    "verification": set(),
    "report": {"PIL", "matplotlib", "numpy", "rerun", "rich"},
    "ros": {"numpy"} | ROS,
    "launcher": {"launch", "launch_ros", "rich", "yaml"} | ROS,
    "cli": {"pyarrow", "rich", "yaml"},
}
# What decides is handed the time and its random generators, and lets others do the talking.
DECIDING = ("core", "swarm", "optimizers", "perception", "planning", "simulation")
NEVER = {"asyncio", "datetime", "logging", "multiprocessing", "random", "threading", "time"}
TOP = {"__init__.py", "entry_points.py", "py.typed"}


def is_node(path: Path) -> bool:
    return path.parent.name == "nodes" and path.stem in NODES


def relative(path: Path) -> str:
    return str(path.relative_to(ROOT))


def room(path: Path) -> str:
    parts = path.relative_to(PACKAGE).parts
    return parts[0] if len(parts) > 1 else ""


def test_nothing_lies_loose_at_the_top_and_every_folder_is_a_room() -> None:
    found = [path for path in PACKAGE.iterdir() if path.name != "__pycache__"]
    assert {path.name for path in found if path.is_file()} == TOP
    assert {path.name for path in found if path.is_dir()} == set(ROOMS) == set(OUTSIDE) - {""}
    inside = {path.name for path in (PACKAGE / "ros").iterdir() if path.is_dir()}
    assert inside - {"__pycache__"} == set(ROS_ROOMS)


@pytest.mark.parametrize("path", SOURCES, ids=relative)
def test_imports_point_down_only(path: Path) -> None:
    """Lazy ones included; ROOMS and ROS_ROOMS are from the ground up."""
    here, order = room(path), list(ROOMS)
    for name in imports_of(path):
        top, *rest = name.split(".")
        if top == "mfba_planner":
            if rest[0] in ("__version__", "entry_points"):
                continue
            allowed = order[: order.index(here) + 1] if here else ["core"]
            assert rest[0] in allowed, f"{relative(path)} must not import {name}"
            if rest[0] == "cli":
                assert rest[1] not in COMMANDS_OF_MFBA, f"{name}: no command imports another"
            if here == "ros" and rest[0] == "ros" and path.parent.name in ROS_ROOMS:
                above = ROS_ROOMS[ROS_ROOMS.index(path.parent.name) + 1 :]
                assert rest[1] not in above, f"{relative(path)} must not import {name}"
        elif top in sys.stdlib_module_names:
            assert here not in DECIDING or top not in NEVER, f"{here} must not import {name}"
        else:
            assert top in OUTSIDE[here], f"{here} must not import {name}"


def test_no_module_imports_another_in_a_circle() -> None:
    try:
        TopologicalSorter(module_graph()).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_the_picture_of_the_rooms_is_that_of_the_imports() -> None:
    assert import_graph.PICTURE.read_text(encoding="utf-8") == import_graph.svg(), (
        "run `python tools/import_graph.py --write`"
    )


def test_a_picture_shows_every_room_and_no_arrow_that_follows_from_others() -> None:
    drawn = import_graph.direct({("c", "b"), ("b", "a"), ("c", "a")})
    assert drawn == {("c", "b"), ("b", "a")}
    picture = import_graph.svg()
    assert all(f">{name}</text>" in picture for name in ROOMS)


def test_no_node_imports_another() -> None:
    for path in SOURCES:
        if room(path) == "ros":
            for name in imports_of(path):
                assert not name.startswith("mfba_planner.ros.nodes."), (
                    f"{relative(path)} imports the node {name}"
                )


def test_what_decides_draws_no_hidden_random_numbers() -> None:
    hidden = re.compile(r"np\.random\.(seed|rand|randn|random|uniform|normal)\b|default_rng\(\)")
    for path in SOURCES:
        if room(path) in DECIDING:
            assert not hidden.search(path.read_text(encoding="utf-8")), relative(path)


@pytest.mark.parametrize("path", [*SOURCES, *EXAMPLES], ids=relative)
def test_files_and_callbacks_stay_short(path: Path) -> None:
    lines = len(path.read_text(encoding="utf-8").splitlines())
    assert lines <= (150 if is_node(path) else 400)
    if not is_node(path):
        return
    tree = tree_of(path)
    handed_over = {
        argument.attr
        for call in ast.walk(tree)
        if isinstance(call, ast.Call)
        for argument in [*call.args, *(keyword.value for keyword in call.keywords)]
        if isinstance(argument, ast.Attribute)
    }
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef) and function.name in handed_over:
            length = (function.end_lineno or 0) - function.lineno + 1
            assert length <= 15, f"{function.name} has {length} lines: move its work to core"


def test_every_python_file_names_its_licence_first() -> None:
    folders = ("bench", "examples", "launch", "mfba_planner", "test", "tools")
    files = [
        ROOT / "setup.py",
        *(path for name in folders for path in (ROOT / name).rglob("*.py")),
    ]
    for path in files:
        first = path.read_text(encoding="utf-8").partition("\n")[0]
        assert first == "# SPDX-License-Identifier: Apache-2.0", relative(path)
    assert "Apache License" in (ROOT / "LICENSE").read_text(encoding="utf-8")


@pytest.fixture
def distribution(monkeypatch: pytest.MonkeyPatch) -> Any:
    """What setup.py hands to setuptools."""
    import_module("setuptools")  # brings distutils where Python has none
    monkeypatch.chdir(ROOT)
    return import_module("distutils.core").run_setup("setup.py", stop_after="init")


def manifest() -> ElementTree.Element:
    return ElementTree.parse(ROOT / "package.xml").getroot()


def test_one_version_everywhere(distribution: Any) -> None:
    released = re.search(
        r"^(\d+\.\d+\.\d+) \((\d{4}-\d\d-\d\d)\)$",
        (ROOT / "CHANGELOG.rst").read_text(encoding="utf-8"),
        re.MULTILINE,
    )
    assert released
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert manifest().findtext("version") == __version__
    assert distribution.get_version() == __version__
    assert released.group(1) == citation["version"] == __version__
    assert released.group(2) == str(citation["date-released"])


def test_manifest_is_what_ament_and_setup_expect(distribution: Any) -> None:
    root = manifest()
    assert root.get("format") == "3"
    assert root.findtext("name") == distribution.get_name() == "mfba_planner"
    assert root.findtext("license") == distribution.get_license() == "Apache-2.0"
    assert root.findtext("export/build_type") == "ament_python"
    maintainer = root.find("maintainer")
    assert maintainer is not None
    # An invalid address makes colcon drop the ament hooks without a word.
    assert re.fullmatch(
        r"[-a-zA-Z0-9_%+.]+@[-a-zA-Z0-9.]+\.[a-zA-Z]{2,}", maintainer.get("email", "")
    )
    assert maintainer.get("email") == distribution.get_maintainer_email()


def test_every_import_is_declared_and_every_dependency_justified(distribution: Any) -> None:
    wheels = {
        re.split(r"[^\w-]", requirement)[0]
        for requirement in [
            *distribution.install_requires,
            *(name for extra in distribution.extras_require.values() for name in extra),
            *(ROOT / "requirements-ros.txt").read_text(encoding="utf-8").splitlines(),
            *(ROOT / "requirements-colcon.txt").read_text(encoding="utf-8").splitlines(),
        ]
        if not requirement.startswith("#")
    }
    ros = {element.text for element in manifest() if element.tag.endswith("_depend")}
    modules = {
        "PyYAML": "yaml",
        "Pillow": "PIL",
        "mcap-ros2-support": "mcap_ros2",
        "rerun-sdk": "rerun",
    }
    declared = {modules.get(name, name) for name in wheels} | ros
    imported = {name.split(".")[0] for path in SOURCES for name in imports_of(path)}
    used = imported - sys.stdlib_module_names - {"mfba_planner"}
    assert used <= declared

    text = (ROOT / "docs/dependencies.md").read_text(encoding="utf-8")
    justified = set(re.findall(r"`([\w-]+)`", text))
    assert wheels | ros <= justified


def shipped_inside(distribution: Any) -> set[str]:
    """What setup.py installs in the package that is not Python."""
    return {
        relative(path)
        for package, patterns in distribution.package_data.items()
        for pattern in patterns
        for path in ROOT.joinpath(*package.split(".")).glob(pattern)
    }


def test_installs_every_shipped_file_in_its_place(distribution: Any) -> None:
    placed = {path: target for target, paths in distribution.data_files for path in paths}
    shipped = {
        relative(path)
        for pattern in ("package.xml", "config/**/*.*ml", "launch/*.launch.*", "layout/*")
        for path in ROOT.glob(pattern)
    }
    assert {"config/scenarios/case1.yaml", "launch/simulate.launch.py"} <= shipped
    share = Path("share/mfba_planner")
    assert placed == {path: str(share / Path(path).parent) for path in shipped} | {
        "resource/mfba_planner": "share/ament_index/resource_index/packages"
    }
    assert {str(path.parent.relative_to(ROOT)).replace("/", ".") for path in SOURCES} == set(
        distribution.packages
    )
    assert shipped_inside(distribution) == {
        relative(path)
        for path in PACKAGE.rglob("*")
        if path.is_file() and path.suffix not in (".py", ".pyc")
    }
    scripts = ConfigParser(interpolation=None)
    scripts.read(ROOT / "setup.cfg")
    assert scripts["install"]["install_scripts"] == "$base/lib/mfba_planner"
    assert scripts["develop"]["script_dir"] == "$base/lib/mfba_planner"


def test_programs_lead_to_a_main(distribution: Any) -> None:
    from mfba_planner import entry_points

    scripts = dict(line.split(" = ") for line in distribution.entry_points["console_scripts"])
    assert sorted(scripts) == sorted(NODES + COMMANDS)
    for name, target in scripts.items():
        assert target == f"mfba_planner.entry_points:{name}"
        assert callable(getattr(entry_points, name))
    for module in (*(f"ros/nodes/{name}" for name in NODES), "launcher", "cli"):
        path = PACKAGE / f"{module}.py"
        path = path if path.exists() else PACKAGE / module / "__init__.py"
        assert path.exists(), f"{module} is missing"
        mains = [node for node in tree_of(path).body if getattr(node, "name", "") == "main"]
        assert len(mains) == 1, f"{module}: main(args: list[str]) -> int is missing"


def test_shipped_files_are_found_by_name() -> None:
    names = shipped_files.scenario_names()
    assert {"case1", "case2"} <= set(names)
    assert shipped_files.scenario_path("case1").is_file()
    with pytest.raises(InputError, match=r"scenarios/case0\.yaml: not a shipped file; see "):
        shipped_files.scenario_path("case0")


def run(*command: str, **variables: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        command,
        cwd=ROOT,
        env={**os.environ, **variables},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def test_make_refuses_a_bad_interpreter_in_one_line(tmp_path: Path) -> None:
    shim = tmp_path / "python3.12"
    shim.write_text(
        "#!/bin/sh\necho 'pyenv: python3.12: command not found\n\nhelp' >&2; exit 127\n"
    )
    shim.chmod(0o755)
    venv = tmp_path / "venv"
    done = run("make", "venv", f"VENV={venv}", f"PYTHON={shim} /bin/false {tmp_path}/nowhere")
    assert done.returncode != 0
    said = [line for line in done.stderr.splitlines() if not line.startswith("make")]
    assert said == [
        f"no usable Python: {shim} does not run; /bin/false does not run; "
        f"{tmp_path}/nowhere is not there; "
        "install Python 3.10 to 3.13 or name it: make PYTHON=/path/to/python3"
    ]
    assert not venv.exists()


def test_python_finder_takes_the_first_that_works() -> None:
    done = run("tools/find_python.sh", "/bin/false", sys.executable, "/nowhere")
    assert (done.returncode, done.stdout, done.stderr) == (0, f"{sys.executable}\n", "")


def test_python_finder_names_the_version_it_refuses(tmp_path: Path) -> None:
    old = tmp_path / "python3"
    old.write_text("#!/bin/sh\necho 'is Python 3.9' >&2; exit 1\n")
    old.chmod(0o755)
    done = run("tools/find_python.sh", str(old))
    assert done.returncode == 1
    assert done.stderr.startswith(f"no usable Python: {old} is Python 3.9; install")
