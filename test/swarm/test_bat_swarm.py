# SPDX-License-Identifier: Apache-2.0
"""BatSwarm: eq. 3-10 by hand, all readings against a second implementation, properties."""

import functools
import itertools
import math
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from any_bat_params import ANY_READING, OURS, READINGS
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.core.errors import ConfigError, InputError
from mfba_planner.swarm import bat_swarm
from mfba_planner.swarm.bat_swarm import (
    Acceptance,
    Algorithm,
    BatParams,
    BatSwarm,
    Bounds,
    Box,
    Disc,
    Epsilon,
    Initial,
    Region,
    Schedule,
    Step,
    Update,
    Vector,
    Velocity,
    Walk,
    minimize,
)
from mfba_planner.swarm.swarm_iteration import BatMotion

Values = list[float]
BOX = Box((-1.0, 10.0), (3.0, 12.0))
NO_WALK = {"r0": 1.0}  # rand > 1 never holds: no local walk
ALWAYS_WALK = {"r0": 0.0}  # rand > 0 always holds
COORDINATE = st.floats(-100.0, 100.0)
DISCS = st.builds(Disc, st.floats(0.001, 50.0), st.tuples(COORDINATE, COORDINATE))
BOXES = st.lists(st.tuples(COORDINATE, COORDINATE), min_size=1, max_size=4).map(
    lambda sides: Box(*zip(*map(sorted, sides)))  # type: ignore[arg-type]
)
FLAT_BOXES = st.tuples(*[st.tuples(COORDINATE, COORDINATE).map(sorted)] * 2).map(
    lambda sides: Box(*zip(*sides))
)


def generator(seed: int = 7) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(seed))


def params(**changes: Any) -> BatParams:
    """Two bats of plain BA that may leave the box, with changes."""
    plain: dict[str, Any] = {
        "algorithm": Algorithm.BA,
        "population": 2,
        "bounds": Bounds.NONE,
    }
    return BatParams(**{**plain, **changes})


def start(p: BatParams, values: Values, region: Region = BOX) -> tuple[BatSwarm, Any, Any]:
    """A swarm after its first tell, its first positions, and the same stream at that point."""
    swarm, rng = BatSwarm(p, region, generator()), generator()
    x = np.array(swarm.ask())
    rng.random(x.size)
    swarm.tell(values)
    return swarm, x, rng


def sphere(x: Vector) -> float:
    return sum((v - 0.1) ** 2 for v in x)


# --- the equations, one by one --------------------------------------------------------------


def test_eq_3_lands_inside_the_box() -> None:
    x = BatSwarm(params(), BOX, generator()).ask()
    u = generator().random((2, 2))
    assert x == [[-1.0 + u[i, 0] * 4.0, 10.0 + u[i, 1] * 2.0] for i in (0, 1)]


def test_eq_3_as_printed_lands_outside() -> None:
    x = BatSwarm(params(initial=Initial.AS_PRINTED), BOX, generator()).ask()
    u = generator().random((2, 2))
    assert x == [[-1.0 - u[i, 0] * 4.0, 10.0 - u[i, 1] * 2.0] for i in (0, 1)]


def test_eq_4_5_6_towards_the_best() -> None:
    p = params(f_min=0.5, f_max=2.5, **NO_WALK)
    swarm, x, rng = start(p, [3.0, 1.0])
    u = rng.random((2, 5))
    f = 0.5 + 2.0 * u[:, 0]
    v = (x[1] - x) * f[:, None]
    assert np.array(swarm.ask()) == pytest.approx(x + v, rel=1e-12)
    assert swarm.ask()[1] == x[1].tolist(), "the best bat does not move"


def test_eq_5_as_printed_moves_away_from_the_best() -> None:
    p = params(f_min=0.5, f_max=2.5, velocity=Velocity.AS_PRINTED, **NO_WALK)
    swarm, x, rng = start(p, [3.0, 1.0])
    f = 0.5 + 2.0 * rng.random((2, 5))[:, 0]
    assert np.array(swarm.ask()) == pytest.approx(x + (x - x[1]) * f[:, None], rel=1e-12)


