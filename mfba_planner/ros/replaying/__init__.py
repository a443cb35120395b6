# SPDX-License-Identifier: Apache-2.0
"""How a bag is published again."""

from .. import require_ros  # noqa: F401
