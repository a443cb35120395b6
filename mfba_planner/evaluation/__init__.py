# SPDX-License-Identifier: Apache-2.0
"""Evaluation of runs: metrics and statistics; the oracle, suites of worlds, sweeps, studies."""