def test_eq_5_adds_to_the_velocity_of_the_iteration_before() -> None:
    swarm, x, rng = start(params(**NO_WALK), [3.0, 1.0])
    swarm.ask()
    swarm.tell([9.0, 9.0])  # refused: positions stay, velocities change
    f = 10.0 * np.array([rng.random((2, 5))[:, 0], rng.random((2, 5))[:, 0]])
    v = (x[1] - x) * (f[0] + f[1])[:, None]
    assert np.array(swarm.ask()) == pytest.approx(x + v, rel=1e-9)


def test_eq_7_walks_around_the_best_with_an_epsilon_per_coordinate() -> None:
    swarm, x, rng = start(params(sigma=0.25, a0=0.8, **ALWAYS_WALK), [3.0, 1.0])
    epsilon = 2.0 * rng.random((2, 5))[:, 3:] - 1.0
    assert np.array(swarm.ask()) == pytest.approx(x[1] + 0.25 * epsilon * 0.8, rel=1e-12)


def test_eq_7_with_one_epsilon_for_all_coordinates() -> None:
    swarm, x, rng = start(params(epsilon=Epsilon.SCALAR, **ALWAYS_WALK), [3.0, 1.0])
    epsilon = 2.0 * rng.random((2, 5))[:, 3] - 1.0
    assert np.array(swarm.ask()) == pytest.approx(x[1] + 0.3 * epsilon[:, None], rel=1e-12)


def test_eq_7_from_the_bat_itself() -> None:
    swarm, x, rng = start(params(walk=Walk.SELF, **ALWAYS_WALK), [3.0, 1.0])
    u = rng.random((2, 5))
    moved = x + (x[1] - x) * 10.0 * u[:, :1]
    assert np.array(swarm.ask()) == pytest.approx(moved + 0.3 * (2.0 * u[:, 3:] - 1.0), rel=1e-12)


def test_eq_7_scales_with_the_mean_loudness_and_eq_8_lowers_it() -> None:
    swarm, _, rng = start(params(alpha=0.5, **ALWAYS_WALK), [3.0, 1.0])
    swarm.ask()
    swarm.tell([9.0, 0.5])  # bat 2 is accepted: its loudness is 0.5 now, the mean 0.75
    best = np.array(swarm.best_x)
    rng.random((2, 5))
    epsilon = 2.0 * rng.random((2, 5))[:, 3:] - 1.0
    # eq. 9 gave bat 2 the rate r0 (...) = 0, so both still walk
    assert np.array(swarm.ask()) == pytest.approx(best + 0.3 * epsilon * 0.75, rel=1e-12)


@pytest.mark.parametrize(("gamma", "t"), [(0.8, 1), (0.8, 3), (0.2, 2)])
def test_eq_9_sets_the_rate_of_an_accepted_bat(gamma: float, t: int) -> None:
    # f = 0 and r = 1 keep both bats where they are, until a lower r lets one walk
    p = params(gamma=gamma, a0=100.0, f_max=0.0, walk=Walk.SELF, **NO_WALK)
    rate = 1.0 - math.exp(-gamma * t)
    outcomes = set()
    for seed in range(50):
        swarm, rng = BatSwarm(p, BOX, generator(seed)), generator(seed)
        x = swarm.ask()
        swarm.tell([3.0, 1.0])
        rng.random(4)
        for k in range(1, t + 1):
            assert swarm.ask() == x
            swarm.tell([3.0 if k == t else 9.0, 9.0])  # bat 1 is accepted in iteration t
            rng.random((2, 5))
        walks = rng.random((2, 5))[0, 1] > rate
        assert (swarm.ask()[0] != x[0]) == walks
        assert swarm.ask()[1] == x[1], "never accepted, so its rate is still r0 = 1"
        outcomes.add(walks)
    assert outcomes == {True, False}


def test_eq_10_with_the_normalized_and_the_raw_t() -> None:
    p = params(algorithm=Algorithm.MFBA, iterations=4, rho=0.5, f_min=1.0, f_max=3.0, **NO_WALK)
    for schedule, scale in ((Schedule.NORMALIZED, 0.25), (Schedule.RAW, 1.0)):
        swarm, x, rng = start(replace(p, schedule=schedule), [3.0, 1.0])
        v = np.zeros((2, 2))
        for t in range(1, 5):
            beta = scale * t * np.exp(-0.5 * rng.random((2, 5))[:, 0])
            v += (x[1] - x) * (1.0 + 2.0 * beta)[:, None]
            assert np.array(swarm.ask()) == pytest.approx(x + v, rel=1e-9)
            swarm.tell([9.0, 9.0])


