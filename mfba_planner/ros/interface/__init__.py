# SPDX-License-Identifier: Apache-2.0
"""What nodes exchange: topics and QoS, parameters, conversions, health."""

from .. import require_ros  # noqa: F401
