# SPDX-License-Identifier: Apache-2.0
"""Sphinx configuration of `make docs`; writes the reference pages from the code first."""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE.parent / "tools")]

import reference  # noqa: E402

import mfba_planner  # noqa: E402

reference.write_pages(HERE / "reference")

project = "mfba_planner"
author = "Mfba Planner Maintainers"
copyright = f"2026, {author}"
version = release = mfba_planner.__version__

extensions = ["myst_parser"]
source_suffix = {".md": "markdown"}
exclude_patterns = ["_build"]
# Links to a heading of another page, as GitHub resolves them too.
myst_heading_anchors = 3
nitpicky = True

html_theme = "furo"
html_title = f"mfba_planner {release}"
html_copy_source = False