@given(st.floats(0.0, 1.0), st.floats(0.0, 100.0), st.integers(1, 12))
def test_beta_of_mfba_grows_with_t_and_stays_in_its_interval(
    u: float, rho: float, iterations: int
) -> None:
    p = BatParams(population=2, iterations=iterations, rho=rho)
    swarm = BatSwarm(p, Disc(1.0), generator())
    betas = []
    for _ in range(iterations + 4):
        swarm.ask()
        betas.append(swarm.beta(u))
        swarm.tell([1.0, 2.0])
    assert betas[0] == 0.0, "before the first iteration"
    assert betas[: iterations + 1] == sorted(betas[: iterations + 1])
    assert betas[1] == pytest.approx(math.exp(-rho * u) / iterations)
    assert all(0.0 <= beta <= 1.0 for beta in betas)
    assert betas[iterations:] == [betas[iterations]] * 4, "it stays there beyond T"


def test_beta_of_ba_is_the_draw() -> None:
    assert BatSwarm(params(), BOX, generator()).beta(0.37) == 0.37


def test_beta_of_the_raw_schedule_leaves_the_interval() -> None:
    p = BatParams(schedule=Schedule.RAW, population=2, rho=0.0)
    swarm = BatSwarm(p, Disc(1.0), generator())
    for t in range(8):
        swarm.ask()
        assert swarm.beta(0.5) == t
        swarm.tell([1.0, 2.0])


def test_the_horizon_is_t_of_eq_10_where_given() -> None:
    p = BatParams(population=2, iterations=2, rho=0.0)
    for horizon, expected in ((None, 0.5), (4, 0.25)):
        swarm = BatSwarm(p, Disc(1.0), generator(), horizon)
        swarm.ask()
        swarm.tell([1.0, 2.0])
        swarm.ask()
        assert swarm.beta(0.9) == expected


# --- acceptance -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "moves"), [(2.9, True), (3.0, True), (3.1, False), (math.nan, False)]
)
def test_a_bat_accepts_values_that_are_not_worse_and_no_others(value: float, moves: bool) -> None:
    # f = 1/2 for both; gamma = 100 keeps r at 1, so that no bat walks
    swarm, x, _ = start(params(f_min=0.5, f_max=0.5, gamma=100.0, **NO_WALK), [3.0, 1.0])
    v = (x[1] - x[0]) / 2.0
    assert swarm.ask()[0] == pytest.approx((x[0] + v).tolist())
    swarm.tell([value, 9.0])
    position = x[0] + v if moves else x[0]
    assert swarm.ask()[0] == pytest.approx((position + v + (x[1] - position) / 2.0).tolist())
    assert swarm.best_x == x[1].tolist()


@pytest.mark.parametrize("a0", [0.0, 0.3, 1.0])
def test_a_better_point_is_accepted_with_probability_a(a0: float) -> None:
    accepted = 0
    for seed in range(200):
        p = params(a0=a0, f_min=0.0, f_max=0.0, sigma=1.0, walk=Walk.SELF, **ALWAYS_WALK)
        swarm, rng = BatSwarm(p, BOX, generator(seed)), generator(seed)
        first = [list(x) for x in swarm.ask()]
        swarm.tell([3.0, 1.0])
        rng.random(4)
        u = rng.random((2, 5))
        moved = [list(x) for x in swarm.ask()]
        swarm.tell([2.0, 9.0])
        expected = u[0, 2] < a0
        accepted += expected
        base = moved[0] if expected else first[0]
        loudness = a0 * (0.98 if expected else 1.0)
        scale = (loudness + a0) / 2.0
        epsilon = 2.0 * rng.random((2, 5))[0, 3:] - 1.0
        assert swarm.ask()[0] == pytest.approx((np.array(base) + scale * epsilon).tolist())
    assert accepted == pytest.approx(200 * a0, abs=25)


# --- a second implementation ----------------------------------------------------------------


