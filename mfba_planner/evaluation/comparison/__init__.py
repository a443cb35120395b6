# SPDX-License-Identifier: Apache-2.0
"""Comparison of optimisers: the same planners, worlds, seeds and numbers of evaluations."""
