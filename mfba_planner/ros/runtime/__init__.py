# SPDX-License-Identifier: Apache-2.0
"""How nodes run: executor, life cycle, clock, subscriptions, and what they decide without ROS."""

from .. import require_ros  # noqa: F401
