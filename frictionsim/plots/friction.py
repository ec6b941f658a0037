"""The view `friction` of mechanisms with a shaft or a hinge: over what acts, and over the speed.

Left the size of the dry friction over that of the moment M of all else about the axis: they are
equal while the contact sticks, and friction drops to its kinetic limit when it slides. Right the
friction over the speed, of a shaft relative to its static limit, with the law that it obeys.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.display import BLACK
from frictionsim.mechanisms.journal import moment_of
from frictionsim.motion.samples import effect_in, scenario_in
from frictionsim.plots.kinds import KINETIC
from frictionsim.plots.over_time import WHOLE, within
from frictionsim.plots.style import (
    LIMIT,
    Look,
    add_legend,
    axis_label,
    line_look,
    require_channels,
    set_height,
    set_title,
    title_of,
)
from frictionsim.scenario.methods import REGULARISED
from frictionsim.solvers.friction_curve import friction_curve

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.mechanisms.effects import ShaftFriction
    from frictionsim.plots.over_time import Window
    from frictionsim.results import Record

HEIGHT = 3.6  # inches
LAW: Look = {"color": BLACK, "linewidth": 0.6, "linestyle": "-", "zorder": 3}
CURVE_POINTS = 400  # on each side of rest
BESIDE = 0.1  # of the range of speeds, by which the curve reaches farther


def friction(record: "Record", figure: "Figure | SubFigure", window: "Window" = WHOLE) -> None:
    """Draw the dry friction over the moment of all else, and over the speed with its law."""
    journal = effect_in(record, "shaft_friction")
    names = ["angular_velocity", "angular_acceleration", "friction_torque"]
    names += ["shaft_reaction"] if journal else []
    require_channels(record, "friction", names)
    of = _rows(within(record, window), names)
    w, T = of["angular_velocity"], of["friction_torque"]
    set_height(figure, HEIGHT)
    set_title(figure, title_of(record))
    left, right = figure.subplots(1, 2)
    handles: dict[str, Any] = {}
    scenario = scenario_in(record)
    # Of a scenario where its effects add to that of the mechanism.
    turning = scenario if hasattr(scenario, "inertia") else scenario.mechanism
    moment = moment_of(turning.inertia, of)
    if journal:
        load = journal.load_of(of["shaft_reaction"]) + 0.0 * w
        limit, kinetic = journal.static_radius * load, _kinetic_radius(journal, w) * load
        for words, values, look in (("static", limit, LIMIT), ("kinetic", kinetic, KINETIC)):
            (handles[f"{words} limit"],) = left.plot(moment, values, **look)
        (handles[f"law {journal.law}"],) = right.plot(*_law(journal, w), **LAW)
        with np.errstate(divide="ignore", invalid="ignore"):
            shown, words, unit = T / limit, "friction over its static limit", "1"
    else:
        shown, words, unit = T, "friction", "N m"
    (handles["run"],) = left.plot(moment, np.abs(T), **line_look(0))
    right.plot(w, shown, **line_look(0))
    left.set(xlim=(0.0, None), ylim=(0.0, None))
    left.set_xlabel(axis_label("size of the moment of all else", "N m", 40))
    left.set_ylabel(axis_label("size of the friction", "N m", 30))
    right.set_xlabel(axis_label("angular velocity", "rad/s", 40))
    right.set_ylabel(axis_label(words, unit, 40))
    for ax in (left, right):
        ax.grid(visible=True)
    add_legend(figure, handles)


def _rows(record: "Record", names: Sequence[str]) -> Mapping[str, Any]:
    """Return samples and both sides of events in the order of time; NaN where the speed jumps."""
    events, samples = record.events, np.asarray(record.time)
    sides = ("before", "after") if all(f"{name}_after" in events for name in names) else ()
    time = np.concatenate([samples, *[events["time"] for _ in sides]])
    place = np.repeat(
        [1, 0, 2][: 1 + len(sides)], [len(samples), *[len(events["time"])] * len(sides)]
    )
    order = np.lexsort((place, time))  # a sample at an event is one of its sides
    columns = {
        name: np.concatenate(
            [record.channels[name], *[events[f"{name}_{side}"] for side in sides]]
        )[order]
        for name in names
    }
    at_once = np.diff(time[order]) == 0.0
    jumps = 1 + np.flatnonzero(at_once & (np.diff(columns["angular_velocity"]) != 0.0))
    return {
        name: np.insert(values.astype(float), jumps, np.nan) for name, values in columns.items()
    }


def _kinetic_radius(journal: "ShaftFriction", w: Any) -> Any:
    """Return r_k, m, at speeds, rad/s."""
    radii = [journal.radius_over_speed.at(v) for v in np.ravel(w)]
    return np.reshape(radii, np.shape(w))


def _law(journal: "ShaftFriction", w: Any) -> tuple[Any, Any]:
    """Return speeds, rad/s, and the friction there, relative to its static limit."""
    contact, r_s = journal.law_of_contact(), journal.static_radius
    smooth = contact["transition_speed"] if contact["law"] == REGULARISED else 0.0
    low, high = min(0.0, float(np.nanmin(w))), max(0.0, float(np.nanmax(w)))
    reach = BESIDE * (high - low) + 2.0 * smooth or 1.0
    v = np.linspace(0.0, max(high, -low) + reach, CURVE_POINTS)
    if smooth:  # points where the curve bends
        v = np.union1d(v, smooth * np.linspace(0.0, 2.0, CURVE_POINTS))
    kinetic = _kinetic_radius(journal, v) / r_s if r_s else np.zeros(v.size)
    if smooth:
        size = np.array(
            [friction_curve(x, 1.0, k) for x, k in zip(v / smooth, kinetic, strict=True)]
        )
    else:  # it may be anything up to the static limit at rest
        v, size = np.append(0.0, v), np.append(1.0, kinetic)
    both = np.concatenate([-v[::-1], v])
    shown = (both >= low - reach) & (both <= high + reach)
    return both[shown], np.concatenate([size[::-1], -size])[shown]
