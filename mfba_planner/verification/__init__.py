# SPDX-License-Identifier: Apache-2.0
"""Verify bags: decide again on the recorded inputs, without ROS, and compare bit for bit."""
