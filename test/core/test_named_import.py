# SPDX-License-Identifier: Apache-2.0
"""MODULE:NAME of the user: found in the working directory, any fault is one line."""

from pathlib import Path

import pytest

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.named_import import import_named


def test_it_is_found_in_the_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "own_module_here.py").write_text("class Mine:\n    pass\n")
    monkeypatch.setattr("sys.path", [])
    monkeypatch.chdir(tmp_path)
    found = import_named("planner", "mine", "own_module_here:Mine", "a seed")
    assert found.__name__ == "Mine"


@pytest.mark.parametrize(
    ("code", "target", "cause"),
    [
        ("", "empty_module_here:X", "has no attribute 'X'"),
        ("x = (\n", "broken_module_here:X", r"was never closed \(broken_module_here.py, line 1\)"),
        ("raise RuntimeError('two\\n lines')", "raising_module_here:X", r"\(two lines\)"),
        ("import nowhere_at_all", "lacking_module_here:X", "No module named 'nowhere_at_all'"),
        ("", ":X", "Empty module name"),
    ],
)
def test_a_fault_is_one_line(
    code: str, target: str, cause: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if module := target.partition(":")[0]:
        (tmp_path / f"{module}.py").write_text(code)
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(ConfigError, match=cause) as caught:
        import_named("planner", "mine", target, "a seed", "; did you mean it?")
    text = str(caught.value)
    assert "\n" not in text
    assert text.startswith("planner mine: cannot be imported (")
    assert text.endswith(
        "; did you mean it?; give MODULE:NAME of something that is called with a seed"
    )
