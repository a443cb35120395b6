# SPDX-License-Identifier: Apache-2.0
"""What a node is made of: its publishers, its subscriptions, and what it reports of itself."""

from .. import require_ros  # noqa: F401
