# SPDX-License-Identifier: Apache-2.0
"""Sweeps: suite x planners x seeds to one tidy table; resumable, on any executor."""
