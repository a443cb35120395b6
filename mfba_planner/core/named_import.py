# SPDX-License-Identifier: Apache-2.0
"""What a user names as MODULE:NAME, imported."""

from __future__ import annotations

import os
import sys
from importlib import import_module
from typing import Any

from .errors import ConfigError


def import_named(kind: str, name: str, target: str, called_with: str, hint: str = "") -> Any:
    """The attribute of target, which is MODULE:NAME, for the `kind` that is called `name`.

    Modules are also searched in the working directory. Raises ConfigError for one that cannot be
    imported, for whatever reason, with the hint and what it would be called with.
    """
    module_name, _, attribute = target.partition(":")
    if os.getcwd() not in sys.path:
        sys.path.append(os.getcwd())
    try:
        return getattr(import_module(module_name), attribute)
    except Exception as error:  # a module of the user's may raise anything
        raise ConfigError(
            f"{kind} {name}: cannot be imported ({' '.join(str(error).split())}){hint}; give "
            f"MODULE:NAME of something that is called with {called_with}"
        ) from None
