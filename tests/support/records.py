"""Runs as the records that pictures are made of, each read from its file once."""

from collections.abc import Iterable
from functools import cache
from typing import Any

from matplotlib.figure import Figure
from matplotlib.text import Text

import frictionsim as fs
from frictionsim.results import Record
from tests.support.scenarios import Scenario, shipped, simulate

BELTS = ("belt_string", "belt_tensioner")  # of two pulleys, and of four with one on the back
# Of each kind, the one that is drawn by default first.
VIEWS = {
    "pulley": ("response", "friction", "traction", "mechanism"),
    "marble_machine": ("response", "friction", "torque", "mechanism"),
    "epicyclic": ("response", "friction", "torque", "path"),
    "shaft": ("response", "friction", "friction_circle"),
    "belt_drive": ("speeds", "drive", "tension", "body"),
}
# All kinds with their effects that change a picture.
DRAWN = ("pulley_return", "lift", "marble_machine", "epicyclic", "swing_door", *BELTS)


def draw(record: Record, view: str | None = None, **options: Any) -> Figure:
    """Return a picture of a record; options are those of `fs.plot`."""
    return fs.plot(fs.Result(record), view, **options)


def png(figure: Figure) -> bytes:
    """Return a picture as a notebook shows it."""
    image: bytes = figure._repr_png_()  # type: ignore[attr-defined]
    return image


@cache
def shown(name: str, **changes: Any) -> Record:
    """Return a run of a shipped scenario, of a belt as `guided` has it, with such changes."""
    return simulate((guided if name in BELTS else shipped)(name, **changes))


def guided(name: str = "belt_string", **changes: Any) -> Scenario:
    """Return a shipped belt as data, as a string and short, by its fast method: it takes 0.2 s."""
    across = {"effects__contact": None, "effects__bending": None}
    fast = {"solver__backend": "moreau", "solver__duration": 0.3}
    return shipped(name, **{**across, **fast, **changes})


@cache
def picture(name: str, view: str | None = None) -> Figure:
    """Return a picture of a record, for tests that neither change nor render it."""
    return draw(shown(name), view)


def views_of_record(name: str) -> list[str]:
    """Return the views that a shipped scenario has."""
    # Of the lifts alone the cord may slip.
    return [view for view in VIEWS[shipped(name)["kind"]] if name == "lift" or view != "traction"]


def drawn_views(names: Iterable[str] = DRAWN) -> list[tuple[str, str]]:
    """Return the results of all kinds, each with each of its views."""
    return [(name, view) for name in names for view in views_of_record(name)]


def with_channels(record: Record, **channels: Any) -> Record:
    return record._replace(channels=record.channels | channels)


def without(record: Record, *names: str) -> Record:
    return record._replace(channels={k: v for k, v in record.channels.items() if k not in names})


def with_scenario(record: Record, text: str) -> Record:
    return record._replace(attributes=record.attributes | {"scenario": text})


def words_of(figure: Figure) -> str:
    """Return the texts of a picture, a line each."""
    return "\n".join(text.get_text() for text in figure.findobj(Text))
