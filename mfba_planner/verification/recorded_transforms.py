# SPDX-License-Identifier: Apache-2.0
"""The transforms of a recording: where its lidars are mounted, and goals of other frames."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple, TypeVar

from ..core.errors import BagError, FrameError, InputError
from ..core.geometry import Point
from ..core.lidar_extrinsics import CENTRED, PARAMETERS, LidarExtrinsics
from ..recording.bag_reader import BagReader, DecodedMessage
from ..recording.from_messages import goal_point, stamp_ns
from ..recording.odometry_from_tf import OdometryFromTf
from ..recording.planar_poses import lidar_extrinsics
from ..recording.transform_tree import TransformTree

TRANSFORMS, TF, TF_STATIC = "tf2_msgs/msg/TFMessage", "tf", "tf_static"
_OPTIONS = ", ".join("--" + name.replace("_", "-") for name in PARAMETERS)

T = TypeVar("T")


class RecordedTransforms:
    """The transforms of some topics; the static ones are known from the start, as if latched."""

    def __init__(
        self, reader: BagReader, static_topics: Sequence[str], topics: Sequence[str]
    ) -> None:
        """Read the static transforms; of several for a frame the last is used."""
        self._reader, self.moving = reader, tuple(topics)
        self.static = TransformTree()
        for message in reader.decoded(static_topics) if static_topics else ():
            self.static.add(message.message)

    def find(self, get: Callable[[TransformTree], T]) -> T:
        """What get() finds by the static transforms, or with the first others that give it.

        Raises FrameError of get() where none do.
        """
        try:
            return get(self.static)
        except FrameError as error:
            missing = error
        tree = self.static.copy()
        for message in self._reader.decoded(self.moving) if self.moving else ():
            tree.add(message.message)
            try:
                return get(tree)
            except FrameError as error:
                missing = error
        raise missing

    def odometry(self, frame: str, base: str) -> Iterator[tuple[int, DecodedMessage]]:
        """Yield (stamp, odometry) of rising stamps, where the robot sends it on /tf only."""
        tree, last_ns = self.static.copy(), -1
        by_tf = OdometryFromTf(tree, frame, base)
        for message in self._reader.decoded(self.moving) if self.moving else ():
            tree.add(message.message)
            odometry = by_tf.of(message.message)
            if odometry is not None and (stamp := stamp_ns(odometry.header.stamp)) > last_ns:
                last_ns = stamp
                yield stamp, message._replace(message=odometry)

    def goals(self, goal_topics: Sequence[str], frame: str) -> RecordedGoals:
        """All goals, in a frame: as the planner node takes them.

        One of another frame is transformed when it arrives, or as soon as its transform is known.
        """
        tree, found = self.static.copy(), RecordedGoals([], 0, "")
        held: Any = None
        of_goals, is_refused = set(goal_topics), False
        topics = goal_topics
        if self.moving and self._has_other_frame(goal_topics, frame):
            topics = [*goal_topics, *self.moving]
        for message in self._reader.decoded(topics) if topics else ():
            if message.topic in of_goals:
                held, is_refused = message.message, False
            else:
                tree.add(message.message)
            if held is None:
                continue
            try:
                point = goal_point(held, frame, tree=tree)
            except FrameError as error:
                if not is_refused:
                    found, is_refused = found.refusing(error), True
                continue
            except InputError as error:
                held, found = None, found.refusing(error)
                continue
            if is_refused:  # until its transform was known
                found = found._replace(refused=found.refused - 1)
            held = None
            found.goals.append((message.log_time_ns, point))
        return found

    def _has_other_frame(self, topics: Sequence[str], frame: str) -> bool:
        for message in self._reader.decoded(topics) if topics else ():
            try:
                goal_point(message.message, frame, tree=self.static)
            except FrameError:
                return True
            except InputError:
                continue
        return False


class RecordedGoals(NamedTuple):
    """(log time in ns, goal) sorted by time, how many are refused, and why the last one is."""

    goals: list[tuple[int, Point]]
    refused: int
    refusal: str

    def refusing(self, error: InputError) -> RecordedGoals:
        """The same with one more that is refused."""
        return self._replace(refused=self.refused + 1, refusal=str(error).split("; ")[0])


class RecordedExtrinsics:
    """The extrinsics of each scan's lidar on the robot, as given or by the transforms."""

    def __init__(
        self,
        reader: BagReader,
        transforms: RecordedTransforms,
        base: str,
        given: LidarExtrinsics | None,
    ) -> None:
        """`base` is the robot's frame, "" if the odometry names none."""
        self.notes: list[str] = []
        self._path, self._transforms, self._base, self._given = (
            reader.path, transforms, base, given
        )  # fmt: skip
        self._found: dict[str, LidarExtrinsics] = {}
        self._frame = ""
        self.last = given or CENTRED

    def of(self, frame: str) -> LidarExtrinsics:
        """The extrinsics of the lidar with this frame. Raises BagError if they are unknown."""
        if self._given is not None:
            self._require_one(frame)
            return self._given
        if frame not in self._found:
            self._found[frame] = self._find(frame)
        self.last = self._found[frame]
        return self.last

    def name(self, frame: str) -> str:
        """The lidar's name: its frame where tf gives it, else "", that of any single lidar."""
        self.of(frame)
        return frame if self._base and self._given is None else ""

    def _require_one(self, frame: str) -> None:
        """One pose is not that of two lidars."""
        self._frame = self._frame or frame
        if frame != self._frame:
            raise BagError(
                f"{self._path}: scans in frames {self._frame!r} and {frame!r}, but one pose of a "
                f"lidar is given; leave {_OPTIONS} out, so that tf gives both, or name the topic "
                "of one with --scan"
            )

    def _find(self, frame: str) -> LidarExtrinsics:
        if frame and not self._base:
            raise BagError(
                f"{self._path}: frame {frame!r}: the odometry has no child_frame_id, so the "
                f"lidar's pose on the robot is not known; give {_OPTIONS}"
            )
        try:
            found = self._transforms.find(lambda tree: lidar_extrinsics(tree, frame, self._base))
        except FrameError as error:
            raise BagError(f"{self._path}: {error}; give {_OPTIONS}") from None
        if found != CENTRED:
            flipped = ", upside down" if found.flipped else ""
            self.notes.append(
                f"/tf: {frame} is at ({found.x_m:.4g}, {found.y_m:.4g}) m in {self._base}, turned "
                f"by {found.yaw_rad:.4g} rad{flipped}"
            )
        return found
