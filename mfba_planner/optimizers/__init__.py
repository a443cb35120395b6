# SPDX-License-Identifier: Apache-2.0
"""Optimisers by name: baselines, and adapters of libraries, which are imported when used."""
