# SPDX-License-Identifier: Apache-2.0
"""A library that fails while it is imported is named in one line; a bug of ours is none."""

from pathlib import Path

import pytest

from mfba_planner.core.broken_library import explain_broken_library

NUMPY = '''
def load():
    raise ImportError("libopenblas.so.0: cannot open shared object file\\nmore")
try:
    load()
except ImportError as error:
    raise ImportError("""

IMPORTANT: PLEASE READ THIS FOR ADVICE ON HOW TO SOLVE THIS ISSUE!
""") from error
'''
LACKS = "module 'lib_lacks' has no attribute 'Loader'"


@pytest.mark.parametrize(
    ("sources", "expected"),
    [
        (
            {"lib_linked": NUMPY},
            "lib_linked: cannot be imported (ImportError: libopenblas.so.0: cannot open shared "
            "object file)",
        ),
        (
            {"lib_built": "raise RuntimeError('compiled against another version')"},
            "lib_built: cannot be imported (RuntimeError: compiled against another version)",
        ),
        (
            {"lib_silent": "raise AssertionError"},
            "lib_silent: cannot be imported (AssertionError)",
        ),
        (
            {"lib_outer": "import lib_inner", "lib_inner": "1 / 0"},
            "lib_inner: cannot be imported (ZeroDivisionError: division by zero)",
        ),
        (
            {"lib_text": "def f(: x"},
            "{path}/lib_text.py: cannot be imported (SyntaxError: invalid syntax",
        ),
    ],
)
def test_a_library_that_fails_at_import_is_named(
    sources: dict[str, str],
    expected: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    for name, source in sources.items():
        (tmp_path / f"{name}.py").write_text(source, encoding="utf-8")
    error = raised_by(f"import {next(iter(sources))}", "mfba_planner.importing")
    line = explain_broken_library(error)
    assert line is not None
    assert line.startswith(expected.format(path=tmp_path))


def test_a_library_that_lacks_what_is_taken_from_it_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "lib_lacks.py").touch()
    source = "import lib_lacks\nLoader = lib_lacks.Loader"
    error = raised_by(source, "mfba_planner.importing")
    assert (
        explain_broken_library(error) == f"lib_lacks: cannot be imported (AttributeError: {LACKS})"
    )
    later = raised_by("import lib_lacks\n(lambda: lib_lacks.Loader)()", "mfba_planner.importing")
    assert explain_broken_library(later) is None, "a call, not an import"


@pytest.mark.parametrize(
    ("source", "module"),
    [
        ("1 / 0", "mfba_planner.importing"),
        ("import json; json.loads('{')", "mfba_planner.importing"),
        ("import mfba_planner\nmfba_planner.nothing", "mfba_planner.importing"),
        ("import importlib; importlib.import_module('json').nothing", "somebody.elses"),
    ],
)
def test_an_error_of_our_own_or_of_a_call_is_not(source: str, module: str) -> None:
    assert explain_broken_library(raised_by(source, module)) is None


def raised_by(source: str, module: str) -> BaseException:
    """What the source raises as the code of a module of that name."""
    try:
        exec(compile(source, "<a module>", "exec"), {"__name__": module})
    except Exception as error:
        return error
    raise AssertionError("nothing raised")
