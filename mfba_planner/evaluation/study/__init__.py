# SPDX-License-Identifier: Apache-2.0
"""Long computations in parts: resumable, anywhere, the same whoever computes them."""
