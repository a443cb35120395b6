# SPDX-License-Identifier: Apache-2.0
"""Worlds without number: seeded generators and the suites they are known by."""

from .named_suites import Suite, suite, suite_names

__all__ = ["Suite", "suite", "suite_names"]
