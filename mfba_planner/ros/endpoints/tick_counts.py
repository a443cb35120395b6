# SPDX-License-Identifier: Apache-2.0
"""Whether the topics that carry one message per tick have equally many."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping

from ..interface.topics import GRAPH
from .robot_namespace import below


def are_unequal(
    counts: Mapping[str, int], namespaces: Collection[str], resolve: Callable[[str], str]
) -> bool:
    """Whether these topics of one robot differ in number; robots may end at different ticks.

    counts: messages by full name; resolve makes a full name of one below a namespace. A topic
    without messages does not count: nobody publishes it.
    """
    of_ticks = [topic for topic in GRAPH if topic.every_tick and not topic.name.startswith("/")]
    for namespace in ("", *namespaces):
        numbers = {counts.get(resolve(below(namespace, topic).name), 0) for topic in of_ticks}
        if len(numbers - {0}) > 1:
            return True
    return False
