# SPDX-License-Identifier: Apache-2.0
"""Planners for comparison: APF, DWA, ORCA, VFH, straight line, and ablations of our own."""
