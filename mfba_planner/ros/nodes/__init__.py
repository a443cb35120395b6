# SPDX-License-Identifier: Apache-2.0
"""The five nodes, one per file."""

from .. import require_ros  # noqa: F401
