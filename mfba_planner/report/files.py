# SPDX-License-Identifier: Apache-2.0
"""Output files of the reports; how they are written stands in outputs.py."""

from mfba_planner.outputs import write_new as write_new