def reference(
    p: BatParams, region: Region, seed: int, objective: Callable[[Vector], float]
) -> list[Any]:
    """Candidates of every iteration, bat by bat and coordinate by coordinate."""
    rng = generator(seed)
    low, high = (np.array(edge) for edge in region.span())
    n, d = p.population, len(low)
    bound = (lambda x: x) if p.bounds is Bounds.NONE else (lambda x: np.array(region.clamp(x)))
    side = high - low if p.initial is Initial.INSIDE else low - high
    x: list[Any] = [bound(low + row * side) for row in rng.random((n, d))]
    cost = [objective(xi) for xi in x]
    v, a, r = [np.zeros(d) for _ in x], [p.a0] * n, [p.r0] * n
    best = min(zip(cost, range(n)))[1]
    best_x, best_cost = x[best], cost[best]
    history: list[Any] = [list(x)]
    for t in range(1, p.iterations + 1):
        paired = p.step is Step.PAIR
        rows = rng.random((n, 3 + d + 2 * paired))
        loudness = sum(a) / n
        tried = []
        for i, (draw, walk_draw, _, *rest) in enumerate(rows):
            epsilon = rest[:d]
            if p.algorithm is Algorithm.BA:
                beta = draw
            else:
                scaled_t = t / p.iterations if p.schedule is Schedule.NORMALIZED else t
                beta = scaled_t * math.exp(-p.rho * draw)
            f = p.f_min + (p.f_max - p.f_min) * beta
            v[i] = v[i] * p.inertia
            if p.velocity is Velocity.TOWARDS_BEST:
                v[i] = v[i] + f * (best_x - x[i])
            else:
                v[i] = v[i] + f * (x[i] - best_x)
            new: Any = x[i] + v[i]
            if walk_draw > r[i]:
                e = np.array(epsilon if p.epsilon is Epsilon.PER_COORDINATE else epsilon[:1] * d)
                old = best_x if p.walk is Walk.BEST else new
                length: Any = 1.0
                if paired:
                    others = [k % n for k in range(int(rest[-2] * n) + 1, int(rest[-2] * n) + n)]
                    length = x[others[int(rest[-1] * (n - 1))]] - x[int(rest[-2] * n)]
                new = old + p.sigma * (2.0 * e - 1.0) * loudness * length
            tried.append(bound(new))
        limit = {
            Acceptance.OWN: list(cost),
            Acceptance.BEST: [best_cost] * n,
            Acceptance.ANY: [math.inf] * n,
        }[p.acceptance]
        for i, new in enumerate(tried):
            new_cost = objective(new)
            accepted = new_cost <= limit[i] and rows[i][2] < a[i]
            if accepted:
                x[i], cost[i] = new, new_cost
            if accepted or p.update is Update.ALWAYS:
                a[i] *= p.alpha
                r[i] = p.r0 * (1.0 - math.exp(-p.gamma * t))
            if new_cost < best_cost:
                best_x, best_cost = new, new_cost
        history.append(tried)
    return history


@pytest.mark.parametrize("region", [Disc(0.3), Box((-1.0, -2.0, 0.0), (3.0, 1.0, 2.0))], ids=repr)
def test_every_reading_agrees_with_a_second_implementation(region: Region) -> None:
    for combination in itertools.product(*READINGS.values()):
        chosen: dict[str, Any] = dict(zip(READINGS, combination))
        p = BatParams(population=4, iterations=4, f_max=1.5, rho=0.7, a0=0.9, **chosen)
        for seed in (0, 1):
            swarm = BatSwarm(p, region, generator(seed))
            for expected in reference(p, region, seed, sphere):
                candidates = swarm.ask()
                assert np.array(candidates) == pytest.approx(
                    np.array(expected), rel=1e-9, abs=1e-9
                ), (chosen, swarm.t)
                swarm.tell([sphere(x) for x in candidates])


@pytest.mark.parametrize("region", [Disc(0.3), Box((-1.0, -2.0, 0.0), (3.0, 1.0, 2.0))], ids=repr)
@pytest.mark.parametrize("inertia", [0.0, 0.6, 1.0])
def test_our_own_options_agree_with_a_second_implementation(
    region: Region, inertia: float
) -> None:
    draw = generator(3)
    for combination in itertools.product(*OURS.values()):
        chosen: dict[str, Any] = dict(zip(OURS, combination))
        for name, kind in READINGS.items():
            chosen[name] = list(kind)[int(draw.integers(2))]
        p = BatParams(
            population=4, iterations=6, f_max=1.5, a0=0.9, alpha=0.9, inertia=inertia, **chosen
        )
        swarm = BatSwarm(p, region, generator(5))
        for expected in reference(p, region, 5, sphere):
            candidates = swarm.ask()
            assert np.array(candidates) == pytest.approx(np.array(expected), rel=1e-9, abs=1e-9), (
                chosen,
                swarm.t,
            )
            swarm.tell([sphere(x) for x in candidates])


