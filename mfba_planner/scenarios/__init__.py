# SPDX-License-Identifier: Apache-2.0
"""What is to be run: scenario files and run configurations, checked when they are read."""
