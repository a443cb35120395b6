# SPDX-License-Identifier: Apache-2.0
"""Helper of `mfba decide`, not a command: prints the decisions on a recording and writes them."""

from __future__ import annotations

from collections import Counter
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ... import __version__
from ...core.errors import ConfigError
from ...core.option_specs import flatten
from ...core.output_files import PostponedErrors
from ...core.planner_types import Decision
from ...evaluation.metrics import MetricsAccumulator, Result
from ...recording.bag_reader import BagReader
from ...recording.perceived import (
    MOST_PERCEIVED,
    EvenChoice,
    Perceived,
    TrackedCircle,
    returns_of,
)
from ...recording.robot_recordings import Trip, apart, lidar_of, name_of, trip_scenario
from ...recording.run_setup import Setup
from ...simulation.decision_digest import Digest
from ...simulation.episode import Episode
from ...verification.redecide import DecidedScan, RecordingDecider, RedecideParams

if TYPE_CHECKING:
    from ...ros.interface.decisions_to_bag import DecisionBag

MOST_DECISIONS = 20_000  # in memory, for the page and the picture
DRIVER = "recording"


class DecidedRun:
    """The decisions on one recording: counted, hashed and written one by one.

    At most MOST_DECISIONS of them are kept, evenly apart.
    """

    def __init__(
        self,
        decider: RecordingDecider,
        params: RedecideParams,
        reader: BagReader,
        out: Path | None,
    ) -> None:
        """Nothing is read or written yet; `out` is the directory to create, None for none."""
        self._decider, self._params, self._out = decider, params, out
        self._reader, self._name = reader, name_of(reader.path)
        self._modes: Counter[str] = Counter()
        self._digest = Digest()
        self._ticks: EvenChoice[Decision] = EvenChoice(MOST_DECISIONS)
        self._perceived: EvenChoice[Perceived] = EvenChoice(MOST_PERCEIVED)
        self._first: Decision | None = None
        self._last: Decision | None = None
        self._metrics: MetricsAccumulator | None = None
        self._bag: DecisionBag | None = None

    def print_head(self) -> None:
        """Print what is decided on, and by what."""
        decider, planner = self._decider, self._decider.planner
        goals = [goal for _, goal in decider.goals]
        more = f" and {len(goals) - 1} more" if goals[1:] else ""
        print(
            f"recording: scan {', '.join(decider.scans)}, odometry {decider.odometry} in "
            f"{decider.frame!r}, goal ({goals[0][0]:g}, {goals[0][1]:g}){more}"
        )
        print(
            f"robot:     radius {planner.robot_radius_m:g} m, {planner.drive.value}, "
            f"{planner.speed_mps:g} m/s, steps of {planner.step_length_m:g} m; "
            f"planner {planner.label}, seed {self._params.seed}"
        )

    def decide_all(self) -> None:
        """Decide on every scan; on an error nothing is left of the directory."""
        if self._out is not None:
            self._bag = _new_bag(self._out / "bag", self._params, self._decider)
        try:
            if self._bag is not None:
                self._bag.copy(self._reader, self._decider.scans, self._decider.odom)
            for step in self._decider.decide():
                self._add(step)
            if self._bag is not None:
                facts = {"driver": DRIVER, "mfba_planner": __version__, "name": self._name}
                self._bag.close(self._nodes(), facts)
        except BaseException:
            if self._bag is not None and self._out is not None:
                self._bag.discard()
                with suppress(OSError):
                    self._out.rmdir()
            raise

    def finish(self) -> None:
        """Print modes, table and digest; write the files of the directory."""
        print("modes: " + ", ".join(f"{m} {n}" for m, n in sorted(self._modes.items())))
        count = self._modes.total()
        print(f"decided: {count} decisions, digest {self._digest.hexdigest()}")
        if self._out is None or self._metrics is None or self._last is None:
            return
        episode = self._setup().episode(tuple(self._ticks.items))
        names, errors = ["bag"], PostponedErrors()
        with errors.postponed():
            self._write(self._out, names, episode, self._metrics.result(episode.outcome))
        print(f"wrote {self._out}: {', '.join(names)}", flush=True)
        errors.raise_first()

    def _add(self, step: DecidedScan) -> None:
        decision, decider = step.decision, self._decider
        self._modes[decision.mode.value] += 1
        self._digest.add(decision)
        self._last = decision
        if self._first is None:
            self._first = decision
            self._metrics = MetricsAccumulator(self._setup().episode((decision,)))
        assert self._metrics is not None
        self._metrics.add(decision)
        if self._out is None or self._bag is None:
            return
        self._ticks.add(decision)
        self._perceived.add(self._perceive(step) if self._perceived.takes_next else None)
        self._bag.add(decision, step.log_time_ns, decider.goal_id, decider.local_map, step.fields)

    def _perceive(self, step: DecidedScan) -> Perceived | None:
        if step.scan is None:
            return None
        tracks = (
            TrackedCircle(track.center_m, track.radius_m, track.velocity_mps)
            for track in self._decider.tracks
            if not track.unseen_s
        )
        decision = step.decision
        return Perceived(decision.stamp_ns, returns_of(step.scan, decision.pose), tuple(tracks))

    def _setup(self) -> Setup:
        """The setup of the run so far."""
        assert self._first is not None
        assert self._last is not None
        start, planner = self._first.pose, self._decider.planner
        goal = apart(start, self._decider.goals[-1][1])
        trip = Trip(start, goal, self._first.stamp_ns, self._last.stamp_ns)
        lidar = lidar_of(self._decider.extrinsics)
        return Setup(
            scenario=trip_scenario(self._name, trip, planner, lidar),
            sensor=self._params.sensor,
            planner=planner,
            seed=self._params.seed,
            driver=DRIVER,
            lockstep=False,
            is_simulated=False,
            start_ns=self._first.stamp_ns,
        )

    def _nodes(self) -> dict[str, dict[str, Any]]:
        """The parameters by which the nodes would decide the same."""
        params, decider = self._params, self._decider
        lidar = {
            "odom_frame": decider.frame,
            **decider.extrinsics.parameters,
            "scan_no_return": params.scan_no_return.value,
            "lockstep": False,
        }
        return {
            "planner": {**flatten(decider.planner), "seed": params.seed, **lidar},
            "virtual_sensor": {
                **flatten(params.sensor),
                "source": "scan",
                "robot_radius_m": params.robot_radius_m,
                **lidar,
            },
        }

    def _write(self, out: Path, names: list[str], episode: Episode, result: Result) -> None:
        """Write the files, and append their names."""
        # The drawing modules take long to import: only after the bag has been read.
        from ...report.html.page import write_page
        from ...report.result_json import plain, result_to_dict, write_result
        from ...report.run_figure import draw_run

        data = result_to_dict(episode, {"decided_on": str(self._reader.path)})
        data["digest"], data["result"] = self._digest.hexdigest(), plain(_as_dict(result))
        write_result(out / "result.json", data)
        names.append("result.json")
        perceived = self._perceived.items
        draw_run(episode, out / "run.png", perceived)
        names.append("run.png")
        if self._ticks.stride == 1:
            write_page([(self._name, episode)], out / "report.html", (), {},
                       {self._name: perceived})  # fmt: skip
            names.append("report.html")
        else:
            print(
                f"note: no report.html, as it shows {MOST_DECISIONS} decisions at most; "
                f"run.png shows every {self._ticks.stride}th"
            )


def _as_dict(result: Result) -> dict[str, Any]:
    return {name: getattr(result, name) for name in Result.__dataclass_fields__}


def _new_bag(directory: Path, params: RedecideParams, decider: RecordingDecider) -> DecisionBag:
    try:
        from ...ros.interface.decisions_to_bag import DecisionBag
    except ImportError:
        raise ConfigError(
            f"--out {directory.parent}: its bag needs ROS 2, which is not installed here; leave "
            "--out out, or install requirements-ros.txt"
        ) from None
    return DecisionBag(directory, decider.planner, params.sensor, decider.frame)
