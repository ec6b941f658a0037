"""Pictures of result files; the only package that imports matplotlib.

A kind of mechanism has one or more views, see `frictionsim.plots.view`. The first is the default.
Those of a kind of this program are VIEWS of the module of its name here. A kind of another package
may have a mapping VIEWS in its module; without one, its channels are drawn over time.

`draw` returns a matplotlib figure, which needs no pyplot: a notebook shows it as the value of a
cell, `figure.savefig(path)` saves it, and it can be pickled. Threads may draw and save different
figures at once; `save` writes the same bytes as in one thread.
"""

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any

import frictionsim.plots.picture_file  # noqa: F401  says what matplotlib lacks
from frictionsim.errors import ArgumentError, InputError
from frictionsim.plots.belt_geometry import middle_of_first_span
from frictionsim.plots.overlay import Overlaid, check_overlay, overlay
from frictionsim.plots.picture_file import save
from frictionsim.plots.placement import drawn_in
from frictionsim.plots.style import USUAL, Appearance
from frictionsim.plots.time_history import response
from frictionsim.plots.view import (
    BODY,
    WHOLE,
    Extent,
    View,
    check_channels,
    check_numbers,
    over_time,
    until,
    within,
)
from frictionsim.scenario.kinds import KINDS, mechanism_module
from frictionsim.scenario.toml_data import scenario_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from frictionsim.results import Record

__all__ = ["ALL", "BODY", "VIEWS", "Views", "draw", "save", "views_of"]

ALL = "all"

Views = Mapping[str, View]
"""By name, the default first."""

VIEWS: Mapping[str, Views] = {kind: import_module(f"{__name__}.{kind}").VIEWS for kind in KINDS}


def check_view(kind: str, view: str) -> None:
    """Check that a kind has a view."""
    views = views_of(kind)
    if view not in views:
        raise InputError(f"unknown view '{view}' of kind '{kind}'; known: {', '.join(views)}")


def check_applies(kind: str, view: str, shown: Extent) -> None:
    """Check that a view can show a part of a result."""
    views = views_of(kind)
    words = {
        "time": "shows no single instant",
        "window": "does not go over time",
        "channels": "draws channels of its own",
    }
    for part, given in shown.given.items():
        if not given or views[view].shows(part):
            continue
        fit = [name for name, other in views.items() if other.shows(part)]
        way_out = f"it is for the view {' or '.join(map(repr, fit))}"
        if not fit:
            way_out = f"no view of kind '{kind}' does; give a window of time instead"
        raise ArgumentError(part, f"the view '{view}' {words[part]}; {way_out}")


def views_of(kind: str) -> Views:
    """Return the views of a kind by name, the default first."""
    if kind in VIEWS:
        return VIEWS[kind]
    try:
        module = mechanism_module(kind)
    except InputError as error:
        raise InputError(f"cannot draw this result: {error}") from None
    own: Mapping[str, View | Callable[..., None]] = getattr(module, "VIEWS", {})
    views = {name: of if isinstance(of, View) else View(of) for name, of in own.items()}
    return {"response": over_time(response)} | views