def test_a_pair_step_is_along_the_difference_of_two_bats() -> None:
    p = params(population=6, step=Step.PAIR, epsilon=Epsilon.SCALAR, f_max=0.0, **ALWAYS_WALK)
    swarm, x, _ = start(p, [6.0, 5.0, 4.0, 3.0, 2.0, 1.0])
    gaps = [b - a for a, b in itertools.permutations(x, 2)]
    for candidate in np.array(swarm.ask()):
        step = (candidate - x[-1]) / 0.3
        shares = [step @ gap / (gap @ gap) for gap in gaps]
        fits = [
            np.allclose(step, share * gap) and abs(share) <= 1.0
            for share, gap in zip(shares, gaps)
        ]
        assert any(fits)


# --- the plane, blocks of draws, failures ---------------------------------------------------


@given(ANY_READING, st.one_of(DISCS, FLAT_BOXES), st.integers(0, 2**32))
def test_the_unrolled_plane_equals_the_general_iteration_bit_by_bit(
    p: BatParams, region: Region, seed: int
) -> None:
    fast = minimize(sphere, region, p, generator(seed))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(BatMotion, "_iterate_in_the_plane", BatMotion._iterate_in_d_dimensions)
        slow = minimize(sphere, region, p, generator(seed))
    assert (fast.best_x, fast.best_value) == (slow.best_x, slow.best_value)
    assert fast.candidates == slow.candidates


@given(ANY_READING, st.integers(0, 2**32))
def test_drawing_ahead_changes_nothing(p: BatParams, seed: int) -> None:
    rng, other = generator(seed), generator(seed)
    swarm = BatSwarm(p, BOX, rng)
    for _ in range(p.iterations + 1):
        swarm.tell([sphere(x) for x in swarm.ask()])
    ahead = minimize(sphere, BOX, p, other)
    assert (ahead.best_x, ahead.candidates) == (swarm.best_x, swarm.candidates)
    assert rng.random() == other.random(), "no draw is unused"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bat_swarm, "DRAWN_AHEAD", 50)
        assert minimize(sphere, BOX, p, generator(seed)).candidates == swarm.candidates


FAILING: list[Any] = [
    (math.nan, "NaN"),
    (math.inf, "inf"),
    (-math.inf, "-inf"),
    (np.array([1.0, 2.0]), r"returned array of shape \(2,\)"),
    (np.array([-1e9]), r"returned array of shape \(1,\)"),
    (None, "returned NoneType"),
    ("-1e9", "returned str"),
    (1j, "returned complex"),
    pytest.param(10**400, "returned int", id="huge"),
    (ZeroDivisionError("x / 0"), "raised ZeroDivisionError"),
]


@pytest.mark.parametrize(("bad", "name"), FAILING)
def test_a_failing_objective_is_named_and_counted_and_the_run_continues(
    bad: Any, name: str
) -> None:
    calls: list[bool] = []

    def objective(x: Vector) -> Any:
        calls.append(x[0] > 1.0)
        if not calls[-1]:
            return sphere(x)
        if isinstance(bad, Exception):
            raise bad
        return bad

    swarm = minimize(objective, BOX, BatParams(iterations=20), generator())
    assert len(calls) == 5 * 21
    assert 0 < sum(calls) < len(calls)
    assert list(swarm.failures.counts.values()) == [sum(calls)]
    assert re.match(rf"{sum(calls)} x {name}; first: {name}.* at \[", str(swarm.failures))
    assert swarm.best_value == sphere(swarm.best_x)
    assert swarm.best_x[0] <= 1.0
    assert type(swarm.best_value) is float


def test_numbers_of_other_kinds_are_numbers() -> None:
    for kind in (int, np.float64, np.float32, np.int64, bool, np.array):
        constant = functools.partial(lambda kind, x: kind(7), kind)
        swarm = minimize(constant, BOX, BatParams(), generator())
        assert not swarm.failures
        assert swarm.best_value == float(kind(7))
        assert str(swarm.failures) == "no failures"


def test_an_objective_that_always_fails_is_an_error_in_one_line() -> None:
    with pytest.raises(InputError) as error:
        minimize(lambda x: 1.0 / 0.0, BOX, BatParams(iterations=3), generator())
    assert str(error.value).startswith(
        "objective failed at all 20 points (20 x raised ZeroDivisionError; first: "
        "raised ZeroDivisionError (float division by zero) at ["
    )
    assert "\n" not in str(error.value)


