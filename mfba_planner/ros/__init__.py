# SPDX-License-Identifier: Apache-2.0
"""The rclpy side: thin nodes over the planner, and what they exchange and are made of."""
