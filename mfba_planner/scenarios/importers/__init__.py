# SPDX-License-Identifier: Apache-2.0
"""Other people's worlds as scenarios: one file per format."""
