# SPDX-License-Identifier: Apache-2.0
"""Optimisers by name: built in, of libraries, of installed packages and MODULE:NAME."""

import math
import sys
from pathlib import Path

import faulty_optimizers
import pytest

from mfba_planner.core.errors import ConfigError, OptimizerError
from mfba_planner.core.random_streams import stream
from mfba_planner.optimizers import registry
from mfba_planner.optimizers.registry import NAMES, find_optimizer, optimize, require_optimizer
from mfba_planner.swarm.bat_swarm import Algorithm, BatParams, BatSwarm, Disc
from mfba_planner.swarm.optimizer import Found, each

BAT = BatParams(population=6, iterations=3)
DISC = Disc(0.3)
SOUND = "faulty_optimizers:Sound"


def found(name: str, bat: BatParams = BAT, seed: int = 0) -> Found:
    return optimize(name, bat, DISC, stream(seed, 1), each(lambda x: math.dist(x, (0.1, 0.2))))


@pytest.mark.parametrize("name", ["bats", "ba", "mfba", "random", "grid", SOUND])
def test_a_search_has_as_many_evaluations_as_the_bats(name: str) -> None:
    assert found(name).evaluations == 24
    assert found(name) == found(name)


def test_bats_are_as_bat_algorithm_says_or_as_named() -> None:
    plain = BatParams(algorithm=Algorithm.BA, population=6, iterations=3)
    assert found("bats") == found("mfba") == found("mfba", plain)
    assert found("bats", plain) == found("ba", plain) == found("ba") != found("mfba")


def test_a_bat_factory_takes_budget_and_population() -> None:
    made = find_optimizer("bats", BAT)(DISC, 40, stream(0, 1), 10)
    assert isinstance(made, BatSwarm)
    assert (made.params.population, made.params.iterations, made.horizon) == (10, 3, 3)
    small = find_optimizer("ba", BAT)(DISC, 10, stream(0, 1), 10)
    assert isinstance(small, BatSwarm)
    assert small.params.iterations == 1, "as few as there are"


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("randon", r"^optimizer 'randon': unknown; did you mean 'random'\?$"),
        ("bat", r"did you mean 'bats'\?$"),
        ("qqq", "unknown; known: ba, bats, cmaes:CMA, grid, "),
        ("scipy:diferential_evolution", r"did you mean 'scipy:differential_evolution'\?$"),
        ("nipy:ParticleSwarmAlgorithm", r"did you mean 'niapy:ParticleSwarmAlgorithm'\?; give MO"),
        ("faulty_optimizers:Absent", "cannot be imported .*'Absent'.*; give MODULE:NAME of"),
        (":X", "cannot be imported"),
    ],
)
def test_an_unknown_name_is_one_line_with_the_nearest(name: str, message: str) -> None:
    for refuse in (require_optimizer, lambda name: find_optimizer(name, BAT)):
        with pytest.raises(ConfigError, match=message) as error:
            refuse(name)
        assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", [name for name in NAMES if ":" in name])
def test_a_missing_library_names_the_extra(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "find_spec", lambda _: None)
    registry._find.cache_clear()
    library = name.partition(":")[0]
    with pytest.raises(ConfigError) as error:
        require_optimizer(name)
    assert str(error.value) == (
        f"optimizer {name}: {library} is not installed; pip install 'mfba_planner[optimizers]'"
    )


def test_none_is_known_but_no_optimizer() -> None:
    require_optimizer("none")
    with pytest.raises(ConfigError, match="none: no search, only the planner's own candidate"):
        find_optimizer("none", BAT)


def test_a_module_of_the_working_directory_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "of_mine.py").write_text("from faulty_optimizers import Sound as Mine\n")
    (tmp_path / "broken.py").write_text("def (\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    assert find_optimizer("of_mine:Mine", BAT) is faulty_optimizers.Sound
    with pytest.raises(ConfigError, match=r"broken:X: cannot be imported \(invalid syntax"):
        require_optimizer("broken:X")
    assert sys.path.count(str(tmp_path)) == 1


def test_an_installed_package_adds_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    described = tmp_path / "swarms-1.0.dist-info"
    described.mkdir()
    (described / "METADATA").write_text("Name: swarms\nVersion: 1.0\n")
    (described / "entry_points.txt").write_text(f"[mfba_planner.optimizers]\nhunters = {SOUND}\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert find_optimizer("hunters", BAT) is faulty_optimizers.Sound
    with pytest.raises(ConfigError, match="did you mean 'hunters'"):
        require_optimizer("hunter")
    registry._find.cache_clear()


def test_a_fault_is_named_with_its_optimizer_and_the_check() -> None:
    for name, what in (
        ("NoPoints", r"ask\(\) returned no points"),
        ("CannotBeMade", r"the factory raised TypeError \(no idea how\)"),
    ):
        of = f"faulty_optimizers:{name}"
        with pytest.raises(
            OptimizerError, match=rf"^optimizer {of}: {what}; see `mfba check-optimizer {of}`$"
        ):
            found(of)
