# SPDX-License-Identifier: Apache-2.0
"""Reproduced tables in every form: terminal, Markdown, CSV, JSON and one HTML page."""
