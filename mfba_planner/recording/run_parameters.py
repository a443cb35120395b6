# SPDX-License-Identifier: Apache-2.0
"""Read the setup of a run from a bag's configuration: scenario, parameters, seed, by robot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from ..core.errors import BagError, ConfigError, InputError
from ..core.geometry import Pose2D
from ..perception.no_return import NoReturn
from ..perception.sensory_vector import SensorParams
from ..planning.planner_params import PlannerParams
from ..scenarios.scenario_files import load_scenario
from ..simulation.fleet import scenarios_with_others
from ..simulation.scenario import Scenario
from ..simulation.triggers import after_triggers
from .bag_reader import BagReader
from .configuration_attachment import read_configuration
from .fleet_topics import NO_NAMESPACE
from .robot_recordings import robot_setups
from .run_setup import Setup, node_options
from .true_poses import recorded_moments

WORLD_SIM = "world_sim"


Nodes = Mapping[str, Mapping[str, Any]]  # parameters by node


class Setups(NamedTuple):
    """The scenario as configured, its seed, and a Setup by robot in the scenario's sequence."""

    scenario: Scenario
    seed: int
    by_robot: dict[str, Setup]


def read_setups(reader: BagReader, given: Nodes | None = None) -> Setups:
    """Read and check the setups in a bag's configuration, or those given. Raises BagError.

    Without world_sim they are those of real robots: the scenario is the trip that was recorded.
    """
    configuration = read_configuration(reader) if given is None else {"nodes": given}
    nodes: Any = configuration.get("nodes", {})
    facts: Any = configuration.get("run", {})
    try:
        above = _namespace_of_world(nodes)
        if above is None:
            setups = robot_setups(reader, nodes, facts)
            first = next(iter(setups.values()))
            return Setups(first.scenario, first.seed, setups)
        world = nodes[above + WORLD_SIM]
        facts = configuration["run"]
        scenario = load_scenario(world["scenario_json"])
        names = scenario.robot_names
        starts = [[Pose2D(*member.start_m)] for member in scenario.robots]
        run = after_triggers(scenario, recorded_moments(reader, names, world["tick_ns"]))
        worlds = scenarios_with_others(run, starts, world["tick_ns"]) if names else [run]
        setups = {}
        for member, robot_scenario in zip(names or (NO_NAMESPACE,), worlds):
            name = f"{above}{member}".strip("/")
            prefix = f"{name}/" if name else ""
            planner, sensor = (nodes[prefix + node] for node in ("planner", "virtual_sensor"))
            setups[name] = Setup(
                scenario=robot_scenario,
                sensor=node_options(SensorParams(), sensor),
                planner=node_options(PlannerParams(), planner),
                seed=planner["seed"],
                driver=facts.get("driver", "by hand"),
                lockstep=bool(planner["lockstep"]),
                odom_frame=planner.get("odom_frame", ""),
                scan_frame=sensor.get("scan_frame", ""),
                scan_no_return=NoReturn(sensor.get("scan_no_return", NoReturn.INF.value)),
            )
        single = setups.get(NO_NAMESPACE)
        return Setups(scenario, single.seed if single else world["seed"], setups)
    except (ConfigError, InputError) as error:
        raise BagError(f"{reader.path}: {error}") from None
    except KeyError as error:
        raise BagError(
            f"{reader.path}: its configuration lacks {error}; record with `mfba run`"
        ) from None


def _namespace_of_world(nodes: Nodes) -> str | None:
    """The namespace of world_sim, as "" or "NAME/"; None without it."""
    ends = (name.strip("/").rpartition(WORLD_SIM) for name in nodes)
    spaces = [above for above, node, below in ends if node and not below]
    return next((above for above in spaces if not above or above.endswith("/")), None)


def read_setup(reader: BagReader) -> Setup:
    """The Setup of a bag of one robot; BagError for a fleet's bag."""
    setups = read_setups(reader).by_robot
    if NO_NAMESPACE not in setups:
        raise BagError(
            f"{reader.path}: holds {len(setups)} robots, but this reads a bag of one; use "
            "mfba_planner.recording.read_episode.read_recording"
        )
    return setups[NO_NAMESPACE]
