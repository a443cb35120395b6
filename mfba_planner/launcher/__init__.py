# SPDX-License-Identifier: Apache-2.0
"""The launcher: one run under any driver, from the command line to the result."""


def main(args: list[str], prog: str = "launcher") -> int:
    """Make the run that args describe; return the exit code. MfbaErrors pass through."""
    from .forked_process import ForkServer

    # It imports what the nodes need while this process imports what a request needs: with the
    # usual driver that is needed, with another it does no harm.
    is_likely = not any(word.startswith(("--driver", "-h", "--help")) for word in args)
    with ForkServer(at_once=is_likely) as fork_server:
        from .execute_run import execute
        from .run_arguments import read_request

        return execute(read_request(args, prog), fork_server)
