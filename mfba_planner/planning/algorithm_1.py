# SPDX-License-Identifier: Apache-2.0
"""Algorithm 1: switch between path generation (bats) and obstacle avoidance (gap vector)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Protocol

from ..core.errors import ConfigError
from ..core.geometry import Point, Pose2D, bearing, distance, towards
from ..core.options import check, option
from ..core.random_streams import stream
from ..perception.sensory_vector import Bits, Ranges, Scan, sensory_vector
from ..swarm.bat_swarm import BatParams, BatSwarm, Disc, Vector
from .gap_vector import GapHeading, gap_heading, gap_vector, nearest_free_gap
from .method_params import Method, SeenParams
from .odometry_jump import JumpWatch, explained
from .path_generation import Start, Step, fresh_step, fresh_steps
from .recovery import RecoveryParams
from .speed_limit import CautionParams

NANO = 1e-9
FEW = 8  # bats of so few planners are no quicker at once


class Mode(Enum):
    """What the planner is doing."""

    IDLE = "idle"
    PATH_GENERATION = "path_generation"
    OBSTACLE_AVOIDANCE = "obstacle_avoidance"
    BLOCKED = "blocked"
    STOPPED = "stopped"
    ARRIVED = "arrived"


class Event(Enum):
    """What the planner has just learned; one event per tick."""

    NO_GOAL = "no_goal"
    NEW_GOAL = "new_goal"
    INVALID = "invalid"
    STALE = "stale"
    AT_GOAL = "at_goal"
    CLEAR = "clear"
    OBSTACLE = "obstacle"
    NO_GAP = "no_gap"


_NEXT = {
    Event.NO_GOAL: Mode.IDLE,
    Event.NEW_GOAL: Mode.IDLE,
    Event.INVALID: Mode.STOPPED,
    Event.STALE: Mode.STOPPED,
    Event.AT_GOAL: Mode.ARRIVED,
    Event.CLEAR: Mode.PATH_GENERATION,
    Event.OBSTACLE: Mode.OBSTACLE_AVOIDANCE,
    Event.NO_GAP: Mode.BLOCKED,
}


def transition(mode: Mode, event: Event) -> Mode:
    """Next mode: Algorithm 1 has no memory, except that it ends on arrival.

    Once ARRIVED, only a new (or withdrawn) goal leads out: the while loop is over.
    """
    if mode is Mode.ARRIVED and event not in (Event.NEW_GOAL, Event.NO_GOAL):
        return Mode.ARRIVED
    return _NEXT[event]


class Swarm(Enum):
    """Fresh bats in the step's disc at every step, or one swarm that lives over the trip."""

    FRESH = "fresh"
    PERSISTENT = "persistent"


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerParams(SeenParams):
    """The reading `section6` of Algorithm 1 and section 6.2."""

    speed_mps: float = option(0.785, "robot speed", unit="m/s", minimum=0.01, maximum=100.0)
    step_length_m: float = option(
        0.3, "longest goal step, in both modes", unit="m", minimum=0.001, maximum=100.0
    )
    goal_tolerance_m: float = option(
        0.02, "distance at which the goal counts as reached", unit="m", minimum=1e-6, maximum=10.0
    )
    input_timeout_s: float = option(
        1.0, "age at which odometry or sectors are stale", unit="s", minimum=0.001, maximum=3600.0
    )
    gap_heading: GapHeading = option(GapHeading.BOUNDARY, "where a gap leads, in its two sectors")
    swarm: Swarm = option(Swarm.FRESH, "fresh bats per step, or one persistent swarm (Fig. 1)")
    bat: BatParams = field(default_factory=BatParams)
    caution: CautionParams = field(default_factory=CautionParams)
    recovery: RecoveryParams = field(default_factory=RecoveryParams)

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)

    @property
    def label(self) -> str:
        """Who decides, for people: the law of beta in Algorithm 1, or the other method."""
        paper = self.method is Method.PAPER
        return self.bat.algorithm.value if paper else self.method.value

    @property
    def tick_ns(self) -> int:
        """Duration of one decision, step length / speed, in whole nanoseconds."""
        return round(self.step_length_m / self.speed_mps / NANO)


