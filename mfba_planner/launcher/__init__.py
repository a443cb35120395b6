# SPDX-License-Identifier: Apache-2.0
"""The launcher: one run under any driver, from the command line to the result."""


def main(args: list[str], prog: str = "launcher") -> int:
    """Make the run that args describe; return the exit code. MfbaErrors pass through."""
    from .execute_run import execute
    from .run_arguments import read_request

    return execute(read_request(args, prog))
