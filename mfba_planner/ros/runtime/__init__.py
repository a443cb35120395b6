# SPDX-License-Identifier: Apache-2.0
"""How nodes run: executor, life cycle, clock, subscriptions, timing."""

from .. import require_ros  # noqa: F401
