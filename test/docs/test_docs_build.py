# SPDX-License-Identifier: Apache-2.0
"""The documentation builds without warnings; commands and code of its pages work as shown."""

import html
import subprocess
import sys
from pathlib import Path

import pytest
import shown_commands
from shown_commands import ROOT

from mfba_planner import cli
from mfba_planner.scenarios import yaml_schema

DOCS = ROOT / "docs"
PAGES = {
    name[len("docs/") :]: page for name, page in shown_commands.PAGES.items() if "docs/" in name
}
# Pages with tests of their own, which check the output of their commands and code.
OWN_TESTS = {
    "benchmark.md": "bench/test_benchmark.py",
    "planners.md": "docs/test_docs_planners.py",
    "optimizer.md": "docs/test_docs_optimizer.py",
    "optimizers.md": "docs/test_docs_optimizers.py",
    "how-to/your-optimizer.md": "docs/test_docs_your_optimizer.py",
    "how-to/physics.md": "docs/test_docs_physics.py",
    "how-to/import-worlds.md": "docs/test_docs_import_worlds.py",
}


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("docs")
    command = [sys.executable, "-m", "sphinx", "-b", "html", "-n", "-W", "--keep-going", "-q"]
    done = subprocess.run(
        [*command, str(DOCS), str(out)], capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert not done.stderr
    return out


def test_every_page_is_built_and_linked_from_the_index(built: Path) -> None:
    start = (built / "index.html").read_text(encoding="utf-8")
    for name in PAGES:
        target = name.removesuffix(".md") + ".html"
        assert (built / target).is_file()
        assert name == "index.md" or f'href="{target}"' in start


def test_the_reference_contains_every_command_and_every_key(built: Path) -> None:
    commands = (built / "reference/cli.html").read_text(encoding="utf-8")
    for name in cli.COMMANDS:
        assert f"mfba {name}<" in commands
    assert commands.count("usage: ") >= len(cli.COMMANDS)
    keys = (built / "reference/scenario.html").read_text(encoding="utf-8")
    schema = yaml_schema.schema()
    for table in (schema, *schema["$defs"].values()):
        for key, entry in table["properties"].items():
            assert f">{key}<" in keys
            assert entry["description"] in html.unescape(keys)


@pytest.mark.parametrize("name", [n for n in PAGES if n not in OWN_TESTS])
def test_commands_and_code_of_a_page_work(name: str, tmp_path: Path) -> None:
    shown_commands.run_page(PAGES[name], tmp_path)