def test_values_whose_sum_overflows_are_still_numbers() -> None:
    swarm = minimize(lambda x: 1e308, BOX, BatParams(), generator())
    assert (swarm.best_value, bool(swarm.failures)) == (1e308, False)


# --- ask and tell ---------------------------------------------------------------------------


def test_asking_twice_returns_the_same_candidates() -> None:
    swarm = BatSwarm(BatParams(), Disc(0.3), generator())
    for t in range(4):
        first = swarm.ask()
        assert swarm.ask() == first
        assert swarm.candidates == first
        assert swarm.t == t
        swarm.tell([sphere(x) for x in first])


def test_returned_candidates_do_not_change_later() -> None:
    swarm = BatSwarm(BatParams(bounds=Bounds.NONE), Disc(0.3), generator())
    handed_out = []
    for _ in range(6):
        candidates = swarm.ask()
        handed_out.append((candidates, [list(x) for x in candidates]))
        swarm.tell([sphere(x) for x in candidates])
    for candidates, copy in handed_out:
        assert candidates == copy


def test_tell_needs_an_ask() -> None:
    swarm = BatSwarm(params(), BOX, generator())
    for _ in range(3):
        with pytest.raises(InputError, match=r"^tell\(\) without ask\(\): call ask"):
            swarm.tell([1.0, 2.0])
        swarm.ask()
        swarm.tell([1.0, 2.0])


@pytest.mark.parametrize("values", [[], [1.0], [1.0, 2.0, 3.0]])
def test_tell_refuses_a_wrong_count_and_ignores_the_values(values: Values) -> None:
    swarm = BatSwarm(params(), BOX, generator())
    swarm.ask()
    with pytest.raises(InputError, match=f"^{len(values)} values for 2 bats: give one per"):
        swarm.tell(values)
    assert swarm.best_value == math.inf
    swarm.tell([2.0, 1.0])
    assert swarm.best_value == 1.0


def test_the_best_is_found_wherever_it_is() -> None:
    for values, best in (([1.0, 2.0], 0), ([2.0, 1.0], 1), ([1.0, 1.0], 0)):
        swarm, x, _ = start(params(), values)
        assert (swarm.best_x, swarm.best_value) == (x[best].tolist(), 1.0)


def test_nan_is_never_the_best() -> None:
    swarm, x, _ = start(params(), [math.nan, 5.0])
    assert (swarm.best_x, swarm.best_value) == (x[1].tolist(), 5.0)
    swarm.ask()
    swarm.tell([math.nan, math.nan])
    assert (swarm.best_x, swarm.best_value) == (x[1].tolist(), 5.0)


def test_a_swarm_continues_after_values_of_nan_only() -> None:
    swarm, x, _ = start(params(), [math.nan, math.nan])
    assert (swarm.best_x, swarm.best_value) == (x[0].tolist(), math.inf)
    candidates = swarm.ask()
    assert swarm.t == 1
    swarm.tell([4.0, math.nan])
    assert (swarm.best_x, swarm.best_value) == (candidates[0], 4.0)


def test_a_bat_whose_first_value_was_nan_accepts_any_number() -> None:
    swarm, _, _ = start(
        params(a0=100.0, f_max=0.0, walk=Walk.SELF, **ALWAYS_WALK), [math.nan, 5.0]
    )
    accepted = swarm.ask()[0]
    swarm.tell([1e9, 9.0])
    walked = swarm.ask()[0]
    assert np.hypot(walked[0] - accepted[0], walked[1] - accepted[1]) <= 0.3 * 100.0 * math.sqrt(
        2.0
    )


def test_each_iteration_uses_the_same_number_of_draws_whatever_happens() -> None:
    for chosen in ({}, {"algorithm": Algorithm.BA}, {"r0": 1.0}, {"epsilon": Epsilon.SCALAR}):
        rng, other = generator(), generator()
        minimize(sphere, Disc(0.3), BatParams(iterations=4, **chosen), rng)  # type: ignore
        other.random(5 * 2 + 4 * 5 * (3 + 2))
        assert rng.random() == other.random()


# --- properties -----------------------------------------------------------------------------


