# SPDX-License-Identifier: Apache-2.0
"""The bat algorithms BA and MFBA (eq. 3-10), usable as a library without the planner."""
