# SPDX-License-Identifier: Apache-2.0
"""Where the project and the tests' data lie."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TEST_DATA = ROOT / "test" / "data"
