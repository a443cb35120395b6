# SPDX-License-Identifier: Apache-2.0
"""Suites: named, seeded generators of worlds."""

from .named_suites import Suite, suite, suite_names

__all__ = ["Suite", "suite", "suite_names"]
