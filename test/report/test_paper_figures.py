# SPDX-License-Identifier: Apache-2.0
"""The paper's figures: what they show is correct, no text is cut, equal bytes."""

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from mfba_planner import cli
from mfba_planner.core.errors import ConfigError, InputError, OutputError
from mfba_planner.core.geometry import distance
from mfba_planner.core.planner_types import Mode
from mfba_planner.evaluation.metrics import evaluate, within_range
from mfba_planner.paper import convergence_curves, published
from mfba_planner.paper.benchmark_functions import FUNCTIONS
from mfba_planner.planning.gap_vector import gap_vector
from mfba_planner.report import style
from mfba_planner.report.figure_sheet import Sheet, to_bytes
from mfba_planner.report.figures import (
    fig2_beta,
    fig4_enlargement,
    fig5_sectors,
    fig6_gap_vector,
    fig7_fig8_trips,
    paper_figures,
    sketch_elements,
)
from mfba_planner.swarm.bat_swarm import Algorithm, Schedule

SKETCHES = {
    "fig2": fig2_beta.draw,
    "fig4": fig4_enlargement.draw,
    "fig5": fig5_sectors.draw,
    "fig6": fig6_gap_vector.draw,
}
TRIPS = ("fig7", "fig8")
PRINTED_M = {"fig7": 17.0925, "fig8": 18.3533}  # section 6.2


@cache
def figure_of(name: str) -> Figure:
    with style.context():
        if name in SKETCHES:
            return SKETCHES[name]()
        return fig7_fig8_trips.draw(paper_figures.figure_run(name), name)


@pytest.mark.parametrize("name", [*SKETCHES, *TRIPS])
def test_every_text_is_inside_the_figure_and_none_overlap(name: str) -> None:
    figure = figure_of(name)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()  # this positions the axis labels
    renderer = canvas.get_renderer()
    boxes = [(text.get_text(), text.get_window_extent(renderer)) for text in drawn_texts(figure)]
    for words, box in boxes:
        assert 0 <= box.x0 < box.x1 <= figure.bbox.width, words
        assert 0 <= box.y0 < box.y1 <= figure.bbox.height, words
    assert len(boxes) > 8
    for i, (one, a) in enumerate(boxes):
        for other, b in boxes[:i]:
            assert not a.shrunk(0.9, 0.6).overlaps(b.shrunk(0.9, 0.6)), (one, other)


def drawn_texts(figure: Figure) -> list[Text]:
    """Every text, without tick labels beyond the limits and texts of hidden axes."""
    found = [*figure.texts]
    for legend in figure.legends:
        found += legend.get_texts()
    for ax in figure.axes:
        found += ax.texts
        if ax.axison:
            found += [ax.xaxis.label, ax.yaxis.label]
            for axis, limits in ((ax.xaxis, ax.get_xlim()), (ax.yaxis, ax.get_ylim())):
                ticks = axis.get_major_ticks()
                found += [t.label1 for t in ticks if limits[0] <= t.get_loc() <= limits[1]]
    return [text for text in found if text.get_text()]


@pytest.mark.parametrize("name", ["fig5", "fig7"])
@pytest.mark.parametrize("form", paper_figures.FORMATS)
def test_equal_bytes_without_a_date(name: str, form: str) -> None:
    data = paper_figures.render(name, (form,))[form]
    assert data == paper_figures.render(name, (form,))[form]
    assert not re.search(rb"20\d\d-\d\d-\d\d|<dc:date>|matplotlib v", data, re.IGNORECASE)


# --- content --------------------------------------------------------------------------------


def test_fig_2_is_eq_10() -> None:
    draws = np.array([[0.0, 0.25, 0.5], [1.0, 0.75, 0.5]])
    draws = np.pad(draws, ((0, 0), (0, fig2_beta.HORIZON - 2)))
    t = np.arange(fig2_beta.HORIZON + 1)
    raw = fig2_beta.betas(3.0, Schedule.RAW, draws)
    assert raw == pytest.approx(t * np.exp(-3.0 * draws))
    assert fig2_beta.betas(3.0, Schedule.NORMALIZED, draws) == pytest.approx(
        raw / fig2_beta.HORIZON
    )
    assert 0.01 in fig2_beta.RHOS


