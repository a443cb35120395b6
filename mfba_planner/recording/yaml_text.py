# SPDX-License-Identifier: Apache-2.0
"""Read and write YAML, with libyaml if PyYAML was built with it (ten times faster)."""

from __future__ import annotations

from typing import Any

import yaml

_Dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def dump(content: object) -> str:
    """Plain data as YAML, keys in the given sequence, without a trailing newline."""
    return str(yaml.dump(content, Dumper=_Dumper, sort_keys=False)).strip()


def load(text: str) -> Any:
    """YAML text to plain data. Raises yaml.YAMLError."""
    return yaml.load(text, Loader=_Loader)
