# SPDX-License-Identifier: Apache-2.0
"""Suite x planners x seeds -> one tidy table: resumable, the same whoever computes it."""
