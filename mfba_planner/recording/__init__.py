# SPDX-License-Identifier: Apache-2.0
"""MCAP bags in rosbag2's format: write, read, recover and describe them, without rclpy."""