@dataclass(frozen=True, slots=True, kw_only=True)
class Circle:
    """An obstacle as a planner may know it, enlarged by the robot: m and m/s in the odom frame."""

    center_m: Point
    radius_m: float
    velocity_mps: Point = (0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Observation:
    """What the planner knows at one tick; now_ns - stamp_ns is the age of the inputs.

    The paper's planner reads the sectors alone. circles (what is within SR) and scan (real
    surfaces, in a frame aligned with odom) are for planners that want more than bits; where
    they are older than the pose, sensed says since when and from where.
    """

    stamp_ns: int
    pose: Pose2D
    ranges_m: Ranges
    goal: Point | None
    now_ns: int
    refused: str = ""
    circles: tuple[Circle, ...] | None = None
    scan: Scan | None = None
    sensed: tuple[int, Pose2D] | None = None


Refused = str  # an input that was refused travels as its reason


def observe(
    stamp_ns: int,
    pose: Pose2D | Refused,
    ranges_m: Ranges | Refused,
    goal: Point | None,
    last_pose: Pose2D,
    age_ns: int = 0,
) -> Observation:
    """Join what was read into an Observation; last_pose stands in for a pose that was refused."""
    refused = ""
    if isinstance(ranges_m, str):
        refused, ranges_m = ranges_m, ()
    if isinstance(pose, str):
        refused, pose = pose, last_pose
    return Observation(
        stamp_ns=stamp_ns,
        pose=pose,
        ranges_m=ranges_m,
        goal=goal,
        now_ns=stamp_ns + age_ns,
        refused=refused,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """One answer of the planner and why; gap counts from 1, 0 is none; lengths in metres."""

    stamp_ns: int
    mode: Mode
    reason: str
    pose: Pose2D
    goal: Point | None
    ranges_m: Ranges
    vs: Bits
    vg: Bits
    gap: int
    waypoint: Point
    velocity: Point
    candidates: tuple[Point, ...] = ()


class PathPlanner(Protocol):
    """What may drive the robot: one Observation in, one Decision out; it may remember."""

    def plan(self, obs: Observation) -> Decision:
        """Answer one observation; called once per tick, stamps rising."""
        ...


Generate = Callable[[Point, Point], Step]


def decide(obs: Observation, mode: Mode, params: PlannerParams, generate: Generate) -> Decision:
    """One turn of Algorithm 1's loop: a pure function of its arguments.

    generate(position, goal) returns the bats' next point and all their candidates; it is
    called in path generation only. Standing still is the answer to everything that is not
    path generation or obstacle avoidance, input that is not finite included.
    """
    vs = sensory_vector(obs.ranges_m)
    vg = gap_vector(vs)
    position = obs.pose.position
    event, reason, gap = _assess(obs, vs, vg, params)
    mode = transition(mode, event)
    if mode is Mode.ARRIVED and event is not Event.AT_GOAL:
        reason, gap = f"goal was reached before; {reason}", 0
    waypoint = position
    velocity = (0.0, 0.0)  # not a difference: inf - inf is NaN
    candidates: tuple[Point, ...] = ()
    if mode is Mode.PATH_GENERATION:
        assert obs.goal is not None
        waypoint, candidates = generate(position, obs.goal)
    elif mode is Mode.OBSTACLE_AVOIDANCE:
        assert obs.goal is not None
        length = min(params.step_length_m, distance(position, obs.goal))
        waypoint = towards(position, gap_heading(gap, len(vg), params.gap_heading), length)
    if waypoint is not position:
        dt = params.tick_ns * NANO
        velocity = ((waypoint[0] - position[0]) / dt, (waypoint[1] - position[1]) / dt)
    return Decision(
        stamp_ns=obs.stamp_ns,
        mode=mode,
        reason=reason,
        pose=obs.pose,
        goal=obs.goal,
        ranges_m=obs.ranges_m,
        vs=vs,
        vg=vg,
        gap=gap,
        waypoint=waypoint,
        velocity=velocity,
        candidates=candidates,
    )


def _assess(obs: Observation, vs: Bits, vg: Bits, params: PlannerParams) -> tuple[Event, str, int]:
    """Reduce an observation to one event, its reason and the chosen gap (0 when none)."""
    standing = reason_to_stand(obs, params)
    if standing:
        return *standing, 0
    assert obs.goal is not None
    position = obs.pose.position
    if not any(vs):
        return Event.CLEAR, "no obstacle within SR", 0
    sensed = "+".join(str(i) for i, bit in enumerate(vs, start=1) if bit)
    gap = nearest_free_gap(vg, bearing(position, obs.goal), params.gap_heading)
    if gap is None:
        return Event.NO_GAP, f"sectors {sensed} set: every gap is closed", 0
    return Event.OBSTACLE, f"sectors {sensed} set: gap {gap} is nearest to the goal", gap


def reason_to_stand(
    obs: Observation, params: PlannerParams, *, sectors: bool = True
) -> tuple[Event, str] | None:
    """What keeps any planner from moving, with its reason; sectors=False: it reads none."""
    refused = obs.refused or _fault(obs, sectors)
    if refused:
        return Event.INVALID, f"refused input: {refused}"
    age_s = (obs.now_ns - obs.stamp_ns) * NANO
    if age_s > params.input_timeout_s:
        return Event.STALE, f"input is {age_s:.3f} s old"
    if obs.goal is None:
        return Event.NO_GOAL, "no goal given"
    if distance(obs.pose.position, obs.goal) <= params.goal_tolerance_m:
        return Event.AT_GOAL, "goal reached"
    return None


def _fault(obs: Observation, sectors: bool) -> str:
    """What must never move a robot, "" for nothing; the last of the doors."""
    pose, goal, ranges = obs.pose, obs.goal or (0.0, 0.0), obs.ranges_m
    total, ring = sum(pose) + sum(goal), sum(ranges)
    finite = total - total == 0.0 and ring == ring  # or a sum has overflowed
    if finite and obs.stamp_ns >= 0 and (len(ranges) > 2 or not sectors):
        return ""  # the usual case, found in one go
    for name, numbers in (("pose", obs.pose), ("goal", obs.goal or ())):
        if not all(map(math.isfinite, numbers)):
            return f"{name} {tuple(numbers)} is not finite"
    if sectors and len(obs.ranges_m) < 3:
        return f"{len(obs.ranges_m)} sectors are fewer than 3"
    if any(map(math.isnan, obs.ranges_m)):
        return "a sector's range is NaN"
    if obs.stamp_ns < 0:
        return f"stamp {obs.stamp_ns} ns is negative"
    return ""


class Planner:
    """Algorithm 1 with its memory: the mode, and the swarm where a reading keeps one.

    The random stream of a decision depends on (seed, stamp) only, so a planner that is
    restarted, or fed from a recording, decides as the first one did (fresh swarms).
    """

    def __init__(self, params: PlannerParams, seed: int) -> None:
        """Start idle; ConfigError for a negative seed."""
        if seed < 0:
            raise ConfigError(f"seed={seed}: negative; give a whole number from 0 up")
        self.params = params
        self.seed = seed
        self.mode = Mode.IDLE
        self._goal: Point | None = None
        self._swarm: BatSwarm | None = None
        self._stamp_ns = 0
        self._watch = JumpWatch()
        self._foreseen: tuple[tuple[Start, PlannerParams], Step] | None = None

    def reset(self) -> None:
        """Forget everything but parameters and seed (a jump of time, a new trip)."""
        self.mode, self._goal, self._swarm = Mode.IDLE, None, None

    def plan(self, obs: Observation) -> Decision:
        """Answer one observation and remember the mode; who was carried off begins anew."""
        carried = self._watch.noticed(obs, self.params, self.mode)
        if carried:
            self.reset()
        if obs.goal != self._goal:
            self.mode = transition(self.mode, Event.NEW_GOAL)
            self._goal, self._swarm = obs.goal, None
        self._stamp_ns = obs.stamp_ns
        decision = decide(obs, self.mode, self.params, self._generate)
        self.mode = decision.mode
        return explained(decision, carried)

    def _generate(self, position: Point, goal: Point) -> Step:
        params = self.params
        if params.swarm is Swarm.PERSISTENT:
            return self._fly_on(position, goal)
        start = Start(position, goal, self.seed, self._stamp_ns)
        foreseen, self._foreseen = self._foreseen, None
        if foreseen is not None and foreseen[0] == (start, params):
            return foreseen[1]
        return fresh_step(start, params.step_length_m, params.bat)

    def start(self, obs: Observation) -> Start | None:
        """What fresh_step() will be asked for by plan(), None where it will not be."""
        if self.params.swarm is not Swarm.FRESH or obs.goal is None or obs.refused:
            return None
        if any(sensory_vector(obs.ranges_m)):
            return None
        return Start(obs.pose.position, obs.goal, self.seed, obs.stamp_ns)

    def foresee(self, start: Start, params: PlannerParams, step: Step) -> None:
        """Take what fresh_steps() found; plan() uses it if it is just what it would ask for."""
        self._foreseen = (start, params), step

    def _fly_on(self, position: Point, goal: Point) -> Step:
        """Fig. 1 read literally: bat.iterations per robot step, within the robot's reach.

        The bats stay where they are in the world, but are drawn into the disc of one step
        around the robot, as is the best point they ever saw; the robot goes to that point.
        T of eq. 10 spans the trip: all iterations of the straight way from here to the goal.
        """
        reach = self.params.step_length_m
        if distance(position, goal) <= reach:
            return goal, ()
        disc, bat = Disc(reach, position), self.params.bat

        def cost(x: Vector) -> float:
            return distance((x[0], x[1]), goal)

        if self._swarm is None:
            horizon = bat.iterations * math.ceil(distance(position, goal) / reach)
            rng = stream(self.seed, self._stamp_ns)
            self._swarm = BatSwarm(bat, disc, rng, horizon)
        else:
            self._swarm.resettle(disc, cost)
        for _ in range(bat.iterations):
            self._swarm.tell([cost(x) for x in self._swarm.ask()])
        x, y = disc.clamp(self._swarm.best_x)
        return (x, y), tuple((px, py) for px, py in self._swarm.candidates)


def fly_together(planners: Sequence[Planner], observations: Sequence[Observation]) -> None:
    """Let the bats of all that are about to generate a path fly at once, before they plan().

    Their decisions stay the same to the last bit. Who has other params than the first flies
    alone later, as do few: arrays cost more than they spare then.
    """
    about = [(planner, planner.start(obs)) for planner, obs in zip(planners, observations)]
    starting = [(planner, start) for planner, start in about if start is not None]
    if len(starting) < FEW:
        return
    params = starting[0][0].params
    starts = [start for _, start in starting]
    steps = fresh_steps(starts, params.step_length_m, params.bat)
    for (planner, start), step in zip(starting, steps):
        planner.foresee(start, params, step)
