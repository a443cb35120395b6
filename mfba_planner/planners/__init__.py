# SPDX-License-Identifier: Apache-2.0
"""Planners by name, all behind core.planner.PathPlanner: plan(observation) -> decision."""
