# SPDX-License-Identifier: Apache-2.0
"""From raw readings to what a planner knows: sensory vector (eq. 11), tracker, memory."""
