# SPDX-License-Identifier: Apache-2.0
"""Sends a service's response again while the middleware has not discovered its client."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

ATTEMPTS = 10  # the middleware waits up to 0.1 s for the client in each


def send_until_discovered(service: Any, is_wanted: Callable[[], bool]) -> None:
    """Make an rclpy Service send each response up to ATTEMPTS times while is_wanted().

    A request can arrive before the discovery of its client's response reader, on a busy machine.
    rclpy then drops the response with a RuntimeWarning, and the client waits for ever.
    """
    send_once = service.send_response

    def send(response: Any, header: Any) -> None:
        for _ in range(ATTEMPTS):
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                send_once(response, header)
            if not any(issubclass(found.category, RuntimeWarning) for found in caught):
                return
            if not is_wanted():
                break
        warnings.warn(caught[0].message, stacklevel=2)

    service.send_response = send
