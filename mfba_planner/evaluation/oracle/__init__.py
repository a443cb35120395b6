# SPDX-License-Identifier: Apache-2.0
"""The oracle: shortest collision-free trajectory with full knowledge, and certificates."""

from .footprint_check import TimedPose, footprint_clearance
from .path_check import Fault, inspect
from .solution import Certificate, Solution
from .solve import solve

__all__ = [
    "Certificate",
    "Fault",
    "Solution",
    "TimedPose",
    "footprint_clearance",
    "inspect",
    "solve",
]
