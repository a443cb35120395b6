# SPDX-License-Identifier: Apache-2.0
"""From sensor data to planner inputs: sensory vector (eq. 11), obstacle tracker and memory."""
