# SPDX-License-Identifier: Apache-2.0
"""MCAP bags as rosbag2 writes them: write, read, recover, describe; no rclpy needed."""
