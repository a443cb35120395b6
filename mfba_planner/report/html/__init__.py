# SPDX-License-Identifier: Apache-2.0
"""Runs as one HTML page: data.py and charts.py make the content, page.py writes the file."""
