# SPDX-License-Identifier: Apache-2.0
"""The runs for the tables: plan, chunks, and computing them in parallel and resumably."""
