# SPDX-License-Identifier: Apache-2.0
"""The bat swarm, BA and MFBA (eq. 3-10), as a library of its own."""
