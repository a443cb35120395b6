# SPDX-License-Identifier: Apache-2.0
"""The paper's figures by name: description, the run that is shown, and the file's bytes."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from ...paper import readings_of_paper
from ...scenarios.scenario_files import load_scenario
from ...simulation.episode import Episode
from ...simulation.run_episode import run

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
    "fig2": "fig2_beta",
    "fig4": "fig4_enlargement",
    "fig5": "fig5_sectors",
    "fig6": "fig6_gap_vector",
    "convergence": "convergence_curves",
}
_TITLES = {
    "fig7": "Fig. 7: case study 1",
    "fig8": "Fig. 8: case study 2",
}
_CHOICE = "of 1000 runs the one nearest to the printed length with the figure's encounters"
FORMATS = ("svg", "png")


def render(name: str, forms: tuple[str, ...] = FORMATS) -> dict[str, bytes]:
    """One figure in several formats, {format: bytes}."""
    from .. import style
    from ..figure_sheet import to_bytes

    with style.context():
        figure = _draw(name)
        return {form: to_bytes(figure, form) for form in forms}


def figure_run(name: str) -> Episode:
    """The run that fig7 or fig8 shows."""
    case, seed = readings_of_paper.FIGURE_RUNS[name]
    return run(load_scenario(case), planner=readings_of_paper.planner("section6"), seed=seed)


def _draw(name: str) -> Any:
    if name in _MODULES:
        return import_module(f"mfba_planner.report.figures.{_MODULES[name]}").draw()
    from . import fig7_fig8_trips

    return fig7_fig8_trips.draw(figure_run(name), _TITLES[name], _CHOICE)
