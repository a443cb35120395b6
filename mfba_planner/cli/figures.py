# SPDX-License-Identifier: Apache-2.0
"""`mfba figures`: the paper's figures again, as SVG and PNG; needs no ROS."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from pathlib import Path
from typing import Any

from ..arguments import Parser
from ..core.episode import Episode, run
from ..core.errors import ConfigError
from ..core.options import did_you_mean
from ..outputs import new_run_directory, refuse_existing, write_new
from ..paper import readings
from ..scenarios import load_scenario

_DESCRIPTION = "Draw the paper's figures again; the same version draws the same bytes."
FIGURES = {
    "fig2": "beta of eq. 10 over the iterations, for several rho",
    "fig4": "obstacles enlarged by the robot's radius",
    "fig5": "sensing range, sectors, tangents and the example of Vs",
    "fig6": "the gap vector of that example",
    "fig7": "case study 1 at the paper's moments",
    "fig8": "case study 2 at the paper's moments",
    "convergence": "BA and MFBA on F1 to F6",
}
_MODULES = {
    "fig2": "beta",
    "fig4": "enlargement",
    "fig5": "sectors",
    "fig6": "gaps",
    "convergence": "convergence",
}
_TITLES = {
    "fig7": "Fig. 7: case study 1",
    "fig8": "Fig. 8: case study 2",
}
_CHOICE = "of 1000 runs that which comes nearest to the printed length and meets as told"
FORMATS = ("svg", "png")


def main(args: list[str]) -> int:
    """Draw the figures into a new directory."""
    parser = Parser(prog="mfba figures", description=_DESCRIPTION, epilog=_epilog())
    parser.add_argument(
        "--only", nargs="+", metavar="NAME", default=list(FIGURES), help="these figures only"
    )
    parser.add_argument(
        "--format",
        default=",".join(FORMATS),
        metavar="FORMATS",
        help="svg, png or both with a comma (default: %(default)s)",
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="directory to create (default: runs/figures-NNN)"
    )
    found = parser.parse(args)
    names = _known("figure", found.only, FIGURES)
    forms = _known("format", found.format.split(","), FORMATS)
    out = new_run_directory(stem="figures") if found.out is None else refuse_existing(found.out)
    files = {
        f"{name}.{form}": data for name in names for form, data in render(name, forms).items()
    }
    out.mkdir(parents=True)
    for name, data in files.items():
        write_new(out / name, data)
    print(f"wrote {out}: {', '.join(files)}")
    return 0


def render(name: str, forms: tuple[str, ...] = FORMATS) -> dict[str, bytes]:
    """One figure in several formats, {format: bytes}."""
    from ..report import style
    from ..report.sheet import to_bytes

    with style.context():
        figure = _draw(name)
        return {form: to_bytes(figure, form) for form in forms}


def figure_run(name: str) -> Episode:
    """The run that fig7 or fig8 shows."""
    case, seed = readings.FIGURE_RUNS[name]
    return run(load_scenario(case), planner=readings.planner("section6"), seed=seed)


def _draw(name: str) -> Any:
    if name in _MODULES:
        return import_module(f"mfba_planner.report.figures.{_MODULES[name]}").draw()
    from ..report.figures import trips

    return trips.draw(figure_run(name), _TITLES[name], _CHOICE)


def _known(kind: str, given: Iterable[str], known: Iterable[str]) -> tuple[str, ...]:
    """What was given without repetition; ConfigError for a name that is not known."""
    wanted = tuple(dict.fromkeys(given))
    for name in wanted:
        if name not in known:
            raise ConfigError(f"{name!r}: no such {kind}; {did_you_mean(name, list(known))}")
    return wanted


def _epilog() -> str:
    width = max(map(len, FIGURES))
    return "figures:\n" + "\n".join(f"  {name:<{width}}  {what}" for name, what in FIGURES.items())
