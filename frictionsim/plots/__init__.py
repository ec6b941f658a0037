"""Pictures of results; the only package that imports matplotlib.

A kind of mechanism has one or more views; the first is the default. A kind of another package may
have a mapping VIEWS in its module, of functions of a record and a figure; its channels over time
are drawn in any case.

`draw` returns a matplotlib figure, which needs no pyplot: a notebook shows it as the value of a
cell, `figure.savefig(path)` saves it.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.errors import ArgumentError, InputError
from frictionsim.plots import belt, kinds
from frictionsim.plots.friction import friction
from frictionsim.plots.kinds import OVER_TIME, View
from frictionsim.plots.mechanism import draw_mechanism
from frictionsim.plots.over_time import (
    MAX_PANELS,
    WHOLE,
    check_channel,
    over_time,
    panels_of,
)
from frictionsim.plots.style import MAX_LINES, add_legend, check_drawn, new_figure
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.toml_data import scenario_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.results import Record

ALL = "all"
RESPONSE = View(kinds.response, OVER_TIME, overlaid=())
Views = Mapping[str, View]
"""By name, the default first."""


MECHANISM = View(draw_mechanism, ("time",))
FRICTION = View(friction, ("window",))
VIEWS: Mapping[str, Views] = {
    "pulley": {
        "response": RESPONSE,
        "friction": FRICTION,
        "traction": View(kinds.traction, ("window",), effect="cord_friction"),
        "mechanism": MECHANISM,
    },
    "marble_machine": {
        "response": RESPONSE,
        "friction": FRICTION,
        "torque": View(kinds.torque_of_machine, ("window",)),
        "mechanism": MECHANISM,
    },
    "epicyclic": {
        "response": RESPONSE,
        "friction": FRICTION,
        "torque": View(kinds.torque_of_gear, ("window",)),
        "path": View(kinds.path, ("time",)),
        "mechanism": MECHANISM,
    },
    "shaft": {
        "response": RESPONSE,
        "friction": FRICTION,
        "friction_circle": MECHANISM,
    },
    "belt_drive": {
        "speeds": View(belt.speeds, OVER_TIME, overlaid=("pulley_speed", "pulley_torque")),
        "drive": MECHANISM,
        "tension": View(belt.tension, ("time",)),
        "body": View(belt.body, ("window", "body")),
        "friction": View(belt.friction, effect="belt_friction"),
        "wear": View(belt.wear, ("time",), effect="wear"),
    },
}


def views_of(kind: str) -> Views:
    """Return the views of a kind by name, the default first."""
    if kind in VIEWS:
        return VIEWS[kind]
    try:
        module = mechanism_module(kind)
    except InputError as error:
        raise InputError(f"cannot draw this result: {error}") from None
    own = getattr(module, "VIEWS", {})
    return {"response": RESPONSE} | {name: View(draw) for name, draw in own.items()}


def view_of(kind: str, name: str | None, given: Mapping[str, Any]) -> View:
    """Return a view, by default the first, that takes the given options."""
    views = views_of(kind)
    name = name or next(iter(views))
    if name not in views:
        raise InputError(f"unknown view '{name}' of kind '{kind}'; known: {', '.join(views)}")
    for option in given:
        if option not in views[name].options:
            raise ArgumentError(option, f"the view '{name}' {_refusal(kind, option)}")
    return views[name]


def _refusal(kind: str, option: str) -> str:
    """Return which views take an option that another one does not."""
    fit = [name for name, view in views_of(kind).items() if option in view.options]
    if not fit:
        return f"does not take that, nor does another one of kind '{kind}'"
    return f"does not take that; the view {' or '.join(map(repr, fit))} does"


def applicable(record: "Record", given: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the views whose effects a result has, each with what it can show of what is given.

    One of the kind must be able to show each.
    """
    kind = record.attributes["kind"]
    views = views_of(kind)
    for option in given:
        if option != "body" and not any(option in view.options for view in views.values()):
            view_of(kind, None, {option: given[option]})
    effects = scenario_of(record).get("effects", {})
    return {
        name: {option: value for option, value in given.items() if option in view.options}
        for name, view in views.items()
        if not view.effect or view.effect in effects
    }


