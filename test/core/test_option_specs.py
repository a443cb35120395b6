# SPDX-License-Identifier: Apache-2.0
import math
from dataclasses import dataclass, field, fields
from enum import Enum
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.core import errors
from mfba_planner.core.errors import ConfigError, MfbaError
from mfba_planner.core.option_specs import (
    Spec,
    check,
    did_you_mean,
    flatten,
    option,
    override,
    require_range,
    walk,
)
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.swarm.bat_swarm import Algorithm, BatParams, Bounds


class Colour(Enum):
    RED = "red"
    BLUE = "blue"


@dataclass(frozen=True, slots=True, kw_only=True)
class Inner:
    depth: int = option(3, "how deep", minimum=1, maximum=9)

    def __post_init__(self) -> None:
        check(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class Outer:
    size: float = option(1.5, "how big", unit="m", minimum=-1.0, maximum=2.0)
    low: float = option(0.0, "bounded below", minimum=0.0)
    high: float = option(0.0, "bounded above", unit="s", maximum=0.0)
    count: int = option(2, "how many")
    bold: bool = option(False, "how loud")
    label: str = option("x", "its text")
    colour: Colour = option(Colour.RED, "which")
    inner: Inner = field(default_factory=Inner)
    plain: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        check(self)


def refusal(**values: Any) -> str:
    with pytest.raises(ConfigError) as caught:
        Outer(**values)
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_every_error_is_of_one_family() -> None:
    for name in ("ConfigError", "InputError", "BagError", "OutputError", "GraphError"):
        assert issubclass(getattr(errors, name), MfbaError)


def test_defaults_and_limits_are_accepted() -> None:
    assert Outer().size == 1.5
    assert Outer(size=-1.0).size == -1.0
    assert Outer(size=2.0).size == 2.0
    assert Outer(low=1e300, high=-1e300, count=-(10**30)).count == -(10**30)


def test_a_whole_number_given_for_a_number_becomes_one() -> None:
    value = Outer(size=1).size
    assert value == 1.0
    assert type(value) is float


def test_a_numpy_float_becomes_a_float() -> None:
    assert type(Outer(size=np.float64(0.25)).size) is float


def test_a_name_given_for_a_choice_becomes_a_member() -> None:
    assert Outer(colour="blue").colour is Colour.BLUE  # type: ignore[arg-type]
    assert Outer(colour=Colour.BLUE).colour is Colour.BLUE


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"size": 2.1}, "size=2.1: out of range; give a value in [-1, 2] m"),
        ({"size": -1.001}, "size=-1.001: out of range; give a value in [-1, 2] m"),
        ({"low": -0.1}, "low=-0.1: out of range; give a value in [0, inf]"),
        ({"high": 0.1}, "high=0.1: out of range; give a value in [-inf, 0] s"),
        ({"size": math.nan}, "size=nan: not finite; give a value in [-1, 2] m"),
        ({"low": math.inf}, "low=inf: not finite; give a value in [0, inf]"),
        ({"low": 10**400}, "low=inf: not finite; give a value in [0, inf]"),
        ({"size": "1"}, "size='1': give a number"),
        ({"size": True}, "size=True: give a number"),
        ({"size": None}, "size=None: give a number"),
        ({"count": 1.0}, "count=1.0: give a whole number"),
        ({"count": True}, "count=True: give a whole number"),
        ({"bold": 1}, "bold=1: give true or false"),
        ({"label": 1}, "label=1: give a text"),
        ({"colour": "green"}, "colour='green': unknown; choose one of red, blue"),
        ({"colour": ["red"]}, "colour=['red']: unknown; choose one of red, blue"),
        (
            {"colour": Algorithm.BA},
            "colour=<Algorithm.BA: 'ba'>: unknown; choose one of red, blue",
        ),
    ],
)
def test_refusals_name_value_and_remedy(values: dict[str, Any], message: str) -> None:
    assert refusal(**values) == message


def test_a_mistyped_field_raises() -> None:
    with pytest.raises(TypeError, match="sise"):
        Outer(sise=1.0)  # type: ignore[call-arg]


