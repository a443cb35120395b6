# SPDX-License-Identifier: Apache-2.0
"""The physics engine, or one line that says how to get it."""

try:
    import mujoco as mujoco
except ImportError:
    raise SystemExit("mujoco is not installed; run: pip install 'mujoco>=3.2,<4'") from None
