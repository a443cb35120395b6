# SPDX-License-Identifier: Apache-2.0
"""DynaBARN (Nair et al., SSRR 2022): discs on keyframes that repeat.

Its authors publish Gazebo worlds whose models name a plugin, and the C++ source of each plugin,
which creates the keyframes. The same as JSON: {"worlds": {NAME: [disc, ...]}, "keyframes": {disc:
{"duration_s": s, "txyz": [[t, x, y, z], ...]}}}. The task is that of the BARN challenge: from
(11, 0), heading -x, 20 m along -x.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from ...core.errors import ConfigError
from ...core.input_files import read_input_text
from .imported import Imported, ImportOptions, Plain, Source, check_count, number, numbers, rounded

START_M, GOAL_M = (11.0, 0.0), (-9.0, 0.0)
ROBOT_RADIUS_M = 0.22
TIME_LIMIT_S = 100.0
DISC_RADIUS_M = 0.5
LOST = (
    "the splines that Gazebo lays through keyframes: discs move straight between them",
    "the heading -x at the start: scenarios begin with +x",
)

_LENGTH = re.compile(r"PoseAnimation\s*\(\s*\"[^\"]*\"\s*,\s*([^,\s]+)\s*,\s*(true|false)")
_KEY = re.compile(
    r"CreateKeyFrame\s*\(\s*([^)\s]+)\s*\).{0,80}?Vector3d\s*\(\s*([^,\s]+)\s*,\s*([^,\s]+)\s*,",
    re.DOTALL,
)


def read_dynabarn(source: Source, options: ImportOptions) -> Imported:
    """All worlds of a JSON file of keyframes, one scenario each. Raises ConfigError."""
    data = _json(source.text)
    worlds, keyframes = data.get("worlds"), data.get("keyframes")
    if not isinstance(worlds, dict) or not isinstance(keyframes, dict) or not worlds:
        raise ConfigError('no worlds with keyframes; give {"worlds": {...}, "keyframes": {...}}')
    for world, names in worlds.items():
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise ConfigError(f"world {world}: no list of names; mend the file")
        check_count("discs", len(names))
    moving = {name: _of_json(name, entry) for name, entry in keyframes.items()}
    scenarios = []
    for world, names in worlds.items():
        if missing := [name for name in names if name not in moving]:
            raise ConfigError(f"world {world}: no keyframes of {missing[0]}; mend the file")
        discs = [_disc(moving[name]) for name in names]
        scenarios.append(task(f"{source.name}-{world}", discs, options))
    return Imported(scenarios=scenarios, lost=list(LOST))


def task(name: str, obstacles: list[Plain], options: ImportOptions) -> Plain:
    """A world of DynaBARN."""
    return {
        "name": name,
        "description": "imported from DynaBARN keyframes",
        "start_m": list(options.start_m or START_M),
        "goal_m": list(options.goal_m or GOAL_M),
        "robot_radius_m": options.robot_radius_m or ROBOT_RADIUS_M,
        "time_limit_s": options.time_limit_s or TIME_LIMIT_S,
        "obstacles": obstacles,
    }


def motion_of_plugin(file_name: str, folder: Path) -> Plain | None:
    """Trajectory and loop from the source of a Gazebo plugin, below folder; None: not there.

    The source of libNAME.so or NAME.so is NAME.cc. Raises ConfigError for one without keyframes.
    """
    stem = Path(file_name).name.removesuffix(".so").removeprefix("lib")
    if not re.fullmatch(r"[\w.+-]+", stem):
        return None
    places = [folder / f"{stem}.cc", *sorted(folder.glob(f"*/{stem}.cc"))]
    for path in places:
        if path.is_file():
            try:
                return _of_source(read_input_text(path))
            except (ConfigError, OSError, ValueError) as error:
                raise ConfigError(f"plugin {path.name}: {error}") from None
    return None


def _of_source(text: str) -> Plain:
    knots = [[number(word, "keyframe") for word in found] for found in _KEY.findall(text)]
    length = _LENGTH.search(text)
    end_s = number(length[1], "length") if length else 0.0
    return _motion(knots, end_s, loop=length is not None and length[2] == "true")


def _of_json(name: str, entry: object) -> Plain:
    if not isinstance(entry, dict) or not isinstance(entry.get("txyz"), list):
        raise ConfigError(f"keyframes of {name}: no list txyz; mend the file")
    knots = [numbers(row, 3, f"keyframe of {name}") for row in entry["txyz"]]
    end_s = number(entry.get("duration_s", 0.0), f"duration_s of {name}")
    return _motion(knots, end_s, loop=True)


def _motion(knots: list[list[float]], end_s: float, *, loop: bool) -> Plain:
    if len(knots) < 2:
        raise ConfigError(f"{len(knots)} keyframes; give two or more")
    if end_s > knots[-1][0] + 1e-6:  # it stands until the animation repeats
        knots = [*knots, [end_s, *knots[-1][1:]]]
    return {"trajectory": [rounded(*knot) for knot in knots], "loop" if loop else "stays": True}


def _disc(motion: Plain) -> Plain:
    return {"radius_m": DISC_RADIUS_M, **motion}


def _json(text: str) -> Any:
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ConfigError(f"not JSON ({error}); mend the file") from None
    if not isinstance(data, dict):
        raise ConfigError(f"a {type(data).__name__}, not an object; give DynaBARN's keyframes")
    return data
