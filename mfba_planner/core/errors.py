# SPDX-License-Identifier: Apache-2.0
"""The errors a user can cause; each message is one line: value, reason, remedy."""


class MfbaError(Exception):
    """Anything the user can mend; entry_points.py turns it into one line and exit code 1."""


class ConfigError(MfbaError):
    """A scenario, parameter or option that cannot be accepted."""


class InputError(MfbaError):
    """A message or measurement that cannot be used (NaN, wrong size, out of order)."""


class FrameError(InputError):
    """A message in another frame than the one that was agreed on."""


class StampError(InputError):
    """A stamp that was answered before, or goes back."""


class BagError(MfbaError):
    """A recording that cannot be read as what it claims to be."""


class OutputError(MfbaError):
    """A place that cannot be written to, or must not be overwritten."""


class GraphError(MfbaError):
    """The running graph failed: a node died, or an answer never came."""
