# SPDX-License-Identifier: Apache-2.0
"""Planners of other authors, and ablations of the predictive planner, to compare with."""