def draw(
    record: "Record",
    view: str | None = None,
    figure: "Figure | SubFigure | None" = None,
    **given: Any,
) -> Any:
    """Draw a view of a result, by default the first, into an empty figure or a new one; return it.

    `given` are time, s, of an instant; window, s, channels, and measured values of some of them, of
    a view over time; body of a belt.
    """
    chosen = view_of(record.attributes["kind"], view, given)
    if not record.channels["time"].size:
        raise InputError("cannot draw this result: it has no samples")
    check_drawn("result", record.channels, record.events)
    if chosen.effect and chosen.effect not in scenario_of(record).get("effects", {}):
        raise InputError(
            f"cannot draw the view '{view}': the scenario of this result has no"
            f" [effects.{chosen.effect}]"
        )
    if "time" in given:
        given["sample"] = sample_at(record, given.pop("time"))
    if measured := given.get("measured", ()):
        names = [*given.get("channels", ()), *(one.name.partition(".")[0] for one in measured)]
        given["channels"] = tuple(dict.fromkeys(names))
    figure = new_figure() if figure is None else figure
    chosen.draw(record, figure, **given)
    return figure


def sample_at(record: "Record", time: float) -> int:
    """Return the number of the last sample that is not after a time, s."""
    samples = np.asarray(record.time)
    if not samples[0] <= time <= samples[-1]:
        raise ArgumentError(
            "time",
            f"expected a time from {samples[0]:.6g} s to {samples[-1]:.6g} s, which this result"
            f" has samples of, got {time:g} s",
        )
    return int(np.searchsorted(samples, time, side="right")) - 1


def check_count(count: int) -> None:
    """Check that so many results can be drawn into the same panels."""
    if count > MAX_LINES:
        raise InputError(
            f"cannot draw {count} results over each other: {MAX_LINES} are the most that"
            " can be told apart; give fewer, or run them as a sweep"
        )


def views_of_several(kind: str) -> list[str]:
    """Return the views of a kind in which several results are drawn over each other."""
    return [name for name, view in views_of(kind).items() if view.overlaid is not None]


def view_of_several(kind: str, name: str | None) -> View:
    """Return a view in which several results are drawn over each other."""
    view = view_of(kind, name, {})
    if view.overlaid is None:
        named = " or ".join(map(repr, views_of_several(kind)))
        raise InputError(
            f"the view '{name}' cannot show several results over each other"
            + (f"; the view {named} can" if named else "")
        )
    return view


def draw_several(
    records: Sequence["Record"],
    names: Sequence[str],
    view: str | None = None,
    figure: "Figure | SubFigure | None" = None,
    channels: Sequence[str] = (),
    window: Any = WHOLE,
) -> Any:
    """Draw results of one kind over each other, over time; return the figure.

    Each channel, and each member of a channel that they have in common, has a panel with a line for
    each result.
    """
    first = records[0]
    chosen = view_of_several(first.attributes["kind"], view)
    for record in records:
        check_drawn("result", record.channels, record.events)
        for name in channels:
            check_channel(record, name)
    wanted = [next(iter(of)) for of in panels_of(first, channels or chosen.overlaid or ()).values()]
    panels: dict[str, dict[str, str]] = {}
    for name in wanted:
        if all(name in record.channels for record in records):
            axis, words = first.axes[name], name.replace("_", " ")
            members = [record.members[axis] if axis else ("",) for record in records]
            common = [one for one in members[0] if all(one in others for others in members)]
            panels |= {f"{words}, {one}" if axis else words: {name: one} for one in common}
    if not panels:
        raise InputError(
            f"these results have none of the channels {', '.join(wanted)}, or no member of them, in"
            " common (see output.channels)"
        )
    if len(panels) > MAX_PANELS:
        raise ArgumentError(
            "channels",
            f"expected at most {MAX_PANELS} panels, got {len(panels)}, one for each channel and"
            " member; choose fewer channels",
        )
    figure = new_figure() if figure is None else figure
    _, handles = over_time(records, panels, figure, names=names, window=window)
    add_legend(figure, handles)
    return figure
