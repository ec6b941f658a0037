"""Pictures for papers: size, fonts, style and title; nothing overlaps or leaves the picture."""

import re
import struct
from itertools import combinations
from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from frictionsim.errors import InputError
from frictionsim.plots import draw, save
from frictionsim.plots.picture_file import parameters, png
from frictionsim.plots.style import Appearance, add_legend, set_title, title_height
from frictionsim.plots.texts import text_width, wrapped
from tests.support.belt_results import Pulley, belt_run
from tests.support.cases import one_in, slow
from tests.support.records import drawn_views, shown

# Of belts four pulleys need more room than two.
NAMES = ("pulley_return", "marble_machine", "epicyclic", "hoist_drum", "four pulleys")
MM = 25.4  # per inch


def boxes_of(figure: Figure) -> list[tuple[str, Any]]:
    """Return the texts of a drawn figure with their boxes; of ticks those that have a number."""
    texts: list[Any] = list(figure.texts)
    for legend in figure.legends:
        texts += legend.get_texts()
    for ax in figure.axes:
        texts += [ax.title, ax._left_title, *ax.texts]  # type: ignore[attr-defined]
        if ax.axison:
            texts += [ax.xaxis.label, ax.yaxis.label]
            for axis in (ax.xaxis, ax.yaxis):
                low, high = sorted(axis.get_view_interval())
                labels = zip(axis.get_majorticklocs(), axis.get_ticklabels(), strict=False)
                texts += [label for at, label in labels if low <= at <= high]
    return [
        (text.get_text(), text.get_window_extent())
        for text in texts
        if text.get_visible() and text.get_text()
    ]


def check_texts(figure: Figure) -> None:
    """Check that no text overlaps another or leaves the figure, by a pixel and a half."""
    boxes, page = boxes_of(figure), figure.bbox
    for text, box in boxes:
        inside = box.x0 > page.x0 - 1.5, box.x1 < page.x1 + 1.5
        assert (*inside, box.y0 > page.y0 - 1.5, box.y1 < page.y1 + 1.5) == (True,) * 4, text
    for (text, one), (other, two) in combinations(boxes, 2):
        wide = min(one.x1, two.x1) - max(one.x0, two.x0)
        high = min(one.y1, two.y1) - max(one.y0, two.y0)
        assert min(wide, high) < 1.5, (text, other)


@pytest.mark.parametrize(
    ("name", "view", "style"),
    one_in(
        5,
        [
            *((name, view, None) for name, view in drawn_views(NAMES)),
            ("pulley_return", "response", "paper"),
        ],
    ),
)
def test_texts_of_a_narrow_picture_are_apart_and_inside(
    name: str, view: str, style: str | None
) -> None:
    figure = draw(shown(name), view, appearance=Appearance.of(width="84mm", style=style))
    assert figure.get_figwidth() == pytest.approx(84 / MM)
    check_texts(figure)
    sizes = {text.get_fontsize() for legend in figure.legends for text in legend.get_texts()}
    assert {round(size, 1) for size in sizes} == {8.3 if style is None else 6.7}


@pytest.mark.parametrize(
    ("name", "view", "appearance"),
    [
        slow("four pulleys", "drive", {"width": "174mm"}),
        slow("four pulleys", "body", {"width": "174mm"}),
        ("marble_machine", "torque", {"style": "talk"}),
    ],
)
def test_texts_of_wide_pictures_and_large_type_are_apart(
    name: str, view: str, appearance: dict[str, Any]
) -> None:
    check_texts(draw(shown(name), view, appearance=Appearance.of(**appearance)))


FIVE = (
    Pulley("crankshaft", 0.0, 0.0, 0.08),
    Pulley("air_conditioner", 0.3, -0.02, 0.05),
    Pulley("power_steering", 0.33, 0.2, 0.05),
    Pulley("generator", 0.15, 0.33, 0.03),
    Pulley("water_pump", -0.03, 0.3, 0.06),
)


