# SPDX-License-Identifier: Apache-2.0
"""Replays a bag: command line, topic selection, schedule, flow control."""

from .. import require_ros  # noqa: F401
