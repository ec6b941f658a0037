"""Sizes, styles, fonts and texts of pictures: what files say stands as it is, never as formulas."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

import frictionsim as fs
from frictionsim.results import Record
from tests.support.cases import one_in
from tests.support.records import draw, drawn_views, picture, png, shown
from tests.support.sweeps import grid_of

MM = 25.4  # per inch
BAD = r"$\frac$"  # no formula: matplotlib ends with an exception where it reads one


def hostile(name: str) -> Record:
    """Return a result all of whose texts are formulas that matplotlib cannot read."""
    record, kept = shown(name), ("kind", "scenario")
    return record._replace(
        attributes={k: v if k in kept else f"{v} {BAD}" for k, v in record.attributes.items()},
        units=dict.fromkeys(record.units, BAD),
        members={k: tuple(f"{name} {BAD}" for name in v) for k, v in record.members.items()},
        contacts=[f"{name} {BAD}" for name in record.contacts],
    )


def pictures() -> Iterator[Callable[[], Figure]]:
    for name, view in drawn_views():
        yield lambda n=name, v=view: draw(hostile(n), v)
    yield lambda: draw(hostile("pulley"), width="84mm", style="paper")
    yield lambda: fs.plot([fs.Result(hostile("pulley"), Path(f"{BAD}{i}")) for i in (1, 2)])
    values = {f"of {BAD}": lambda x: np.arange(len(x), dtype=float)}
    yield lambda: fs.plot(fs.Sweep(grid_of({BAD: [f"a {BAD}", f"b {BAD}"]}, values)))


@pytest.mark.parametrize("drawn", one_in(6, list(pictures())))
def test_no_text_of_a_file_is_read_as_a_formula(drawn: Callable[[], Figure]) -> None:
    figure = drawn()
    figure.draw_without_rendering()
    assert [text for text in figure.findobj(Text) if r"\frac" in text.get_text()]


def test_a_title_stands_in_a_picture_letter_by_letter(tmp_path: Path) -> None:
    record = shown("pulley")
    record = record._replace(
        attributes=record.attributes | {"title": "a $x^2$ \x1b[31m \u202eback"}
    )
    fs.Result(record).save_picture(tmp_path / "a.svg")
    written = "a $x^2$ \\x1b[31m \\u202eback (backend events)"
    assert f">{written}</text>" in (tmp_path / "a.svg").read_text(encoding="utf-8")


UNITS = "N m|rad/s²|rad/s|rad|m/s|m|N|s|%|J|kg m²"
WITHOUT = {  # numbers without a unit
    "turns from the horizontal",
    "counterweight's tension / car's",
    "friction over its static limit",
}


@pytest.mark.parametrize(("name", "view"), one_in(4, drawn_views()))
def test_every_axis_says_quantity_and_unit(name: str, view: str) -> None:
    axes = picture(name, view).axes
    labels = [label for ax in axes for label in (ax.get_xlabel(), ax.get_ylabel()) if label]
    for label in labels:
        if " ".join(label.split()) not in WITHOUT:
            assert re.fullmatch(rf"[^,]+,[ \n]({UNITS})", label.replace("\n", " ")), label


def test_fonts_are_truetype_text_is_text_and_files_have_no_date(tmp_path: Path) -> None:
    result = fs.Result(shown("epicyclic"))
    for name in ("a.pdf", "a.svg", "b.svg"):
        result.save_picture(tmp_path / name)
    pdf, svg, again = ((tmp_path / name).read_bytes() for name in ("a.pdf", "a.svg", "b.svg"))
    assert re.search(rb"/Subtype /(Type0|TrueType)", pdf)
    assert b"/Type3" not in pdf
    assert b"CreationDate" not in pdf
    assert svg == again
    assert re.search(rb"<text [^>]*>angle, rad</text>", svg)


def test_the_settings_of_the_user_change_no_picture() -> None:
    before = png(draw(shown("epicyclic"), "torque"))
    own: Any = {"font.family": ["serif"], "font.size": 13.0, "text.usetex": True}
    with mpl.rc_context(own):
        assert png(draw(shown("epicyclic"), "torque")) == before
        assert mpl.rcParams["font.size"] == 13.0


def test_paper_has_small_type_and_thin_lines() -> None:
    figure, usual = (draw(shown("pulley"), style=style) for style in ("paper", "screen"))
    for size, one in ((8.0, figure), (10.0, usual)):
        assert one.axes[0].yaxis.label.get_fontsize() == size
    assert figure.axes[1].lines[0].get_linewidth() < usual.axes[1].lines[0].get_linewidth()
    for width in ("84mm", "8.4 cm", "3.3070866in", "238.1102pt"):
        narrow = draw(shown("pulley"), style="paper", width=width)
        assert narrow.get_figwidth() == pytest.approx(84 / MM)
    assert narrow.get_figheight() < usual.get_figheight()
