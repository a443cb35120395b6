# SPDX-License-Identifier: Apache-2.0
"""The paper's tables again: each printed number with ours, a verdict and the reason."""
