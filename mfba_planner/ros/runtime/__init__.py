# SPDX-License-Identifier: Apache-2.0
"""How nodes run: executor, life cycle, clock, subscriptions, timing."""
