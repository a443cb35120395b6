# SPDX-License-Identifier: Apache-2.0
"""The errors that a user can cause. Each message is one line: value, reason, remedy."""


class MfbaError(Exception):
    """An error the user can fix; entry_points.py prints it as one line and exits with code 1."""


class ConfigError(MfbaError):
    """A scenario, parameter or option that cannot be accepted."""


class InputError(MfbaError):
    """A message or measurement that cannot be used (NaN, wrong size, stamps not rising)."""


class FrameError(InputError):
    """A message in another frame than the expected one."""


class StampError(InputError):
    """A stamp that repeats or goes back."""


class BagError(MfbaError):
    """A recording that cannot be read."""


class OutputError(MfbaError):
    """A path that cannot be written to, or must not be overwritten."""


class OptimizerError(MfbaError):
    """An optimiser that raises, asks for no points or for points outside its region."""


class OutsideError(OptimizerError):
    """A point of an optimiser that is not in its region."""


class GraphError(MfbaError):
    """The running ROS graph failed: a node ended, or a response did not arrive in time."""
