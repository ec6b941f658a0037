"""Texts in pictures: quantities with their units; what files say as it is, never as formulas."""

import logging
import re
from collections.abc import Callable, Iterator
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.axis import Axis
from matplotlib.cbook import is_math_text
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import NullFormatter

from frictionsim.display import unit_text, with_unit
from frictionsim.plots import draw, draw_overlay
from frictionsim.plots.animation import animate
from frictionsim.plots.overlay import Overlaid
from frictionsim.plots.picture_file import parameters, png
from frictionsim.plots.style import Appearance, axis_label
from frictionsim.plots.sweep import draw_sweep
from frictionsim.plots.texts import literal
from frictionsim.plots.view import Extent
from frictionsim.results import Record
from tests.plots.test_cost_pictures import drawn as cost_of
from tests.plots.test_cost_pictures import row
from tests.plots.test_fit_picture import over_a_key
from tests.support import motions
from tests.support.cases import one_in, slow
from tests.support.records import drawn_views, picture, shown
from tests.support.sweeps import grid_of

BAD = r"$\frac$"  # no formula: matplotlib ends with an exception where it reads one


def hostile(name: str) -> Record:
    """Return a result all of whose texts are formulas that matplotlib cannot read."""
    record, kept = shown(name), ("kind", "scenario")
    return record._replace(
        attributes={k: v if k in kept else f"{v} {BAD}" for k, v in record.attributes.items()},
        units=dict.fromkeys(record.units, BAD),
        long_names=dict.fromkeys(record.long_names, BAD),
        members={k: tuple(f"{name} {BAD}" for name in v) for k, v in record.members.items()},
        contacts=[f"{name} {BAD}" for name in record.contacts],
    )


def texts_of(artist: Any) -> Iterator[Text]:
    """Yield the texts of a picture, with those that stand along axes now."""
    is_axis = isinstance(artist, Axis)
    for child in [artist.label, *artist.get_ticklabels()] if is_axis else artist.get_children():
        if isinstance(child, Text):
            yield child
        else:
            yield from texts_of(child)


def narrow() -> Figure:
    return draw(hostile("pulley"), appearance=Appearance.of(width="84mm", style="paper"))


def overlay() -> Figure:
    two = [Overlaid(name, hostile("pulley")) for name in (BAD, "b")]
    return draw_overlay(two, shown=Extent(channels=("angle",)))


def pictures() -> Iterator[Any]:
    for name, view in drawn_views():
        yield pytest.param(lambda n=name, v=view: draw(hostile(n), v), id=f"{name}-{view}")
    yield from (narrow, overlay)
    vary = {BAD: [f"a {BAD}", f"b {BAD}"]}
    values = {f"of {BAD}": lambda x: np.arange(len(x), dtype=float)}
    yield pytest.param(partial(draw_sweep, grid_of(vary, values)), id="sweep")
    costs = [row(BAD, 1e-9, 0.1), row(BAD, None, 0.01)]
    yield pytest.param(partial(cost_of, costs), id="cost")


@pytest.mark.parametrize("drawn", one_in(4, list(pictures())))
def test_no_text_of_a_file_is_read_as_a_formula(drawn: Callable[[], Figure]) -> None:
    formulas = [text for text in texts_of(drawn()) if r"\frac" in text.get_text()]
    assert formulas
    assert not [text.get_text() for text in formulas if text.get_parse_math()]


def test_a_title_stands_in_a_picture_letter_by_letter() -> None:
    title = "a $x_1^2$ \\$b$ \x1b[31m \u202eback\t\udcff"
    with mpl.rc_context({"svg.fonttype": "none"}):
        record = shown("pulley")
        record = record._replace(attributes=record.attributes | {"title": title})
        buffer = BytesIO()
        draw(record).savefig(buffer, format="svg")
    written = "a $x_1^2$ \\$b$ \\x1b[31m \\u202eback \\udcff (backend events)"
    assert f">{written}</text>" in buffer.getvalue().decode()


def test_powers_of_ten_along_an_axis_stay_raised() -> None:
    figure = cost_of([row("a", 1e-9, 0.1), row("a", 1e-3, 10.0)])
    axis = figure.axes[0].yaxis
    assert not isinstance(axis.get_major_formatter(), NullFormatter)
    assert all(is_math_text(text) for text in axis.get_major_formatter().format_ticks([1e-6]))
    ticks = [text.get_text() for text in axis.get_ticklabels() if text.get_text()]
    assert ticks
    assert all(text.startswith("$\\mathdefault{10^{") for text in ticks)


