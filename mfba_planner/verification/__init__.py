# SPDX-License-Identifier: Apache-2.0
"""Whether a bag's decisions are what the planner decides: again, without ROS, bit for bit."""
