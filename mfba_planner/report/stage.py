# SPDX-License-Identifier: Apache-2.0
"""An episode as a Rerun recording: the world to walk through in time, in 3D, with plots."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

from ..core.episode import Episode
from ..core.errors import ConfigError
from ..core.geometry import Point, towards
from ..core.metrics import evaluate
from ..core.planner import NANO, Decision, Mode

Rgb = tuple[int, int, int]
# Okabe and Ito's palette, as in the markers and pictures.
MODE_COLORS: dict[Mode, Rgb] = {
    Mode.IDLE: (128, 128, 128),
    Mode.PATH_GENERATION: (86, 180, 233),
    Mode.OBSTACLE_AVOIDANCE: (230, 159, 0),
    Mode.BLOCKED: (213, 94, 0),
    Mode.STOPPED: (213, 94, 0),
    Mode.ARRIVED: (0, 158, 115),
}
GREY, GREEN, ORANGE, PINK = (128, 128, 128), (0, 158, 115), (230, 159, 0), (204, 121, 167)
TIMELINE = "run"


def recorded(episode: Episode, name: str) -> bytes:
    """An episode as the content of a .rrd file. Raises ConfigError without rerun-sdk."""
    recording = _recording(name)
    memory = recording.memory_recording()
    recording.send_blueprint(_blueprint())
    _perform(recording, episode)
    content: bytes = memory.drain_as_bytes()
    return content


def show(episode: Episode, name: str) -> None:
    """Open the viewer and show an episode. Raises ConfigError without rerun-sdk."""
    recording = _recording(name)
    recording.spawn(default_blueprint=_blueprint())
    _perform(recording, episode)
    recording.flush()


def _recording(name: str) -> Any:
    try:
        import rerun as rr
    except ImportError:
        raise ConfigError(
            "view: rerun-sdk is not installed; pip install 'mfba_planner[view]'"
        ) from None
    return rr.RecordingStream("mfba_planner", recording_id=name)


def _perform(recording: Any, episode: Episode) -> None:
    import rerun as rr

    _scenery(rr, recording, episode)
    for decision in episode.ticks:
        recording.set_time(TIMELINE, duration=decision.stamp_ns * NANO)
        _tick(rr, recording, episode, decision)


def _blueprint() -> Any:
    import rerun.blueprint as rrb

    plots = [rrb.TimeSeriesView(origin=f"/plots/{name}") for name in ("speed", "range")]
    words = rrb.TextLogView(origin="/reason")
    result = rrb.TextDocumentView(origin="/result")
    side = rrb.Vertical(*plots, words, result, row_shares=[2, 2, 3, 2])
    return rrb.Horizontal(rrb.Spatial3DView(origin="/world"), side, column_shares=[3, 2])


def _scenery(rr: Any, recording: Any, episode: Episode) -> None:
    """What does not move, the whole way in the colours of its modes, and the result."""
    scenario, result = episode.scenario, evaluate(episode)
    recording.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    places = [_flat(scenario.start_m), _flat(scenario.goal_m)]
    recording.log(
        "world/places",
        rr.Points3D(places, radii=0.12, colors=[GREY, GREEN], labels=["start", "goal"]),
        static=True,
    )
    legs = [[_flat(a.pose.position), _flat(b.pose.position)] for a, b in pairwise(episode.ticks)]
    colors = [MODE_COLORS[decision.mode] for decision in episode.ticks[:-1]]
    way = rr.LineStrips3D(legs, colors=colors, radii=0.015)
    recording.log("world/way", way, static=True)
    told = {
        "outcome": result.outcome.value,
        "length": f"{result.length_m:.3f} m",
        "time": f"{result.time_s:.2f} s",
        "least clearance": f"{result.min_clearance_m:.3f} m",
        "collisions": str(result.collisions),
    }
    rows = "\n".join(f"| {key} | {value} |" for key, value in told.items())
    text = f"# {scenario.name}\n\n| | |\n|---|---|\n{rows}\n"
    recording.log("result", rr.TextDocument(text, media_type="text/markdown"), static=True)


def _tick(rr: Any, recording: Any, episode: Episode, now: Decision) -> None:
    """One decision: obstacles, robot, sectors, candidates, step, and why."""
    scenario, color = episode.scenario, MODE_COLORS[now.mode]
    here = _flat(now.pose.position)
    time_s = now.stamp_ns * NANO - episode.planner.tick_ns * NANO
    centers = [_flat(center) for center in scenario.centers(time_s)]
    radii = [obstacle.radius_m for obstacle in scenario.obstacles]
    robot = rr.Points3D([here], radii=scenario.robot_radius_m, colors=[color])
    step = (now.waypoint[0] - here[0], now.waypoint[1] - here[1], 0.0)
    candidates = [_flat(point) for point in now.candidates]
    for name, what in {
        "obstacles": rr.Points3D(centers, radii=radii, colors=GREY),
        "robot": robot,
        "sectors": rr.LineStrips3D(_sectors(now), colors=ORANGE, radii=0.01),
        "candidates": rr.Points3D(candidates, radii=0.02, colors=GREEN),
        "step": rr.Arrows3D(origins=[here], vectors=[step], colors=[PINK]),
    }.items():
        recording.log(f"world/{name}", what)
    recording.log("plots/speed", rr.Scalars(math.hypot(*now.velocity)))
    nearest = min(now.ranges_m, default=math.inf)
    recording.log("plots/range", rr.Scalars(nearest if math.isfinite(nearest) else math.nan))
    recording.log("reason", rr.TextLog(f"{now.mode.value}: {now.reason}", color=color))


def _sectors(now: Decision) -> list[list[tuple[float, float, float]]]:
    """The outline of each lit sector, as far as it is free."""
    here, outlines = now.pose.position, []
    width = math.tau / max(len(now.ranges_m), 1)
    for i, r in enumerate(now.ranges_m):
        if math.isfinite(r):
            corners = (here, *(towards(here, k * width, max(r, 0.05)) for k in (i, i + 1)), here)
            outlines.append([_flat(corner) for corner in corners])
    return outlines


def _flat(point: Point) -> tuple[float, float, float]:
    return (point[0], point[1], 0.0)
