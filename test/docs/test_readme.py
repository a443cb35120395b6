# SPDX-License-Identifier: Apache-2.0
"""The commands and the code of the README run; files that README and docs name exist."""

import os
import re
from pathlib import Path

import shown_commands
from shown_commands import ROOT, mfba_arguments

README = (ROOT / "README.md").read_text(encoding="utf-8")
DOCS = [README, *(path.read_text(encoding="utf-8") for path in sorted(ROOT.glob("docs/**/*.md")))]

COMMANDS = shown_commands.commands(README)
MFBA = [
    found
    for command in COMMANDS
    if (found := mfba_arguments(shown_commands.reduced(command))) is not None
]


def test_mfba_commands_run_in_order(tmp_path: Path) -> None:
    """All of them in one directory, as a reader would type them; then the Python blocks."""
    for name in ("config", "test"):
        (tmp_path / name).symlink_to(ROOT / name)
    for words in MFBA:
        shown_commands.mfba(words, tmp_path)
    for code in shown_commands.blocks(README, "python"):
        assert "arrived" in shown_commands.python(code, tmp_path)


def test_files_named_in_the_docs_exist() -> None:
    folders = "docs|config|test|tools|bench|examples|launch"
    named = re.compile(rf"`((?:{folders})/[\w./-]+)`|\]\(([\w./-]+)\)")
    found = {a or b for text in DOCS for a, b in named.findall(text)}
    assert len(found) >= 5
    places = ("", "docs", "docs/how-to")
    here = {name for name in found if any((ROOT / at / name).exists() for at in places)}
    built = {name for name in found if "reference/" in name}
    missing = sorted(found - here - built)
    assert not missing, missing
    assert os.path.getsize(ROOT / "docs/images/case1.png") < 500_000
