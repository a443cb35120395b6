# SPDX-License-Identifier: Apache-2.0
"""Names the library that fails while this package imports it: no fault of ours, so one line."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import ModuleType, TracebackType

_PACKAGE = __name__.partition(".")[0]
_ROOT = Path(__file__).resolve().parent.parent


def explain_broken_library(error: BaseException) -> str | None:
    """Library and reason, without a remedy; None unless a foreign module failed in its import.

    That is: it raised, it is no Python, or it lacks what our modules take from it at import.
    """
    name = _failed_import(error)
    if name is None:
        return None
    cause = error
    while cause.__cause__ is not None:  # numpy explains at length; its cause says what is wrong
        cause = cause.__cause__
    lines = [line.strip() for line in str(cause).splitlines() if line.strip()]
    reason = f"{type(cause).__name__}: {lines[0]}" if lines else type(cause).__name__
    return f"{name}: cannot be imported ({reason})"


def _failed_import(error: BaseException) -> str | None:
    name, ours = None, False
    module, function = "", ""
    for module, function in _frames(error.__traceback__):
        if _is_ours(module):
            name, ours = None, True
        elif ours and function == "<module>":
            name = module.partition(".")[0]
    if isinstance(error, SyntaxError) and ours and error.filename is not None:
        return None if _ROOT in Path(error.filename).parents else error.filename
    if name is not None:
        return name
    if isinstance(error, AttributeError) and _is_ours(module) and function == "<module>":
        source = error.obj
        if isinstance(source, ModuleType) and not _is_ours(source.__name__):
            return source.__name__.partition(".")[0]
    return None


def _frames(traceback: TracebackType | None) -> Iterator[tuple[str, str]]:
    """Yield module and function of each frame, the outermost first, without Python's importer."""
    while traceback is not None:
        frame = traceback.tb_frame
        module = str(frame.f_globals.get("__name__", ""))
        if module.partition(".")[0] != "importlib":
            yield module, frame.f_code.co_name
        traceback = traceback.tb_next


def _is_ours(module: str) -> bool:
    return module.partition(".")[0] == _PACKAGE