def points_on(lines: LineCollection) -> np.ndarray:
    """Return dense points on lines, in pixels."""
    segments = [np.linspace(s[:-1], s[1:], 20).reshape(-1, 2) for s in lines.get_segments()]
    return np.asarray(lines.get_transform().transform(np.concatenate(segments)))


@pytest.mark.parametrize(
    "appearance", [{}, slow({"width": "84mm", "style": "paper"}), slow({"style": "talk"})]
)
def test_names_of_pulleys_are_within_the_frame_beside_the_belt(appearance: dict[str, Any]) -> None:
    figure = draw(belt_run(FIVE), "drive", appearance=Appearance.of(**appearance))
    if not appearance:
        figure.draw_without_rendering()
    check_texts(figure)
    whole, frame = figure.axes[0], figure.axes[0].get_window_extent()
    names = [text for text in whole.texts if text.get_text() in {p.name for p in FIVE}]
    assert len(names) == len(FIVE)
    belt = np.concatenate(
        [points_on(c) for c in whole.collections if isinstance(c, LineCollection)]
    )
    for name in names:
        box = name.get_window_extent()
        assert all(frame.contains(*corner) for corner in box.corners()), name
        inside = (belt > [box.x0, box.y0]) & (belt < [box.x1, box.y1])
        assert not inside.all(axis=1).any(), name


def test_curves_of_five_pulleys_differ_without_colour_and_their_details_fill_two_rows() -> None:
    lines = draw(belt_run(FIVE), "speeds").axes[0].lines
    assert len({str(line._dash_pattern) for line in lines}) == 5
    details = [ax for ax in draw(belt_run(FIVE), "drive").axes if not ax.axison]
    rows = [ax.get_subplotspec().rowspan.start for ax in details]
    assert rows == [1, 1, 1, 2, 2]


def test_a_png_has_its_width_and_resolution(tmp_path: Path) -> None:
    appearance = Appearance.of(width="84mm", dpi=150.0)
    save(
        draw(shown("epicyclic"), "torque", appearance=appearance),
        tmp_path / "a.png",
        appearance.dots_per_inch,
    )
    data = (tmp_path / "a.png").read_bytes()
    width, _ = struct.unpack(">II", data[16:24])
    assert abs(width - 84 / MM * 150) <= 1.0
    x, y, unit = struct.unpack(">IIB", data.split(b"pHYs")[1][:9])
    assert (x, y, unit) == (round(150 / 0.0254), round(150 / 0.0254), 1)
    usual = png(draw(shown("epicyclic"), "torque", appearance=Appearance.of(width="84mm")))
    assert np.frombuffer(usual[16:20], ">u4")[0] == int(84 / MM * 100)


@pytest.mark.parametrize("style", [None, slow("talk")])
def test_fonts_are_truetype_and_text_is_text(style: str | None, tmp_path: Path) -> None:
    appearance = Appearance.of(style=style)
    figure = draw(shown("epicyclic"), "torque", appearance=appearance)
    for name in ("a.pdf", "a.svg"):
        save(figure, tmp_path / name)
    pdf, svg = (tmp_path / "a.pdf").read_bytes(), (tmp_path / "a.svg").read_text(encoding="utf-8")
    assert re.search(rb"/Subtype /(Type0|TrueType)", pdf)
    assert b"/Type3" not in pdf
    assert b"/FontFile2" in pdf
    assert b"CreationDate" not in pdf
    assert "<dc:date>" not in svg
    assert re.search(r"<text [^>]*>torque on the crank, N m</text>", svg)


def test_a_figure_that_the_user_saves_has_such_fonts_too(tmp_path: Path) -> None:
    before = dict(mpl.rcParams)
    draw(shown("epicyclic"), "torque", appearance=Appearance.of(style="paper")).savefig(
        tmp_path / "a.pdf"
    )
    assert b"/Type3" not in (tmp_path / "a.pdf").read_bytes()
    assert dict(mpl.rcParams) == before


