# SPDX-License-Identifier: Apache-2.0
"""What a run was worth: metrics and statistics; the oracle, suites of worlds, sweeps, studies."""
