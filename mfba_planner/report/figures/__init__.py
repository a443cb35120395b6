# SPDX-License-Identifier: Apache-2.0
"""The paper's figures again, one module each; they eat Episodes, or the core's own functions."""