@given(ANY_READING, st.one_of(DISCS, BOXES), st.integers(0, 2**32))
def test_the_best_is_the_least_value_so_far_and_never_worsens(
    p: BatParams, region: Region, seed: int
) -> None:
    swarm = BatSwarm(p, region, generator(seed))
    values_so_far: list[tuple[float, Vector]] = []
    for _ in range(p.iterations + 1):
        before = swarm.best_value
        candidates = swarm.ask()
        values = [sphere(x) for x in candidates]
        values_so_far += zip(values, candidates)
        swarm.tell(values)
        assert swarm.best_value <= before
        least = min(value for value, _ in values_so_far)
        assert (swarm.best_value, swarm.best_x) in values_so_far
        assert swarm.best_value == least


def depth(region: Any, x: Vector) -> float:
    """How far x lies outside the region; 0 inside."""
    if isinstance(region, Disc):
        return max(0.0, math.dist(x, region.center) - region.radius)
    return max(max(lo - v, v - hi, 0.0) for lo, v, hi in zip(region.lower, x, region.upper))


@given(ANY_READING, st.one_of(DISCS, BOXES), st.integers(0, 2**32))
def test_clamped_bats_never_leave_the_region(p: BatParams, region: Region, seed: int) -> None:
    p = replace(p, bounds=Bounds.CLAMP)
    swarm = BatSwarm(p, region, generator(seed))
    for _ in range(p.iterations + 1):
        for x in swarm.ask():
            assert depth(region, x) <= 1e-12 * 150.0
        swarm.tell([sphere(x) for x in swarm.candidates])


def test_unbounded_bats_do_leave_it() -> None:
    p = BatParams(bounds=Bounds.NONE, iterations=20)
    swarm = BatSwarm(p, Disc(0.1), generator())
    far = 0.0
    for _ in range(21):
        far = max([far, *(depth(Disc(0.1), x) for x in swarm.ask())])
        swarm.tell([sphere(x) for x in swarm.candidates])
    assert far > 0.1


@given(ANY_READING, st.integers(0, 2**32))
def test_the_same_seed_gives_the_same_run(p: BatParams, seed: int) -> None:
    one, two = (minimize(sphere, Disc(0.3), p, generator(seed)) for _ in range(2))
    assert (one.best_x, one.best_value) == (two.best_x, two.best_value)
    assert one.candidates == two.candidates


def test_another_seed_gives_another_run() -> None:
    runs = {tuple(minimize(sphere, Disc(0.3), BatParams(), generator(s)).best_x) for s in range(9)}
    assert len(runs) == 9


@pytest.mark.parametrize("algorithm", Algorithm)
def test_minimize_runs_t_iterations_and_beats_the_initial_population(algorithm: Algorithm) -> None:
    p = BatParams(algorithm=algorithm, iterations=30)
    gains = []
    for seed in range(60):
        first = min(sphere(x) for x in BatSwarm(p, BOX, generator(seed)).ask())
        swarm = minimize(sphere, BOX, p, generator(seed))
        assert swarm.t == 30
        assert swarm.best_value == sphere(swarm.best_x) <= first
        gains.append((first - 96.0) / max(1e-12, swarm.best_value - 96.0))
    assert np.median(gains) > 2.0


def test_minimize_evaluates_each_candidate_once() -> None:
    points: list[Vector] = []

    def count(x: Vector) -> float:
        points.append(x)
        return sphere(x)

    minimize(count, BOX, BatParams(population=3, iterations=4), generator())
    assert len(points) == 3 * (4 + 1)


# --- changing the region --------------------------------------------------------------------


def test_change_region_clamps_bats_and_best_and_evaluates_them_again() -> None:
    p = params(bounds=Bounds.CLAMP, **ALWAYS_WALK)
    swarm, _, rng = start(p, [3.0, 1.0])
    away = Box((7.0, 10.0), (8.0, 12.0))
    swarm.change_region(away, lambda x: x[0] + x[1])
    y = [x[1] for x in BatSwarm(p, BOX, generator()).ask()]
    assert swarm.best_x == [7.0, min(y)]
    assert swarm.best_value == 7.0 + min(y)
    epsilon = 2.0 * rng.random((2, 5))[:, 3:] - 1.0
    expected = [away.clamp((np.array(swarm.best_x) + 0.3 * e).tolist()) for e in epsilon]
    assert swarm.ask() == expected
    swarm.tell([17.0, 7.0 + max(y)])  # not worse than bat 2's clamped position
    assert swarm.best_value == min(17.0, 7.0 + min(y))


