# SPDX-License-Identifier: Apache-2.0
"""Studies: long computations in chunks; resumable, on any executor, with the same result."""
