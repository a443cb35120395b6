# SPDX-License-Identifier: Apache-2.0
"""Scenario files and run configurations, checked when they are read."""