def test_change_region_does_not_move_unbounded_bats() -> None:
    swarm, x, _ = start(params(), [3.0, 1.0])
    swarm.change_region(Box((70.0, 70.0), (80.0, 80.0)), lambda x: 5.0)
    assert (swarm.best_x, swarm.best_value) == (x[1].tolist(), 5.0)


def test_change_region_is_refused_between_ask_and_tell() -> None:
    swarm = BatSwarm(params(), BOX, generator())
    for _ in range(3):
        with pytest.raises(
            InputError, match=r"^change_region\(\) before tell\(\): give the values"
        ):
            swarm.change_region(BOX, sphere)
        swarm.ask()
        with pytest.raises(
            InputError, match=r"^change_region\(\) before tell\(\): give the values"
        ):
            swarm.change_region(BOX, sphere)
        swarm.tell([1.0, 2.0])
        swarm.change_region(BOX, sphere)
        swarm.ask()


# --- regions --------------------------------------------------------------------------------


def test_box_by_hand() -> None:
    assert BOX.span() == ([-1.0, 10.0], [3.0, 12.0])
    assert BOX.clamp([0.5, 11.0]) == [0.5, 11.0]
    assert BOX.clamp([-2.0, 13.0]) == [-1.0, 12.0]
    assert BOX.clamp([4.0, 9.0]) == [3.0, 10.0]
    assert Box((1.0,), (1.0,)).clamp([5.0]) == [1.0]


@pytest.mark.parametrize(
    ("lower", "upper", "message"),
    [
        ((), (), "box of 0 lower and 0 upper bounds: give d >= 1 of each"),
        ((0.0,), (1.0, 2.0), "box of 1 lower and 2 upper bounds: give d >= 1 of each"),
        ((0.0, 2.0), (1.0, 1.0), r"bounds \[2.0, 1.0\]: give finite lower <= upper"),
        ((-math.inf,), (1.0,), r"bounds \[-inf, 1.0\]: give finite"),
        ((0.0,), (math.inf,), r"bounds \[0.0, inf\]: give finite"),
        ((math.nan,), (1.0,), r"bounds \[nan, 1.0\]: give finite"),
    ],
)
def test_box_refuses(lower: Any, upper: Any, message: str) -> None:
    with pytest.raises(ConfigError, match=f"^{message}"):
        Box(lower, upper)


def test_box_takes_lists_and_arrays_of_numbers() -> None:
    numbers: list[Any] = [[-1, 10], np.array([-1.0, 10.0]), np.array([-1, 10])]
    for lower in numbers:
        box = Box(lower, (3, 12))
        assert box == BOX
        assert {type(v) for v in (*box.lower, *box.upper)} == {float}


@pytest.mark.parametrize("edge", [5.0, None, ("a", "b"), ([1.0], [2.0])])
def test_box_refuses_values_that_are_not_numbers(edge: Any) -> None:
    with pytest.raises(ConfigError, match=r"^box from .*: give d numbers for each$"):
        Box(edge, (3.0, 12.0))


def test_disc_by_hand() -> None:
    disc = Disc(5.0, (1.0, 2.0))
    assert disc.span() == ([-4.0, -3.0], [6.0, 7.0])
    assert disc.clamp([4.0, 6.0]) == [4.0, 6.0], "the edge is inside"
    assert disc.clamp([1.0, 2.0]) == [1.0, 2.0]
    assert disc.clamp([7.0, 10.0]) == pytest.approx([4.0, 6.0])
    assert disc.clamp([-9.0, 2.0]) == pytest.approx([-4.0, 2.0])
    assert Disc(1.0).clamp([0.0, -3.0]) == [0.0, -1.0], "centred at the origin by default"


# --- refusals -------------------------------------------------------------------------------


def test_one_bat_is_no_swarm() -> None:
    with pytest.raises(ConfigError, match=r"^population=1: out of range; give a value in \[2, "):
        BatParams(population=1)


def test_f_min_above_f_max_is_refused() -> None:
    assert BatParams(f_min=2.0, f_max=2.0).f_min == 2.0
    with pytest.raises(ConfigError, match=r"^f_min=3: above f_max=2; give f_min <= f_max$"):
        BatParams(f_min=3.0, f_max=2.0)
