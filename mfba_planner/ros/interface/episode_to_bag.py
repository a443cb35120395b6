# SPDX-License-Identifier: Apache-2.0
"""Writes a core driver's run as the bag that the graph would have recorded."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from rclpy.serialization import serialize_message

from ...core.planner_types import Decision, Scan
from ...perception.sense_segments import sense_circles_and_segments
from ...perception.sensory_vector import sensory_vector
from ...planning.planner_params import Method
from ...recording.bag_writer import BagWriter
from ...recording.configuration_attachment import attach_configuration
from ...scenarios.run_config import Driver, RunConfig, node_parameters, run_facts
from ...scenarios.scenario_json import scenario_to_json
from ...simulation.episode import Episode, Outcome
from ...simulation.world import World
from . import to_messages, topics
from .qos_conversion import offered
from .serialized_message import type_name

_FRAME, _BASE, _SCAN_FRAME = "odom", "base_link", "base_scan"
_TOPICS = (
    topics.CLOCK, topics.ODOM, topics.OBSTACLES, topics.SCAN, topics.SECTORS,
    topics.SENSORY_VECTOR, topics.GOAL_POSE, topics.GOAL_STEP, topics.PLAN, topics.CMD_VEL,
    topics.DECISION, topics.OUTCOME,
)  # fmt: skip


def write_episode_bag(episode: Episode, directory: Path, facts: Mapping[str, Any] = {}) -> None:
    """Write a bag with every tick's messages; facts are added to the run's configuration.

    Where a planner read no sectors, the bag holds those that the sensor would have measured. Of a
    robot with a lidar it holds the scans, measured again: the noise depends on seed and stamp.
    Raises OutputError where nothing can be written; an incomplete bag is deleted.
    """
    planner = episode.planner
    if episode.planner_name == Method.PREDICTIVE.value:  # a sweep selects planners by name
        planner = replace(planner, method=Method.PREDICTIVE)
    elif not planner.reads_known_map:  # as a planner of a sweep that takes no map
        planner = replace(planner, known_map=False)
    config = RunConfig(
        scenario=episode.scenario,
        planner=planner,
        sensor=episode.sensor,
        seed=episode.seed,
        driver=Driver.CORE,
    )
    nodes = node_parameters(config, ())
    nodes["world_sim"]["scenario_json"] = scenario_to_json(episode.scenario)
    writer = BagWriter(directory)
    try:
        for topic in _TOPICS:
            writer.add_topic(_name(topic), type_name(topic.type), offered(topic.qos))
        attach_configuration(writer, {"nodes": nodes, "run": {**run_facts(config), **facts}})
        for stamp_ns, topic, message in _messages(episode):
            writer.write(_name(topic), serialize_message(message), stamp_ns, stamp_ns)
        writer.close()
    except BaseException:
        writer.discard()
        raise


def _name(topic: topics.Topic) -> str:
    return f"/{topic.name.lstrip('/')}"


def _messages(episode: Episode) -> Iterator[tuple[int, topics.Topic, Any]]:
    """All messages of the run, first to last: (stamp, topic, message)."""
    if not episode.ticks:
        return
    first, last = episode.ticks[0].stamp_ns, episode.ticks[-1].stamp_ns
    goal = to_messages.pose_stamped_msg(episode.scenario.goal_m, first, _FRAME)
    yield first, topics.GOAL_POSE, goal
    yield first, topics.OUTCOME, to_messages.outcome_msg(None, 0)
    velocity = (0.0, 0.0)
    for tick, scan in zip(episode.ticks, _scans(episode)):
        for topic, message in _tick_messages(episode, tick, velocity):
            yield tick.stamp_ns, topic, message
        if scan is not None:
            yield (
                tick.stamp_ns,
                topics.SCAN,
                to_messages.scan_msg(scan, tick.stamp_ns, _SCAN_FRAME),
            )
        velocity = tick.velocity
    if episode.outcome is not Outcome.INTERRUPTED:
        yield last, topics.OUTCOME, to_messages.outcome_msg(episode.outcome, len(episode.ticks))


def _scans(episode: Episode) -> Iterator[Scan | None]:
    """The scan of every tick, None without a lidar."""
    params = episode.planner
    world = World(episode.scenario, params.tick_ns, params.goal_tolerance_m, episode.seed)
    for number, tick in enumerate(episode.ticks):
        pose = episode.truth[number] if episode.truth else tick.pose
        if number:
            world.follow(pose)
        else:
            world.pose = pose
        yield world.read().scan


def _tick_messages(
    episode: Episode, tick: Decision, velocity: tuple[float, float]
) -> Iterator[tuple[topics.Topic, Any]]:
    """The messages of world, sensor and planner; velocity is that of the previous tick."""
    scenario, stamp, time_s = episode.scenario, tick.stamp_ns, episode.time_s(tick.stamp_ns)
    circles = [circle for circle in scenario.enlarged(time_s) if not math.isnan(circle[0][0])]
    ranges = tick.ranges_m or sense_circles_and_segments(
        tick.pose.position, circles, scenario.segments, scenario.robot_radius_m, episode.sensor
    )
    yield topics.CLOCK, to_messages.clock_msg(stamp)
    yield topics.OBSTACLES, to_messages.obstacles_msg([c for c, _ in circles], stamp, _FRAME)
    yield topics.ODOM, to_messages.odometry_msg(tick.pose, velocity, stamp, _FRAME, _BASE)
    yield (
        topics.SECTORS,
        to_messages.sectors_msg(ranges, episode.sensor, scenario.robot_radius_m, stamp, _FRAME),
    )
    yield topics.SENSORY_VECTOR, to_messages.sensory_vector_msg(sensory_vector(ranges))
    yield topics.PLAN, to_messages.plan_msg(tick, _FRAME)
    decision = to_messages.decision_msg(tick, episode.label, 0, f"/{topics.PLANNER}")
    yield topics.DECISION, decision
    yield topics.GOAL_STEP, to_messages.pose_stamped_msg(tick.waypoint, stamp, _FRAME)
    yield topics.CMD_VEL, to_messages.twist_msg(tick, scenario.robot, episode.planner.tick_ns)
