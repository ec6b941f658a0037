"""Labels of axes: a quantity and its unit are written in one way in all pictures."""

import re
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from frictionsim.plots import draw
from frictionsim.plots.style import axis_label, unit_text, with_unit
from frictionsim.plots.sweep import draw_sweep
from tests.plots.test_cost_pictures import drawn as cost_of
from tests.plots.test_cost_pictures import row
from tests.plots.test_fit_picture import over_a_key
from tests.support.records import drawn_views, shown
from tests.support.sweeps import grid_of

UNITS = "N m|rad/s²|rad/s|rad|m/s|m|N|s|%|J|kg m²"
WITHOUT = {  # numbers without a unit
    *("largest relative error", "right-hand-side evaluations", "turns from the horizontal"),
    *("runs", "part of the variance", "mu s", "effects.friction.mu_s", "run"),
    "tension of the counterweight over that of the car",
}


def drawn(name: str, view: str) -> Figure:
    return draw(shown(name), view)


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


def pictures() -> Iterator[Any]:
    for name, view in drawn_views():
        yield pytest.param(partial(drawn, name, view), id=f"{name}-{view}")
    yield from sweeps()
    yield lambda: cost_of([row("a", 1e-9, 0.1), row("a", None, 0.01)])
    yield lambda: over_a_key().plot()


@pytest.mark.parametrize("picture", list(pictures()))
def test_every_axis_says_quantity_and_unit(picture: Callable[[], Figure]) -> None:
    axes = picture().axes
    labels = [label for ax in axes for label in (ax.get_xlabel(), ax.get_ylabel()) if label]
    assert labels
    for label in labels:
        if " ".join(label.split()) not in WITHOUT:
            assert re.fullmatch(rf"[^,]+,[ \n]({UNITS})", label), label


def test_a_label_is_broken_before_its_unit_only_where_it_is_too_long() -> None:
    assert axis_label("force", "N") == "force, N"
    assert axis_label("mu_s", "1") == axis_label("mu_s") == "mu_s"
    assert axis_label("angular velocity", "rad/s", 18) == "angular velocity,\nrad/s"
    assert axis_label("drive force", "N", 18) == "drive force, N"
    assert axis_label("inertia of the gear", "kg m^2", 12) == "inertia of\nthe gear,\nkg m²"
    assert axis_label("at the scale of the load", "N m", 18) == "at the scale of\nthe load, N m"
    assert axis_label("a$b$", "N") == "a$b$, N"


def test_exponents_are_raised() -> None:
    assert unit_text("kg m^2") == "kg m²"
    assert unit_text("s^-1") == "s⁻¹"
    assert (unit_text("1"), unit_text("")) == ("", "")
    assert (with_unit("3", "1"), with_unit("3", "m^3")) == ("3", "3 m³")
