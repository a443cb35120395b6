# SPDX-License-Identifier: Apache-2.0
"""Whether a node's inputs may be trusted in real time: their stamps, publishers and frames."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from ...core.errors import InputError, StampError
from ...recording.from_messages import stamp_ns
from ..interface.topics import ODOM, Topic
from ..node_settings import PlannerSettings, VirtualSensorSettings
from .base_node import GraphNode
from .reception import Reception
from .refused_inputs import RefusedInputs
from .stamp_check import StampCheck

NEWEST = 1  # queue of an input of which only the newest message counts
PAIRED = 10  # queue of an input that is looked up by the stamp of another

SEVERAL_REMEDY = (
    "give each lidar a frame of its own that tf knows, or set scan_frame to the one to use"
)
_REMEDIES = {"odom": "stop or remap all but one", "scan": SEVERAL_REMEDY}


class InputVerdict(NamedTuple):
    """Why a message is refused, "" if it is not.

    is_ordered: its stamp may take its place among the others, though the content is refused.
    """

    fault: str = ""
    is_ordered: bool = True


class InputMonitor:
    """Subscribes to a node's inputs, and checks what no single message shows.

    In lockstep queues are deep and nothing is refused: time passes only with the messages.
    """

    def __init__(
        self,
        node: GraphNode,
        settings: PlannerSettings | VirtualSensorSettings,
        refused_inputs: RefusedInputs,
        timeout_s: float,
        on_time_set_back: Callable[[], None],
    ) -> None:
        """Start without inputs; refused messages are counted in refused_inputs.

        on_time_set_back is called where the node's clock is set back, and where stamps go back
        and are right; it calls reset().
        """
        self._node, self._refused_inputs, self._lockstep = node, refused_inputs, settings.lockstep
        self._on_time_set_back = on_time_set_back
        self._receptions: dict[str, Reception] = {}
        self.timeout_s = timeout_s  # how far a stamp may be off
        self.scan_note = ""  # what to warn of in the newest scan
        self.odom_source = ""  # where odometry is from, if that is not the topic
        self.reset()
        node.on_time_set_back(on_time_set_back)

    def reset(self) -> None:
        """Forget the stamps, as when time was set back."""
        self._stamps = StampCheck()

    def subscribe(
        self,
        topic: Topic,
        callback: Callable[[Any], None],
        *,
        depth: int = NEWEST,
        frame: str = "",
        is_merged: Callable[[str], bool] = lambda _: False,
    ) -> None:
        """Subscribe to an input; frame is the one required, if any; depth is that in real time.

        is_merged(frame): whether messages of this frame may come beside those of others.
        """
        name = topic.name
        if self._lockstep:
            # Foreign writers send scans, but no odometry that a lockstep world would not.
            self._node.subscribe(topic, callback, foreign_writers=topic is not ODOM)
            return
        self._receptions[name] = reception = Reception(
            name,
            lambda: [p.node_name for p in self._node.get_publishers_info_by_topic(name)],
            _REMEDIES.get(name, "stop all but one"),
            frame,
            is_merged,
        )

        def deliver(message: Any, info: Mapping[str, Any]) -> None:
            number, sent_ns = info["publication_sequence_number"], info["source_timestamp"]
            given, now_s = message.header.frame_id, time.monotonic()
            if reception.received(number, sent_ns, given, now_s, self.timeout_s):
                callback(message)

        self._node.subscribe_with_info(topic, deliver, depth)

    def check(self, name: str, message: Any) -> InputVerdict:
        """Check a message that was received, and count it if it is refused."""
        if self._lockstep:
            return InputVerdict()
        stamp, now_s = stamp_ns(message.header.stamp), time.monotonic()
        clock_ns = self._node.get_clock().now().nanoseconds
        fault, is_ordered, restarted = self._stamps.check(
            name, stamp, clock_ns, now_s, self.timeout_s
        )
        error: InputError = StampError(fault)
        reception = self._receptions.get(name)  # none of odometry by tf alone
        if not fault and reception and (fault := reception.fault(now_s)):
            error = InputError(fault)
        if fault:
            self._refused_inputs.add(error, name)
        if restarted:
            self._on_time_set_back()
        return InputVerdict(fault, is_ordered)

    @property
    def note(self) -> str:
        """What to warn of although nothing is refused, "" otherwise."""
        return "; ".join(filter(None, (self._stamps.note, self.scan_note)))

    @property
    def values(self) -> dict[str, str]:
        """What /diagnostics reports of each input besides its rate and age."""
        values = {"odom: source": self.odom_source} if self.odom_source else {}
        for name, reception in self._receptions.items():
            values[f"{name}: dropped"] = str(reception.dropped)
            if reception.ignored:
                values[f"{name}: ignored, other frame"] = str(reception.ignored)
            if name in self._stamps.latencies_s:
                values[f"{name}: latency [s]"] = f"{self._stamps.latencies_s[name]:.3f}"
        return values
