# SPDX-License-Identifier: Apache-2.0
"""The paper's figures again, one module each, drawn from Episodes or from computed values."""
