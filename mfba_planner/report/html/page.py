# SPDX-License-Identifier: Apache-2.0
"""Write runs as one HTML page with style, script, data and charts inside; it loads nothing."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template

from mfba_planner import __version__
from mfba_planner.core.errors import InputError
from mfba_planner.core.output_files import write_new
from mfba_planner.recording.local_maps import NO_MAPS, RobotMaps
from mfba_planner.recording.perceived import NOTHING_PERCEIVED, RobotPerceived
from mfba_planner.report import format_values
from mfba_planner.simulation.episode import Episode

from .charts import charts, look
from .page_data import MOST_ROBOTS, MOST_RUNS, MOST_TICKS, in_one_scene, page_data, world_name

# Joined to one script in this sequence; each file uses only what the files before it define.
_SCRIPTS = (
    "dom", "playback_clock", "scene", "readout", "charts", "tables", "playback_bar", "main",
)  # fmt: skip


def write_page(
    runs: Sequence[tuple[str, Episode]],
    path: Path,
    roster: Sequence[str] = (),
    maps: RobotMaps = NO_MAPS,
    perceived: RobotPerceived = NOTHING_PERCEIVED,
) -> None:
    """Write the page of some named runs; the same runs give the same bytes.

    roster: the names of all robots of the fleet, if the runs are of one; they share a scene.
    maps: the local maps of each run, by its name; perceived: what real robots perceived.
    Raises InputError for too many runs or ticks, OutputError when path exists already or cannot
    be written.
    """
    write_new(path, page(runs, roster, maps, perceived).encode())


def page(
    runs: Sequence[tuple[str, Episode]],
    roster: Sequence[str] = (),
    maps: RobotMaps = NO_MAPS,
    perceived: RobotPerceived = NOTHING_PERCEIVED,
) -> str:
    """The text of the page. Raises InputError for too many runs or ticks."""
    episodes = [episode for _, episode in runs]
    is_fleet = in_one_scene(runs, roster)
    check_size(len(runs), sum(len(episode.ticks) for episode in episodes), is_fleet=is_fleet)
    worlds = (world_name(name, episode, roster) for name, episode in runs)
    names = ", ".join(dict.fromkeys(worlds))
    script = "\n".join(_own(f"{name}.js") for name in _SCRIPTS)
    return Template(_own("page.html")).substitute(
        title=escape(format_values.one_line(names, 80)),
        policy=_policy(script),
        style=_own("page.css"),
        data=as_json(
            {
                **page_data(runs, __version__, roster, maps, perceived),
                "worlds": names,
                "charts": charts(episodes),
                "looks": [look(number) for number in range(len(runs))],
            }
        ),
        script=script,
    )


def check_size(runs: int, ticks: int = 0, *, is_fleet: bool = False) -> None:
    """Raise InputError for more than a page can show."""
    if is_fleet and runs > MOST_ROBOTS:
        raise InputError(
            f"{runs} robots: too many for one scene ({MOST_ROBOTS} at most); name up to "
            f"{MOST_RUNS} with --robot"
        )
    if runs > MOST_RUNS and not is_fleet:
        raise InputError(f"{runs} runs: too many to show side by side; give {MOST_RUNS} at most")
    if ticks > MOST_TICKS:
        raise InputError(
            f"{ticks} ticks: too many for a page; give {MOST_TICKS} at most, or see `mfba export`"
        )


def as_json(data: object) -> str:
    """JSON for the inside of a script element: <, > and & are escaped, so it cannot end it."""
    text = json.dumps(data, allow_nan=False, ensure_ascii=True, separators=(",", ":"))
    for character in "<>&":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return text


def _policy(script: str) -> str:
    """A content security policy that allows this script only, and no request."""
    allowed = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return (
        f"default-src 'none'; script-src 'sha256-{allowed}'; style-src 'unsafe-inline'; "
        "img-src data:"
    )


def _own(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")
