# SPDX-License-Identifier: Apache-2.0
"""The publishers, subscriptions and diagnostics that the nodes consist of."""

from .. import require_ros  # noqa: F401
