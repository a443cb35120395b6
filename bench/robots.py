# SPDX-License-Identifier: Apache-2.0
"""How often robots of another kind reach the goal: differential drive, lidar, noise.

Run: python bench/robots.py [--worlds N] [--first K] [--suite NAME]. Success is: goal reached, no
contact; contacts are looked for along every arc of 10 ms, not only between ticks, and where the
robot really was. World k is driven with seed k. The preset was chosen on worlds 20 to 39 of
random-20.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

from mfba_planner.core.planner_types import NANO
from mfba_planner.core.robot_base import Drive
from mfba_planner.evaluation.statistics import share_interval
from mfba_planner.evaluation.suites.named_suites import suite
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.differential_drive import SUBTICK_NS, Speeds, apply_command, command
from mfba_planner.planning.planner_params import Method, PerceptionInput, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.contact import step_clearances
from mfba_planner.simulation.episode import Episode, Outcome
from mfba_planner.simulation.robot_model import Lidar, Noise, Robot
from mfba_planner.simulation.run_episode import simulate
from mfba_planner.simulation.scenario import Scenario

CASES = ("case1", "case2")
TRACKING = replace(preset(), method=Method.PREDICTIVE)
SECTORS = replace(TRACKING, perception=PerceptionInput.SECTORS)
TURNING = Robot(drive=Drive.DIFFERENTIAL, lidar=Lidar(beams=360))


def erring(tolerance_m: float = 0.1, **noise: float) -> tuple[Robot, PlannerParams]:
    """The robot with noise; the goal is reached a little farther off."""
    params = replace(TRACKING, goal_tolerance_m=tolerance_m)
    return replace(TURNING, noise=Noise(**noise)), params


ROWS: dict[str, tuple[Robot, PlannerParams]] = {
    "omnidirectional, sectors": (Robot(), SECTORS),
    "differential, 360 beams, paper": (TURNING, PlannerParams()),
    "differential, 360 beams, sectors": (TURNING, SECTORS),
    "differential, 360 beams, tracked": (TURNING, TRACKING),
    "  720 beams": (replace(TURNING, lidar=Lidar(beams=720)), TRACKING),
    "  1080 beams": (replace(TURNING, lidar=Lidar(beams=1080)), TRACKING),
    "  never in reverse": (replace(TURNING, reverse=False), TRACKING),
    "  scan 1 cm, odometry 1 cm, 0.01 rad": erring(scan_m=0.01, odom_m=0.01, odom_rad=0.01),
    "  scan 3 cm, odometry 3 cm, 0.03 rad": erring(scan_m=0.03, odom_m=0.03, odom_rad=0.03),
    "  a beam in five, a scan in 50 lost": erring(scan_dropout=0.2, scan_loss=0.02),
    "  odometry in ten lost": erring(odom_loss=0.1),
    "  scan 0.1 s late": erring(scan_latency_s=0.1),
    "  scan and odometry 0.1 s late": erring(scan_latency_s=0.1, odom_latency_s=0.1),
    "  all of 1 cm, losses, 0.1 s": erring(
        scan_m=0.01, odom_m=0.01, odom_rad=0.01, scan_dropout=0.2, scan_loss=0.02,
        odom_loss=0.1, scan_latency_s=0.1, odom_latency_s=0.1,
    ),
}  # fmt: skip


def clearance(episode: Episode) -> float:
    """The smallest gap (m) along the arcs driven; along lines for robots that do not turn."""
    scenario, tick_ns = episode.scenario, episode.planner.tick_ns
    base, least, speeds = scenario.robot, float("inf"), Speeds()
    poses = episode.truth or tuple(tick.pose for tick in episode.ticks)
    count = max(1, -(-tick_ns // SUBTICK_NS)) if base.turns else 1
    for tick, pose, end in zip(episode.ticks, poses, poses[1:]):
        t_s, now = episode.time_s(tick.stamp_ns), pose
        commanded = command(tick, base, tick_ns)
        for k in range(count):
            a_s, b_s = (t_s + tick_ns * NANO * (k + j) / count for j in (0, 1))
            if base.turns:
                after, speeds = apply_command(now, speeds, commanded, base, tick_ns // count)
            else:
                after = end
            gaps = step_clearances(scenario, a_s, b_s, now.position, after.position)
            least, now = min([least, *gaps]), after
    return least


def drive(scenario: Scenario, params: PlannerParams, seed: int) -> tuple[bool, Outcome, float]:
    """Whether it succeeded, how it ended and how near it came."""
    episode = simulate(scenario, planner=params, sensor=SensorParams(), seed=seed)
    gap = clearance(episode)
    return episode.outcome is Outcome.GOAL_REACHED and gap >= -1e-9, episode.outcome, gap


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--worlds", type=int, default=50)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--suite", default="random-10")
    parser.add_argument("--only", default="", help="rows whose name holds this")
    found = parser.parse_args()
    worlds = [(load_scenario(name), k) for k, name in enumerate(CASES)]
    numbers = range(found.first, found.first + found.worlds)
    worlds += [(suite(found.suite).world(k), k) for k in numbers]
    print(f"{len(CASES)} cases, {found.suite} {numbers.start} to {numbers.stop - 1}")
    for name, (robot, params) in ROWS.items():
        if found.only not in name:
            continue
        ends = [drive(replace(world, robot=robot), params, seed) for world, seed in worlds]
        good = sum(success for success, _, _ in ends)
        cases = sum(success for success, _, _ in ends[: len(CASES)])
        touched = sum(gap < -1e-9 for _, _, gap in ends)
        late = sum(outcome is not Outcome.GOAL_REACHED for _, outcome, _ in ends)
        low, high = share_interval(good, len(ends))
        print(
            f"{name:36} {good:4} of {len(ends)} (cases {cases} of 2; 95 %: {low:.3f} to "
            f"{high:.3f}); {touched} with contact, {late} not at the goal; "
            f"nearest {min(gap for _, _, gap in ends):.3f} m",
            flush=True,
        )


if __name__ == "__main__":
    main()