def test_walk_yields_every_option_once_with_its_spec() -> None:
    found = {name: (value, item.metadata["spec"]) for name, value, item in walk(Outer())}
    assert list(found) == [
        *("size", "low", "high", "count", "bold", "label", "colour"),
        "inner.depth",
    ]
    assert found["inner.depth"] == (3, Spec(doc="how deep", minimum=1, maximum=9))
    assert found["size"][1] == Spec(doc="how big", unit="m", minimum=-1.0, maximum=2.0)


def test_flatten_gives_plain_values() -> None:
    assert flatten(Outer(colour=Colour.BLUE, inner=Inner(depth=7))) == {
        "size": 1.5,
        "low": 0.0,
        "high": 0.0,
        "count": 2,
        "bold": False,
        "label": "x",
        "colour": "blue",
        "inner.depth": 7,
    }


def test_override_changes_what_is_named_and_nothing_else() -> None:
    old = Outer(size=0.5, inner=Inner(depth=4))
    new = override(old, {"inner.depth": 8, "colour": "blue"})
    assert (new.inner.depth, new.colour, new.size) == (8, Colour.BLUE, 0.5)
    assert (old.inner.depth, old.colour) == (4, Colour.RED)
    assert override(old, {}) == old


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"inner.depth": 10}, "depth=10: out of range; give a value in [1, 9]"),
        ({"inner.dept": 1}, "inner.dept: unknown option; did you mean 'inner.depth'?"),
        ({"depth": 1}, "depth: unknown option; did you mean 'inner.depth'?"),
        ({"sizes": 1}, "sizes: unknown option; did you mean 'size'?"),
        ({"inner": Inner()}, "inner: unknown option; did you mean 'inner.depth'?"),
    ],
)
def test_override_refuses(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        override(Outer(), changes)
    assert str(caught.value) == message


def test_override_checks_changes_as_a_whole() -> None:
    old = BatParams(f_min=1.0, f_max=2.0)
    assert override(old, {"f_min": 5.0, "f_max": 6.0}).f_min == 5.0
    with pytest.raises(ConfigError, match="f_min=5: above f_max=2; give f_min <= f_max"):
        override(old, {"f_min": 5.0})


def test_without_a_similar_word_all_known_words_are_listed() -> None:
    assert did_you_mean("zzzz", ["b", "a"]) == "known: a, b"
    assert did_you_mean("coat", ["case1"]) == "known: case1", "2 of 5 characters match: too few"
    assert did_you_mean("case", ["case1", "empty"]) == "did you mean 'case1'?"


@given(
    st.fixed_dictionaries(
        {},
        optional={
            "speed_mps": st.floats(0.01, 100.0),
            "swarm": st.sampled_from(["fresh", "persistent"]),
            "bat.population": st.integers(2, 10_000),
            "bat.bounds": st.sampled_from(list(Bounds)),
            "bat.rho": st.floats(0.0, 100.0),
        },
    )
)
def test_flatten_and_override_are_a_round_trip(changes: dict[str, Any]) -> None:
    changed = override(PlannerParams(), changes)
    assert override(PlannerParams(), flatten(changed)) == changed
    for name, value in changes.items():
        plain = value.value if isinstance(value, Enum) else value
        assert flatten(changed)[name] == plain


@pytest.mark.parametrize("kind", [BatParams, PlannerParams, SensorParams])
def test_every_parameter_is_documented_and_bounded(kind: type) -> None:
    for name, value, item in walk(kind()):
        spec = item.metadata["spec"]
        assert spec.doc, name
        if isinstance(value, float) or type(value) is int:
            assert spec.minimum is not None, name
            assert spec.maximum is not None, name
            assert spec.minimum <= value <= spec.maximum


def test_section_6_2_gives_the_defaults() -> None:
    bat, planner, sensor = BatParams(), PlannerParams(), SensorParams()
    assert (bat.population, bat.a0, bat.r0, bat.alpha, bat.gamma) == (5, 1.0, 0.5, 0.98, 0.8)
    assert (bat.f_min, bat.f_max, bat.sigma, bat.rho) == (0.0, 10.0, 0.3, 0.01)
    assert (sensor.sectors, sensor.sensing_range_m) == (12, 0.8)
    # fitted to Tables 5 and 7, see paper/readings_of_paper.py
    assert (planner.speed_mps, planner.step_length_m, bat.iterations) == (0.785, 0.3, 5)
    assert (planner.goal_tolerance_m, planner.input_timeout_s) == (0.02, 1.0)
    assert planner.bat == bat


@pytest.mark.parametrize(
    ("kind", "name", "low", "high"),
    [
        (BatParams, "population", 2, 10_000),
        (BatParams, "iterations", 1, 1_000_000),
        (BatParams, "a0", 0.0, 100.0),
        (BatParams, "r0", 0.0, 1.0),
        (BatParams, "alpha", 0.0, 1.0),
        (BatParams, "gamma", 0.0, 100.0),
        (BatParams, "f_min", 0.0, 1000.0),
        (BatParams, "f_max", 0.0, 1000.0),
        (BatParams, "sigma", 0.0, 1e6),
        (BatParams, "rho", 0.0, 100.0),
        (BatParams, "inertia", 0.0, 1.0),
        (PlannerParams, "speed_mps", 0.01, 100.0),
        (PlannerParams, "step_length_m", 0.001, 100.0),
        (PlannerParams, "goal_tolerance_m", 1e-6, 10.0),
        (PlannerParams, "input_timeout_s", 0.001, 3600.0),
        (PlannerParams, "jump_m", 0.01, 1e6),
        (PlannerParams, "robot_radius_m", 0.0, 100.0),
        (PlannerParams, "max_speed_mps", 0.01, 100.0),
        (PlannerParams, "max_turn_radps", 0.01, 100.0),
        (PlannerParams, "max_accel_mps2", 0.01, 1000.0),
        (PlannerParams, "max_turn_accel_radps2", 0.01, 1000.0),
        (PlannerParams, "turn_first_rad", 0.05, 1.5),
        (SensorParams, "sectors", 3, 3600),
        (SensorParams, "sensing_range_m", 0.01, 1000.0),
    ],
)
def test_the_range_of_every_parameter(kind: type, name: str, low: float, high: float) -> None:
    rest = {"f_max": 1000.0} if name == "f_min" else {}
    for value in (low, high):
        assert getattr(kind(**{name: value}, **rest), name) == value
    whole = type(low) is int
    below = low - 1 if whole else math.nextafter(low, -math.inf)
    above = high + 1 if whole else math.nextafter(high, math.inf)
    for value in (below, above):
        with pytest.raises(ConfigError, match=f"^{name}=.*: out of range; give a value in"):
            kind(**{name: value}, **rest)


def test_the_table_above_is_complete() -> None:
    mark = test_the_range_of_every_parameter.pytestmark[0]  # type: ignore[attr-defined]
    tested = {(row[0], row[1]) for row in mark.args[1]}
    numbers = {
        (kind, item.name)
        for kind in (BatParams, PlannerParams, SensorParams)
        for item in fields(kind)
        if type(item.default) in (int, float)
    }
    assert tested == numbers


@pytest.mark.parametrize("above", [False, True])
@pytest.mark.parametrize(("low", "high"), [(0, 3600), (1, 2**31 - 1), (0.0, 86_400.0)])
def test_a_range_that_is_named_is_the_one_that_is_accepted(
    low: float, high: float, above: bool
) -> None:
    require_range("--x", high, low, high, above=above)
    require_range("--x", low + 1, low, high, above=above)
    for refused in (low - 1, high + 1, 10**30, math.nan, math.inf, *([low] if above else [])):
        with pytest.raises(ConfigError) as caught:
            require_range("--x", refused, low, high, "s", above=above)
        end = (f"more than {low:g}, at most" if above else f"{low:g} to") + f" {int(high)} s"
        assert str(caught.value).endswith(f": out of range; give {end}")
    if not above:
        require_range("--x", low, low, high)