def test_texts_in_the_figure_of_the_caller_stay() -> None:
    figure = Figure(layout="constrained")
    own = figure.text(0.1, 0.1, "$x^2$")
    draw(hostile("pulley"), ax=figure.subplots())
    drawn = [text for text in texts_of(figure) if BAD in text.get_text()]
    assert own.get_parse_math()
    assert drawn
    assert not [text for text in drawn if text.get_parse_math()]


def test_tex_gets_no_commands() -> None:
    with parameters({"text.usetex": True}):
        assert literal(r"\input{/etc/passwd} 5% a_b $x^2$ ~#&") == (
            r"\textbackslash{}input\{/etc/passwd\} 5\% a\_b \$x\textasciicircum{}2\$"
            r" \textasciitilde{}\#\&"
        )


@pytest.mark.parametrize("unit", [BAD, slow("\x1b\u202e")])
def test_an_animation_shows_texts_as_they_are(unit: str, tmp_path: Path) -> None:
    time = np.linspace(0.0, 1.0, 5)
    record = motions.record_of("pulley", {"time": time, "angle": time, "angular_velocity": time})
    record = record._replace(units=dict.fromkeys(record.units, unit))
    record.attributes["title"] = unit
    animate(record, tmp_path / "a.gif", fps=2.0, speed=1.0)
    assert (tmp_path / "a.gif").read_bytes().startswith(b"GIF89a")


def test_nothing_is_logged_of_letters_that_are_drawn(caplog: pytest.LogCaptureFixture) -> None:
    figure = Figure()
    figure.text(0.1, 0.1, "$東$")
    with caplog.at_level(logging.WARNING):
        png(figure)
        assert not caplog.records
        figure.savefig(BytesIO())
    assert "does not have a glyph" in caplog.text


UNITS = "N m|rad/s²|rad/s|rad|m/s|m|N|s|%|J|kg m²"
WITHOUT = {  # numbers without a unit
    *("largest relative error", "right-hand-side evaluations", "turns from the horizontal"),
    *("runs", "part of the variance", "mu s", "effects.friction.mu_s", "run"),
    "tension of the counterweight over that of the car",
}


def sweeps() -> Iterator[Callable[[], Figure]]:
    units = {"mu_s": "1", "inertia": "kg m^2", "force": "N"}
    number = {"effects.friction.mu_s": np.linspace(0.1, 0.3, 6)}
    other = number | {"load.force": np.linspace(1.0, 3.0, 6)}
    flat = {name: lambda x: np.sin(9.0 * x) for name in units}
    both = {name: lambda x, y: np.sin(9.0 * x) * y for name in units}

    def with_units(table: Any) -> Any:
        table.units.update(units)
        keys = {"effects.friction.mu_s": "1", "load.force": "N"}
        for key, coordinate in table.coordinates.items():
            table.coordinates[key] = coordinate._replace(unit=keys[key])
        return table

    yield lambda: draw_sweep(with_units(grid_of(number, flat)))
    yield lambda: draw_sweep(with_units(grid_of(other, both)))


def labelled() -> Iterator[Any]:
    for name, view in drawn_views():
        yield pytest.param(partial(picture, name, view), id=f"{name}-{view}")
    yield from sweeps()
    yield lambda: cost_of([row("a", 1e-9, 0.1), row("a", None, 0.01)])
    yield lambda: over_a_key().plot()


@pytest.mark.parametrize("drawn", one_in(2, list(labelled())))
def test_every_axis_says_quantity_and_unit(drawn: Callable[[], Figure]) -> None:
    axes = drawn().axes
    labels = [label for ax in axes for label in (ax.get_xlabel(), ax.get_ylabel()) if label]
    assert labels
    for label in labels:
        if " ".join(label.split()) not in WITHOUT:
            assert re.fullmatch(rf"[^,]+,[ \n]({UNITS})", label), label


def test_a_unit_stands_beside_the_last_word_of_a_label() -> None:
    assert axis_label("force", "N") == "force, N"
    assert axis_label("mu_s", "1") == axis_label("mu_s") == "mu_s"
    assert axis_label("angular velocity", "rad/s", 18) == "angular\nvelocity, rad/s"
    assert axis_label("residual", "rad/s", 12) == "residual,\nrad/s"
    assert axis_label("drive force", "N", 18) == "drive force, N"
    assert axis_label("inertia of the gear", "kg m^2", 12) == "inertia of\nthe\ngear, kg m²"
    assert axis_label("at the scale of the load", "N m", 18) == "at the scale of\nthe load, N m"
    assert axis_label("a$b$", "N") == "a$b$, N"


def test_exponents_are_raised() -> None:
    assert unit_text("kg m^2") == "kg m²"
    assert unit_text("s^-1") == "s⁻¹"
    assert (unit_text("1"), unit_text("")) == ("", "")
    assert (with_unit("3", "1"), with_unit("3", "m^3")) == ("3", "3 m³")
