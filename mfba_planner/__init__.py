# SPDX-License-Identifier: Apache-2.0
"""Path planning among moving obstacles with the modified frequency bat algorithm."""

__version__ = "0.1.0"
