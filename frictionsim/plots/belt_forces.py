"""The forces of the pulleys on a belt, and where it sticks and slips."""

from collections.abc import Sequence
from math import floor, log10
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from frictionsim.plots.style import BLACK, BLUE, VERMILION, Style

if TYPE_CHECKING:
    from frictionsim.plots.belt_geometry import Pulley
    from frictionsim.plots.belt_shape import ContactArc

MAX_BAR = 0.6  # radii
GAP = 0.11  # radii, between the belt and the bars
FULL_WIDTH_PITCH = 5.0  # points between bodies; bars are thinner where there is less
MARKED_PITCH = 3.0  # points between bodies; bars that are closer have no marks at their ends
MIN_MARKED = 0.02  # of the largest force

# Normal force and both directions of friction differ in their ends too, for grey print.
NORMAL: Style = {"color": BLUE, "linewidth": 1.8}
FORWARD: Style = {"color": VERMILION, "linewidth": 1.8, "marker": "o", "markersize": 4.5}
BACKWARD: Style = FORWARD | {"marker": "s", "markerfacecolor": "white", "linewidth": 1.0}
EDGED = [withStroke(linewidth=3.6, foreground=BLACK)]
STICK: Style = {"color": BLACK, "linewidth": 2.4, "path_effects": EDGED}
SLIP: Style = STICK | {"color": "white"}


def largest_force(touches: "Sequence[ContactArc]") -> float:
    """Return the largest normal force or friction of all pulleys, N; 0 without any."""
    forces = [np.abs([touch.normal_force, touch.friction]) for touch in touches]
    return max((float(force.max()) for force in forces if force.size), default=0.0)


def draw_forces(
    ax: Any, pulley: "Pulley", touch: "ContactArc", force: float, pitch_points: float
) -> None:
    """Draw forces and modes of the bodies on a pulley.

    Parameters
    ----------
    ax : Axes
    pulley : Pulley
    touch : ContactArc
    force : float, N
        The largest force, which has the longest bar.
    pitch_points : float
        From body to body, in points.
    """
    if force > 0.0:
        _draw_bars(ax, touch, pulley.radius, MAX_BAR * pulley.radius / force, pitch_points)
        _draw_scale_bar(ax, pulley, force)
    mark_modes(ax, touch, width=2.2)


def _draw_bars(
    ax: Any, touch: "ContactArc", radius: float, per_force: float, pitch_points: float
) -> None:
    """Draw the normal forces outwards from the belt and the friction forces inwards."""
    forward = touch.friction > 0.0
    least = MIN_MARKED * MAX_BAR * radius / per_force
    for style, which, lengths in (
        (NORMAL, touch.normal_force > 0.0, touch.normal_force),
        (FORWARD, forward, -touch.friction),
        (BACKWARD, ~forward, touch.friction),
    ):
        foot = touch.place + GAP * radius * np.sign(lengths)[:, None] * touch.normal
        tip = foot + (per_force * lengths)[:, None] * touch.normal
        width = style["linewidth"] * min(1.0, pitch_points / FULL_WIDTH_PITCH)
        bars = np.stack([foot, tip], axis=1)[which]
        ax.add_collection(LineCollection(bars, colors=style["color"], linewidths=width))
        ends = tip[which & (np.abs(lengths) > least)]
        if "marker" in style and pitch_points >= MARKED_PITCH and ends.size:
            ax.plot(*ends.T, **(style | {"linestyle": ""}))


def _draw_scale_bar(ax: Any, pulley: "Pulley", force: float) -> None:
    """Draw a scale bar of a round force at the centre of the pulley."""
    value = round_below(force)
    half = 0.5 * MAX_BAR * pulley.radius * value / force
    ends = [pulley.x - half, pulley.x + half]
    ax.plot(ends, [pulley.y] * 2, color=BLACK, linewidth=1.5, marker="|", markersize=5)
    ax.annotate(
        f"{value:g} N",
        (pulley.x, pulley.y),
        (0.0, 4.0),
        textcoords="offset points",
        ha="center",
        va="bottom",
        fontsize="x-small",
    )


def round_below(value: float) -> float:
    """Return the largest of ..., 1, 2, 5, 10, ... that does not exceed a value."""
    power = 10.0 ** floor(log10(value))
    return max(factor * power for factor in (1.0, 2.0, 5.0) if factor * power <= value)


def mark_modes(ax: Any, touch: "ContactArc", width: float) -> None:
    """Draw a strip on the bodies: black where they stick, white with a black edge elsewhere."""
    slips = [line for line, sticks in zip(touch.lines, touch.sticks, strict=True) if not sticks]
    edge = LineCollection(touch.lines, colors=BLACK, linewidths=width + 1.0, zorder=5)
    strip = LineCollection(slips, colors="white", linewidths=width, zorder=5)
    ax.add_collection(edge)
    ax.add_collection(strip)


def force_handles(has_friction: bool) -> list[Any]:
    """Return what the legend says of forces and modes."""
    handles = [Line2D([], [], **NORMAL, label="normal force")]
    if not has_friction:
        return [*handles, Line2D([], [], **SLIP, label="touching")]
    for style, words in ((FORWARD, "counter-clockwise"), (BACKWARD, "clockwise")):
        handles.append(Line2D([], [], **style, label=f"friction on the belt, {words}"))
    for style, words in ((STICK, "sticking"), (SLIP, "slipping")):
        handles.append(Line2D([], [], **style, label=words))
    return handles
