# SPDX-License-Identifier: Apache-2.0
"""Runs as one page for a browser: data.py and charts.py say what is in it, page.py writes it."""
