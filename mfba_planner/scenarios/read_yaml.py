# SPDX-License-Identifier: Apache-2.0
"""Read text files and YAML; what cannot be read is refused in one line.

A module of its own, because yaml takes time to import and files written by programs do not need
it.
"""

from __future__ import annotations

import re
from contextlib import suppress
from typing import Any

import yaml

from ..core.errors import ConfigError
from .scenario_json import EXAMPLE


class _Fixes:
    """YAML with two fixes: 1e-3 is a number, and a key given twice is an error."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> Any:
        """Refuse duplicate keys; SafeLoader would keep the last one silently."""
        keys = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode):
                if key.value in keys:
                    problem = f"{key.value!r} given twice"
                    raise yaml.MarkedYAMLError(problem=problem, problem_mark=key.start_mark)
                keys.add(key.value)
        return super().construct_mapping(node, deep)  # type: ignore[misc]


class _Loader(_Fixes, yaml.SafeLoader):
    """The loader whose messages are shown."""


class _FastLoader(_Fixes, getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """In C where it is built: a tenth of the time for files of hundreds of obstacles."""


for _loader in (_Loader, _FastLoader):
    _loader.add_implicit_resolver(
        "tag:yaml.org,2002:float",
        re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)[eE][-+]?[0-9]+$"),
        list("-+.0123456789"),
    )


def from_yaml(text: str, origin: str, remedy: str = EXAMPLE) -> Any:
    """The parsed YAML text. Raises ConfigError naming origin, line, reason and remedy."""
    with suppress(yaml.YAMLError, ValueError, LookupError, AttributeError, RecursionError):
        return yaml.load(text, Loader=_FastLoader)
    try:
        return yaml.load(text, Loader=_Loader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f" line {mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or "unreadable characters"
        raise ConfigError(f"{origin}{where}: not YAML ({problem}); {remedy}") from None
    except (ValueError, LookupError, AttributeError, RecursionError):
        # raised by PyYAML for an invalid date, a misused tag, too deep nesting
        raise ConfigError(f"{origin}: not YAML (unreadable value); {remedy}") from None
