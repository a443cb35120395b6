# SPDX-License-Identifier: Apache-2.0
"""Parameters of a bat swarm: the paper's constants, and options where the paper is ambiguous."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from ..core.errors import ConfigError
from ..core.option_specs import check, option


class Algorithm(Enum):
    """How beta of eq. 4 is drawn."""

    BA = "ba"
    MFBA = "mfba"


class Velocity(Enum):
    """Sign of eq. 5: as printed bats move away from the best; in the literature, towards it."""

    TOWARDS_BEST = "towards_best"
    AS_PRINTED = "as_printed"


class Schedule(Enum):
    """The t of eq. 10: t/T stays in [0, 1] as eq. 4 requires; the raw t is as printed."""

    NORMALIZED = "normalized"
    RAW = "raw"


class Bounds(Enum):
    """Whether a bat outside the search region is moved back to its edge."""

    CLAMP = "clamp"
    NONE = "none"


class Epsilon(Enum):
    """Whether epsilon of eq. 7 is drawn per coordinate or once for all of them."""

    PER_COORDINATE = "per_coordinate"
    SCALAR = "scalar"


class Initial(Enum):
    """Sign of eq. 3: inside the box, or as printed (mirrored, outside the box)."""

    INSIDE = "inside"
    AS_PRINTED = "as_printed"


class Walk(Enum):
    """Where the local walk of eq. 7 starts: the best point so far, or the bat itself."""

    BEST = "best"
    SELF = "self"


class Step(Enum):
    """Length of the local walk of eq. 7: sigma itself, or sigma times a distance of two bats."""

    SIGMA = "sigma"
    PAIR = "pair"


class Acceptance(Enum):
    """What a candidate must not be worse than: its bat, the best so far, or nothing."""

    OWN = "own"
    BEST = "best"
    ANY = "any"


class Update(Enum):
    """When a bat's A and r follow eq. 8 and 9: on acceptance, or in every iteration."""

    ACCEPTED = "accepted"
    ALWAYS = "always"


@dataclass(frozen=True, slots=True, kw_only=True)
class BatParams:
    """Constants of section 6.2; where the paper is ambiguous, the reading `robust`."""

    algorithm: Algorithm = option(Algorithm.MFBA, "beta is random (ba) or follows eq. 10 (mfba)")
    population: int = option(5, "number of bats", minimum=2, maximum=10_000)
    iterations: int = option(5, "iterations T of one run", minimum=1, maximum=1_000_000)
    a0: float = option(1.0, "initial loudness A_i(0)", minimum=0.0, maximum=100.0)
    r0: float = option(0.5, "initial pulse rate r_i(0)", minimum=0.0, maximum=1.0)
    alpha: float = option(0.98, "loudness decay of eq. 8", minimum=0.0, maximum=1.0)
    gamma: float = option(0.8, "pulse rate growth of eq. 9", minimum=0.0, maximum=100.0)
    f_min: float = option(0.0, "lowest frequency of eq. 4", minimum=0.0, maximum=1000.0)
    f_max: float = option(10.0, "highest frequency of eq. 4", minimum=0.0, maximum=1000.0)
    sigma: float = option(
        0.3, "scale of the local walk of eq. 7", unit="of x", minimum=0.0, maximum=1e6
    )
    rho: float = option(0.01, "rho of eq. 10", minimum=0.0, maximum=100.0)
    velocity: Velocity = option(Velocity.TOWARDS_BEST, "sign of eq. 5")
    schedule: Schedule = option(Schedule.NORMALIZED, "t of eq. 10: t/T or the raw t")
    bounds: Bounds = option(Bounds.CLAMP, "what happens at the edge of the search region")
    epsilon: Epsilon = option(Epsilon.PER_COORDINATE, "how epsilon of eq. 7 is drawn")
    initial: Initial = option(Initial.INSIDE, "sign of eq. 3")
    walk: Walk = option(Walk.BEST, "start of the local walk of eq. 7")
    step: Step = option(Step.SIGMA, "length of the local walk: sigma, or sigma times a pair's")
    acceptance: Acceptance = option(Acceptance.OWN, "what a candidate must not be worse than")
    update: Update = option(Update.ACCEPTED, "when A and r follow eq. 8 and 9")
    inertia: float = option(
        1.0, "share of the old velocity that eq. 5 keeps", minimum=0.0, maximum=1.0
    )

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)
        if self.f_min > self.f_max:
            raise ConfigError(
                f"f_min={self.f_min:g}: above f_max={self.f_max:g}; give f_min <= f_max"
            )