def test_fig_5_and_6_are_the_papers_example() -> None:
    bits = sketch_elements.example_vs()
    assert " ".join(map(str, bits)) == published.EXAMPLE_VS
    assert " ".join(map(str, gap_vector(bits))) == published.EXAMPLE_VG
    centers = [obstacle.center_m for obstacle in sketch_elements.EXAMPLE.obstacles]
    assert all(distance(a, b) >= 0.6 for i, a in enumerate(centers) for b in centers[:i])
    texts = [text.get_text() for text in figure_of("fig5").texts]
    for words in ("S1, S2", "none: out of range", "S7, S8", "S8, S9"):
        assert words in texts


def test_fig_6_chooses_the_free_gap_nearest_to_the_goal() -> None:
    axes = figure_of("fig6").axes
    (ring,) = (ax for ax in axes if any(p.get_gid() == "set" for p in ax.patches))
    bold = [text.get_text() for text in ring.texts if text.get_fontweight() == "bold"]
    assert bold == ["3"]  # 45 degrees lie between gaps 1 and 2, which are closed; 3 is at 90


@pytest.mark.parametrize("name", TRIPS)
def test_the_runs_of_fig_7_and_8_have_the_printed_lengths(name: str) -> None:
    result = evaluate(paper_figures.figure_run(name))
    assert result.success
    assert result.length_m == pytest.approx(PRINTED_M[name], abs=0.0015)


def test_the_captions_are_those_of_the_paper() -> None:
    words = {
        name: [s.caption for s in fig7_fig8_trips.snapshots(paper_figures.figure_run(name))]
        for name in TRIPS
    }
    assert words == {
        "fig7": [
            "nothing within SR",
            "obstacle 1 within SR",
            "back to path generation",
            "goal reached",
        ],
        "fig8": [
            "nothing within SR",
            "obstacle 1 within SR",
            "obstacles 1 and 2 within SR",
            "back to path generation",
            "goal reached",
        ],
    }


@pytest.mark.parametrize("name", TRIPS)
def test_each_snapshot_is_what_its_caption_names(name: str) -> None:
    episode = paper_figures.figure_run(name)
    for snapshot in fig7_fig8_trips.snapshots(episode):
        tick = episode.ticks[snapshot.index]
        near = within_range(episode, tick)
        named = tuple(int(word) for word in snapshot.caption.split() if word.isdigit())
        assert near == named
        assert (tick.mode is Mode.OBSTACLE_AVOIDANCE) == bool(named)


def test_a_run_without_avoidance_is_refused() -> None:
    episode = paper_figures.figure_run("fig7")
    free = replace(episode, ticks=episode.ticks[:3])
    with pytest.raises(InputError, match="avoids no obstacle"):
        fig7_fig8_trips.snapshots(free)


def test_convergence_quantiles_are_sorted_and_never_rise() -> None:
    found = convergence_curves.curves("F3", range(9))
    assert [curve.algorithm for curve in found] == list(Algorithm)
    for curve in found:
        low, middle, high = curve.error
        assert (low <= middle).all()
        assert (middle <= high).all()
        assert (np.diff(curve.error) <= 0.0).all()
        assert middle[-1] < FUNCTIONS["F3"]((4.0, 4.0))


# --- the command ----------------------------------------------------------------------------


def test_the_command_writes_the_chosen_figures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "new" / "figures"
    assert cli.main(["figures", "--only", "fig4", "fig5", "fig4", "--out", str(out)]) == 0
    assert sorted(p.name for p in out.iterdir()) == [
        "fig4.png", "fig4.svg", "fig5.png", "fig5.svg",
    ]  # fmt: skip
    assert (out / "fig4.png").read_bytes().startswith(b"\x89PNG")
    assert b"</svg>" in (out / "fig5.svg").read_bytes()
    assert "fig5.svg" in capsys.readouterr().out
    with pytest.raises(OutputError, match="never overwritten"):
        cli.main(["figures", "--only", "fig4", "--out", str(out)])


def test_unknown_names_are_refused_and_nothing_is_written(tmp_path: Path) -> None:
    out = str(tmp_path / "out")
    with pytest.raises(ConfigError, match="'fig3': no such figure"):
        cli.main(["figures", "--only", "fig3", "--out", out])
    with pytest.raises(ConfigError, match="'pdf': no such format"):
        cli.main(["figures", "--format", "svg,pdf", "--out", out])
    assert not (tmp_path / "out").exists()


def test_a_long_head_is_cut_and_unknown_characters_replaced() -> None:
    with style.context():
        sheet = Sheet(3.0, 2.0)
        sheet.head("a title " * 30, "漢字")
        title, subtitle = (text.get_text() for text in sheet.figure.texts)
        assert title.endswith("...")
        assert subtitle == "??"
        assert to_bytes(sheet.figure, "svg") == to_bytes(sheet.figure, "svg")
