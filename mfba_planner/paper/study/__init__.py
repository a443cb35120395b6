# SPDX-License-Identifier: Apache-2.0
"""The runs behind the tables: what to run, in parallel, resumable, the same for any workers."""
