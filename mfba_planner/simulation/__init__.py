# SPDX-License-Identifier: Apache-2.0
"""The simulated world: obstacles, robot, sensors, contact, fleets, and the resulting Episode."""
