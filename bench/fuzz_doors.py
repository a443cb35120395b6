# SPDX-License-Identifier: Apache-2.0
"""Where files and options enter: each case is accepted, or refused in one line."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from fuzz_inputs import VALUES, Rng, changed_bytes, changed_data, changed_mcap, pick
from PIL import Image

from mfba_planner.cli.support import simulate_peer  # noqa: F401  (imports what a run imports)
from mfba_planner.core.errors import MfbaError
from mfba_planner.core.option_specs import flatten, override
from mfba_planner.launcher.in_process_driver import run_in_process
from mfba_planner.launcher.ros_domain import claim_domain
from mfba_planner.launcher.run_arguments import read_request
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.recording.bag_info import describe, format_info
from mfba_planner.recording.read_episode import read_recording
from mfba_planner.recording.recover import recover
from mfba_planner.scenarios.importers.import_files import import_files
from mfba_planner.scenarios.importers.imported import ImportOptions
from mfba_planner.scenarios.run_config import Driver, RunConfig, with_perception
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.run_episode import simulate, simulate_fleet
from mfba_planner.verification.verify_bag import verify_each

CONFIG = Path(__file__).resolve().parent.parent / "config/scenarios"
TICKS = 3
MOST_BATS = 100_000  # in one decision; more are a request that takes its time
Case = Callable[[Rng, Path], Any]


def _yaml(data: Any) -> bytes:
    """Written by libyaml where it is there: a third of the time of a case otherwise."""
    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    text: bytes = yaml.dump(data, Dumper=dumper, allow_unicode=True, encoding="utf-8")
    return text


def _drive(scenario: Any, planner: PlannerParams, sensor: SensorParams) -> None:
    """Some ticks, as what is accepted must run."""
    ticks = iter(range(TICKS))
    run = simulate_fleet if scenario.robots else simulate
    run(
        scenario,
        planner=planner,
        sensor=sensor,
        seed=0,
        go_on=lambda _: next(ticks, None) is not None,
    )


SCENARIOS = [yaml.safe_load(path.read_text()) for path in sorted(CONFIG.glob("*.yaml"))]


def scenario(rng: Rng, directory: Path) -> None:
    """A scenario file with changed values or changed text."""
    path = directory / "scenario.yaml"
    if rng.integers(3):
        text = _yaml(changed_data(rng, pick(rng, SCENARIOS)))
    else:
        text = changed_bytes(rng, _yaml(pick(rng, SCENARIOS)))
    path.write_bytes(text)
    method = Method(pick(rng, ["paper", "predictive"]))
    params = (
        preset(PlannerParams(method=method)) if method is Method.PREDICTIVE else PlannerParams()
    )
    loaded, params = with_perception(load_scenario(str(path)), params)
    _drive(loaded, params, SensorParams())


def world_map(rng: Rng, directory: Path) -> None:
    """A scenario on a Nav2 map whose file or image is changed."""
    cells = np.full((40, 60), 254, dtype=np.uint8)
    cells[:: int(rng.integers(2, 30))] = 0
    cells[18:22, 2:58] = 254
    image = directory / f"map.{pick(rng, ['pgm', 'png'])}"
    Image.fromarray(cells).save(image)
    content: Any = {
        "image": image.name, "resolution": 0.1, "origin": [-1.0, -2.0, 0.0], "negate": 0,
        "occupied_thresh": 0.65, "free_thresh": 0.25, "mode": "trinary",
    }  # fmt: skip
    if rng.integers(2):
        content = changed_data(rng, content)
    else:
        image.write_bytes(changed_bytes(rng, image.read_bytes()))
    (directory / "map.yaml").write_bytes(_yaml(content))
    place = {"name": "map", "start_m": [0.0, 0.0], "goal_m": [4.0, 0.0], "map": "map.yaml"}
    (directory / "scenario.yaml").write_bytes(_yaml(place))
    params = preset(PlannerParams(method=Method.PREDICTIVE))
    _drive(
        *with_perception(load_scenario(str(directory / "scenario.yaml")), params), SensorParams()
    )


_WORLD = {
    "scenarios": [
        {
            "robots": [{"start": [0, 0, 0], "goal": [4, 0, 0]}],
            "obstacles": {"dynamic": [{"pos": [2, 1, 0], "waypoints": [[2, 1, 0], [2, -1, 0]]}]},
        }
    ]
}


def importing(rng: Rng, directory: Path) -> None:
    """A file of another simulator, to import."""
    data = changed_data(rng, _WORLD)
    path = directory / f"a.{pick(rng, ['json', 'yaml', 'world', 'csv'])}"
    text = json.dumps(data).encode()
    path.write_bytes(text if rng.integers(2) else changed_bytes(rng, text))
    for result in import_files([path], ImportOptions()):
        if result.error:
            raise MfbaError(result.error)


_PLANNER = flatten(PlannerParams())
_OPTIONS = _PLANNER | {f"sensor:{key}": value for key, value in flatten(SensorParams()).items()}


def parameters(rng: Rng, _: Path) -> None:
    """Planner and sensor options of any value, as --set gives them."""
    planner, sensor = PlannerParams(), SensorParams()
    changes: dict[str, Any] = {}
    for _k in range(int(rng.integers(1, 4))):
        name = pick(rng, list(_OPTIONS))
        value: Any = pick(rng, VALUES)
        kind = rng.integers(6)
        default = _OPTIONS[name]
        if kind == 0:
            value = float(rng.normal()) * 10.0 ** int(rng.integers(-9, 10))
        elif kind > 1 and isinstance(default, float):  # most often one that may be good
            value = default * float(np.exp(rng.normal() * pick(rng, [0.1, 1.0, 4.0])))
        elif kind > 1 and isinstance(default, int):
            value = int(default + rng.integers(-2, 4))
        changes[name] = value if rng.integers(2) else str(value)
    if rng.integers(2):
        words = ["empty", "--driver", "core"]
        for key, value in changes.items():
            name = key.replace(":", ".") if ":" in key else f"planner.{key}"
            words += ["--set", f"{name}={value}"]
        request = read_request(words, "mfba")
        planner, sensor = request.config.planner, request.config.sensor
    else:
        planner = override(planner, {k: v for k, v in changes.items() if k in _PLANNER})
        of_sensor = {k[7:]: v for k, v in changes.items() if k not in _PLANNER}
        sensor = override(sensor, of_sensor)
    loaded, planner = with_perception(load_scenario("case1"), planner)
    RunConfig(scenario=loaded, planner=planner, sensor=sensor, seed=0)
    if planner.bat.iterations * planner.bat.population <= MOST_BATS:
        _drive(loaded, planner, sensor)


class Bags:
    """A recorded bag, changed record by record."""

    def __init__(self, directory: Path) -> None:
        """Record two short runs in this process."""
        self._bags = []
        for method in ("paper", "predictive"):
            text = json.dumps({
                "name": "short", "start_m": [0.0, 0.0], "goal_m": [1.0, 0.0],
                "obstacles": [{"center_m": [2.0, 0.5], "radius_m": 0.2}],
            })  # fmt: skip
            path = directory / f"{method}.yaml"
            path.write_text(text)
            params = PlannerParams()
            if method == "predictive":
                params = preset(PlannerParams(method=Method.PREDICTIVE))
            loaded, params = with_perception(load_scenario(str(path)), params)
            config = RunConfig(scenario=loaded, planner=params, driver=Driver.IN_PROCESS, seed=0)
            domain, lock = claim_domain()
            with lock:
                run_in_process(config, directory / method, domain_id=domain)
            self._bags.append(directory / method)

    def __call__(self, rng: Rng, directory: Path) -> None:
        """Describe, read, and recover or verify."""
        bag = directory / "bag"
        shutil.copytree(pick(rng, self._bags), bag)
        (mcap,), metadata = bag.glob("*.mcap"), bag / "metadata.yaml"
        if rng.integers(5):
            mcap.write_bytes(changed_mcap(rng, mcap.read_bytes()))
        elif rng.integers(2):
            data = changed_data(rng, yaml.safe_load(metadata.read_text()))
            metadata.write_bytes(_yaml(data))
        else:
            metadata.write_bytes(changed_bytes(rng, metadata.read_bytes()))
        target = pick(rng, [bag, mcap])
        refused = []
        for step in (_describe, read_recording, pick(rng, [_recover, _verify])):
            try:
                step(target)
            except MfbaError as error:
                refused.append(str(error))
        for text in refused:
            if "\n" in text:
                raise MfbaError(text)
        if refused:
            raise MfbaError(refused[0])


def _describe(bag: Path) -> None:
    format_info(describe(bag))


def _recover(bag: Path) -> None:
    recover(bag, bag.parent / "recovered")


def _verify(bag: Path) -> None:
    verify_each(bag)
