# SPDX-License-Identifier: Apache-2.0
"""Topics and QoS, parameters, conversion to messages, markers, input health."""

from .. import require_ros  # noqa: F401