def draw(
    result: "Record",
    view: str | None = None,
    body: int | None = None,
    ax: Any = None,
    appearance: Appearance = USUAL,
    shown: Extent = WHOLE,
) -> "Figure":
    """Draw a view of a result as a matplotlib figure.

    Show it as the value of a notebook's cell; save it with `figure.savefig("a.png")`. A figure of
    the caller gets constrained layout, as `plt.subplots(2, 2, layout="constrained")` has; a part of
    it should be at least 5 inches wide and high.

    Parameters
    ----------
    result : Record
    view : str, optional
        One of `views_of` the kind; the default is the first.
    body : int, optional
        Number of the body of a belt that the view `body` shows.
    ax : Axes, optional
        Empty Axes of a grid, as of `plt.subplots`: the view takes their place.
    appearance : Appearance
        Size and style of a new figure.
    shown : Extent
        The time, window or channels that are drawn.

    Returns
    -------
    Figure
        The whole figure, also if the view is drawn into a part of it.
    """
    kind = result.attributes["kind"]
    views = views_of(kind)
    view = view or next(iter(views))
    check_view(kind, view)
    if body is not None and not views[view].body:
        raise ArgumentError(
            "body", f"the view '{view}' shows no single body; it is for the view '{BODY}'"
        )
    if not result.channels["time"].size:
        raise InputError("cannot draw this result: it has no samples")
    check_applies(kind, view, shown)
    check_numbers(result)
    part, options = _part(result, views[view], shown)
    if body is not None:
        options[BODY] = body
    if shown.channels:
        check_channels(result, shown.channels)
        options["channels"] = shown.channels
    return drawn_in(
        lambda target: views[view].draw(part, target, **options),
        ax,
        appearance=_fitted(appearance, shown),
    )


def _part(result: "Record", view: View, shown: Extent) -> tuple["Record", dict[str, Any]]:
    """Return the part of a result that a view shows, and options of the view for it."""
    if shown.time is not None:
        part = until(result, shown.time)
        return (result, {"instant": part}) if view.whole else (part, {})
    if not shown.has_window:
        return result, {}
    options: dict[str, Any] = {}
    if view.body and "pulley_index" in result.channels:
        # The body in the middle of a span at the start of the run, whatever the window.
        options = {BODY: middle_of_first_span(result.channels["pulley_index"][0])}
    return within(result, *shown.window), options


def _fitted(appearance: Appearance, shown: Extent) -> Appearance:
    """Return the appearance in which labels of any channels fit."""
    return appearance.model_copy(update={"fitted": True}) if shown.channels else appearance


def draw_overlay(
    results: "Sequence[Overlaid]",
    view: str | None = None,
    ax: Any = None,
    appearance: Appearance = USUAL,
    shown: Extent = WHOLE,
) -> "Figure":
    """Draw several results of one kind over each other, in a view over time.

    Parameters
    ----------
    results : sequence of Overlaid
    view, ax, appearance, shown
        As of `draw`.
    """
    check_overlay(results)
    kind = results[0].record.attributes["kind"]
    views = views_of(kind)
    view = view or next(iter(views))
    check_view(kind, view)
    check_overlaid(kind, view)
    check_applies(kind, view, shown)
    parts = []
    for name, record in results:
        if not record.channels["time"].size:
            raise InputError(f"{name}: cannot draw this result: it has no samples")
        check_numbers(record)
        check_channels(record, shown.channels)
        part = within(record, *shown.window) if shown.has_window else record
        parts.append(Overlaid(name, part))
    return drawn_in(
        lambda target: overlay(parts, target, views[view].overlaid or (), shown.channels),
        ax=ax,
        appearance=appearance.model_copy(update={"fitted": True}),
    )


def views_of_overlay(kind: str) -> list[str]:
    """Return the views of a kind in which several results are drawn over each other."""
    return [name for name, view in views_of(kind).items() if view.overlaid is not None]


def check_overlaid(kind: str, view: str) -> None:
    """Check that a view can show several results."""
    check_view(kind, view)
    fit = views_of_overlay(kind)
    if view not in fit:
        named = " or ".join(map(repr, fit))
        raise InputError(
            f"the view '{view}' cannot show several results over each other"
            + (f"; the view {named} can" if fit else "")
        )


def views_with_effects(result: "Record", shown: Extent = WHOLE) -> Views:
    """Return the views whose effects a result has; one of the kind must show each given part."""
    kind = result.attributes["kind"]
    views = views_of(kind)
    for part, given in shown.given.items():
        if given and not any(view.shows(part) for view in views.values()):
            check_applies(kind, next(iter(views)), shown)
    effects = scenario_of(result).get("effects", {})
    return {name: view for name, view in views.items() if not view.effect or view.effect in effects}
