# SPDX-License-Identifier: Apache-2.0
"""Planners: Algorithm 1 (eq. 12, 13) and the predictive planner; peers/: for comparison."""
