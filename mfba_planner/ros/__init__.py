# SPDX-License-Identifier: Apache-2.0
"""The ROS 2 nodes of the planner, their topics and parameters, and bag replay."""