OF_USER = {"font.family": ["serif"], "font.size": 13.0, "axes.facecolor": "#ffeeee"}


@pytest.mark.parametrize("style", [None, slow("user")])
def test_only_the_style_user_takes_the_settings_of_the_user(style: str | None) -> None:
    def drawn() -> Figure:
        return draw(shown("epicyclic"), "torque", appearance=Appearance.of(style=style))

    plain = png(drawn())
    # Without the style not even those that need LaTeX.
    with parameters(OF_USER | {"text.usetex": style is None}):
        changed = drawn()
        inside = png(changed)
    assert (inside == plain) == (style != "user")
    # What is drawn later has not.
    assert png(drawn()) == plain
    if style == "user":
        assert changed.axes[0].xaxis.label.get_fontsize() == 13.0


def test_latex_that_is_not_there_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    message = r"user's settings of matplotlib: text\.usetex needs"
    with parameters({"text.usetex": True}), pytest.raises(InputError, match=message):
        draw(shown("epicyclic"), "torque", appearance=Appearance.of(style="user"))


def test_lines_are_thin_on_paper_and_thick_in_talks() -> None:
    widths = [
        draw(shown("epicyclic"), "torque", appearance=Appearance.of(style=style)).axes[0].lines[0]
        for style in ("paper", None, "talk")
    ]
    thin, usual, thick = (line.get_linewidth() for line in widths)
    assert (usual, thin < 1.0, thick > 2.5) == (1.5, True, True)


def test_each_line_of_a_title_makes_a_picture_higher() -> None:
    short, long = Figure(figsize=(2.4, 1.0)), Figure(figsize=(2.4, 1.0))
    set_title(short, "one", 3.0)
    set_title(long, "some words " * 8, 3.0)
    further = long.get_suptitle().count("\n")
    assert further > 1
    assert long.get_figheight() - short.get_figheight() == pytest.approx(
        further * title_height("one")
    )
    narrow, bare = (
        draw(shown("epicyclic"), "torque", appearance=Appearance.of(width="60mm", title=title))
        for title in (True, False)
    )
    assert bare.get_suptitle() == ""
    shown_title = title_height(narrow.get_suptitle())
    assert narrow.get_figheight() - bare.get_figheight() == pytest.approx(shown_title)


@pytest.mark.parametrize("text", ["84mm", "8.4cm", "8.4 cm", "3.3070866in", "238.1102pt"])
def test_lengths_in_four_units(text: str) -> None:
    assert Appearance.of(width=text).width == pytest.approx(84 / MM)


def test_a_view_in_the_place_of_axes_may_have_no_title() -> None:
    _, ax = plt.subplots(layout="constrained")
    figure = draw(shown("epicyclic"), ax=ax, appearance=Appearance(title=False))
    assert figure.subfigs[0].get_suptitle() == ""
    plt.close(figure)


def test_a_legend_leaves_panels_their_height_and_breaks_long_labels() -> None:
    figure = Figure(figsize=(2.0, 2.0), layout="constrained")
    lines = [figure.subplots().plot([0.0], label="a label of a good many words and more")[0]]
    figure.draw_without_rendering()
    panel = figure.axes[0].get_window_extent().height
    add_legend(figure, lines)
    figure.draw_without_rendering()
    # The panel keeps its height, but for the space between it and the legend.
    assert figure.axes[0].get_window_extent().height == pytest.approx(panel, rel=0.1)
    assert "\n" in figure.legends[0].get_texts()[0].get_text()
    assert figure.legends[0].get_window_extent().x0 >= 0.0


def test_texts_are_broken_at_words_and_words_where_they_must() -> None:
    text = "speed of 12.5 rad/s, torque of 3 N m"
    lines = wrapped(text, text_width("torque of 3 N m ", 10.0), 10.0).split("\n")
    assert " ".join(lines) == text
    assert not any(line.endswith(("12.5", "3", "N")) for line in lines), lines
    assert len(wrapped("ж" * 30, 60.0, 10.0).split("\n")) > 3
