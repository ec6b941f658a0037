"""The pictures of a belt drive over time and along the belt, with its slip as in the summary."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from frictionsim.display import ARC_SHADES, BLACK, VERMILION, picture_text
from frictionsim.errors import InputError
from frictionsim.mechanisms.belt_drive.slip import (
    Ends,
    ends_of,
    senses_of,
    slip_percent,
    span_tensions,
    speed_at_rest,
)
from frictionsim.motion.belt_path import DrawnPulley, path_of
from frictionsim.plots.belt_geometry import (
    BeltLine,
    belt_line,
    constant_runs,
    has_friction,
    middle_of_first_span,
    pulleys_of,
)
from frictionsim.plots.style import (
    Style,
    add_legend,
    axis_label,
    grid,
    label,
    line_style,
    relative_width,
    require_channels,
    set_up,
)
from frictionsim.plots.time_history import (
    MIN_GAP,
    annotate_above,
    label_rows,
    response,
    stacked_axes,
)
from frictionsim.scenario.toml_data import scenario_value
from frictionsim.simulation.averages import last_part, last_seconds, smooth_mean, time_mean

if TYPE_CHECKING:
    import numpy.typing as npt
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.results import Record

    Array = npt.NDArray[np.float64]


FAST = 0.1  # of the largest speed of the driver: the scale is that of the slip above it
SLIP_MARGIN, MIN_MARGIN = (
    0.08,
    0.01,
)  # of the range of the slip, and of the slip, above and below it
LABEL_WIDTH = 18
MEAN: Style = {"color": BLACK, "linestyle": (0, (6, 2)), "linewidth": 1.5}


class Slip(NamedTuple):
    """The slip of a result.

    Attributes
    ----------
    ends : Ends
        The pulleys that it is of.
    percent : (n,), %
        Of each sample; not a number where the driver is at rest.
    fast : (n,) of bool
        The driver has at least FAST of its largest speed.
    mean : float, %
        Of the mean speeds, as in the summary.
    """

    ends: Ends
    percent: "Array"
    fast: "npt.NDArray[np.bool_]"
    mean: float


def slip_of(result: "Record", pulleys: list[DrawnPulley]) -> Slip:
    """Return the slip of the driven pulley against the driver, by the definition of the summary."""
    time, speed = result.channels["time"], result.channels["pulley_speed"]
    last = averaged_part(result)
    ends = ends_of(time, result.channels["pulley_torque"], speed, last)
    mean = smooth_mean if _mean_duration(result) is None else time_mean
    mean_speed = mean(time[last], speed[last])
    path = path_of(result)
    # Where no belt can be laid round the pulleys, all are taken to move with it.
    senses = np.sign(mean_speed) if path is None else senses_of(path)
    along = np.array([p.radius for p in pulleys]) * senses
    at_rest, drive = recorded_speed_at_rest(result), np.abs(speed[:, ends.drive])
    return Slip(
        ends,
        slip_percent(speed * along, ends, at_rest),
        drive >= FAST * float(np.max(drive)),
        float(slip_percent(mean_speed * along, ends, at_rest)),
    )


def _mean_duration(result: "Record") -> float | None:
    """Return the duration of the whole periods that means are over, s; None if they are not."""
    duration = result.quantities.get("mean_duration")
    return None if duration is None else duration.value


def averaged_part(result: "Record") -> "npt.NDArray[np.bool_]":
    """Return the samples that the means of the summary are over."""
    time, duration = result.channels["time"], _mean_duration(result)
    return last_part(time) if duration is None else last_seconds(time, duration)


def averaged_words(result: "Record") -> str:
    """Return what the means of the summary are over, for legends."""
    return "the last fifth" if _mean_duration(result) is None else "whole periods"


def recorded_speed_at_rest(result: "Record") -> float:
    """Return the speed, m/s, below which the summary takes a driver to be at rest."""
    spans = [
        quantity.value
        for name, quantity in result.quantities.items()
        if name.startswith("tension_") and "_to_" in name and quantity.value is not None
    ]
    try:
        mass = float(scenario_value(result, "mechanism", "belt", "mass_per_length"))
    except InputError:
        return 0.0
    return speed_at_rest(float(np.mean(spans)), mass) if spans and mass > 0.0 else 0.0


def draw_slip(ax: Any, result: "Record", pulleys: list[DrawnPulley]) -> list[Any]:
    """Draw the slip over time and its mean; return the legend handles.

    The scale is that of the times in which the driver is not much slower than at its fastest:
    of two speeds near zero, the slip is no more than their difference makes of it.
    """
    slip, time = slip_of(result, pulleys), result.channels["time"]
    driven, driver = (pulleys[i].name for i in (slip.ends.driven, slip.ends.drive))
    ax.set_ylabel(axis_label(f"slip of {driven}", "%", LABEL_WIDTH))
    if not np.isfinite(slip.percent).any():
        ax.annotate(
            f"no slip: {driver} is at rest",
            (0.5, 0.5),
            xycoords="axes fraction",
            ha="center",
            va="center",
            fontsize="small",
        )
        ax.set_yticks([])
        return []
    ax.plot(time, slip.percent, **(line_style(slip.ends.driven) | {"linewidth": 1.0}))
    shown = slip.percent[slip.fast & np.isfinite(slip.percent)]
    handles = []
    if np.isfinite(slip.mean):
        last = time[averaged_part(result)]
        weighted = _mean_duration(result) is None
        kind = "weighted mean slip" if weighted else "slip of the mean speeds"
        words = f"{kind} over {averaged_words(result)}, {picture_text(slip.mean)} %"
        handles = ax.plot(last[[0, -1]], [slip.mean] * 2, **MEAN, label=words)
        shown = np.append(shown, slip.mean)
    if shown.any():
        margin = max(SLIP_MARGIN * float(np.ptp(shown)), MIN_MARGIN * float(np.max(np.abs(shown))))
        ax.set_ylim(float(shown.min()) - margin, float(shown.max()) + margin)
    return list(handles)


SLIP = "slip"  # the panel of no channel
TENSION_HEIGHT = 4.0  # inches
MAX_SAMPLES = 200  # in the mean of the tension
NAME_GAP = 0.14  # of the width of a picture, for the name of a pulley


def speeds(result: "Record", figure: "Figure | SubFigure", channels: Sequence[str] = ()) -> None:
    """Draw speeds, torques and the slip of the pulleys over time, or other channels.

    Without the radii of the pulleys, in the scenario, there is no slip.
    """
    if channels:
        response(result, figure, channels)
        return
    names = ("pulley_speed", "pulley_torque")
    require_channels(result, "speeds", names)
    pulleys = _pulleys_with_radii(result)
    axes = stacked_axes(result, figure, [*names, SLIP] if pulleys else names)
    for name in names:
        handles = _draw_pulleys(axes[name], result, name)
    if pulleys:
        handles += draw_slip(axes[SLIP], result, pulleys)
    add_legend(figure, handles)


def _pulleys_with_radii(result: "Record") -> list[DrawnPulley]:
    """Return the pulleys of the scenario; none if it does not have those of the result."""
    try:
        pulleys = pulleys_of(result)
    except InputError:
        return []
    return pulleys if len(pulleys) == result.channels["pulley_speed"].shape[1] else []


def _draw_pulleys(ax: Any, result: "Record", name: str) -> list[Any]:
    """Draw a channel of each pulley; return the handles."""
    time, columns = result.channels["time"], result.channels[name].T
    members = result.members[result.axes[name]]
    return [
        ax.plot(time, column, **line_style(i), label=members[i])[0]
        for i, column in enumerate(columns)
    ]


def tension(result: "Record", figure: "Figure | SubFigure") -> None:
    """Draw the tension over the position along the belt: at the last sample, and its mean.

    The mean is over the time of the summary's means, at positions fixed in space.
    """
    require_channels(result, "tension", ("x", "y", "pulley_index", "tension"))
    belt = belt_line(result, -1)
    at_end = result.channels["tension"][-1][np.append(belt.order, belt.order[0])]
    set_up(figure, result, TENSION_HEIGHT)
    ax = figure.subplots()
    handles = [
        *ax.plot(belt.place, at_end, **line_style(0), label="last sample"),
        *ax.plot(
            belt.place,
            belt.mean(result, _last(result)),
            **line_style(1),
            label=f"mean over {averaged_words(result)}",
        ),
    ]
    grid(ax)
    handles += _draw_spans(ax, result, belt)
    handles += _shade_arcs(ax, result, belt)
    ax.set_ylabel(label(result, "tension"))
    first, second, *_ = (pulley.name for pulley in pulleys_of(result))
    # Whichever way the belt moves.
    words = f"distance along the belt from {first} towards {second}"
    ax.set_xlabel(axis_label(words, result.units["x"]))
    add_legend(figure, handles)


def _last(result: "Record") -> Any:
    """Return the samples of means, at most MAX_SAMPLES evenly spread ones."""
    samples = np.flatnonzero(averaged_part(result))
    return samples[:: -(-len(samples) // MAX_SAMPLES)]


def _draw_spans(ax: Any, result: "Record", belt: BeltLine) -> list[Any]:
    """Draw the mean tension of each span, as in the summary, at its position at the last sample."""
    means, style = mean_spans(result), line_style(2)
    drawn = [
        ax.plot(ends, [means[number]] * 2, **style)[0]
        for number, *ends in belt.spans(result.channels["pulley_index"][-1])
    ]
    for handle in drawn[:1]:
        handle.set_label("mean of a span, as in the summary")
    return drawn[:1]


def mean_spans(result: "Record") -> Any:
    """Return the mean tension of each span as in the summary, N."""
    last = np.flatnonzero(averaged_part(result))
    tension, touched = result.channels["tension"], result.channels["pulley_index"]
    spans = span_tensions(tension[last], touched[last], len(pulleys_of(result)))
    return time_mean(result.channels["time"][last], spans)


def _shade_arcs(ax: Any, result: "Record", belt: BeltLine) -> list[Any]:
    """Shade where the belt touches a pulley."""
    pulleys = pulleys_of(result)
    longest: dict[int, tuple[float, float]] = {}
    for number, *arc in belt.arcs(result.channels["pulley_index"][-1]):
        ax.axvspan(*arc, color=ARC_SHADES[0], linewidth=0)
        if np.ptp(arc) > np.ptp(longest.get(number, (0.0, 0.0))):
            longest[number] = (arc[0], arc[1])
    names = sorted((float(np.mean(arc)), pulleys[i].name) for i, arc in longest.items())
    min_gap = NAME_GAP / relative_width(ax.figure) * belt.length
    rows = label_rows([at for at, _ in names], min_gap, max_rows=3)
    for (at, name), row in zip(names, rows, strict=False):
        annotate_above(ax, at, name, row)
    return [Patch(color=ARC_SHADES[0], label="on a pulley")] if longest else []


def body(result: "Record", figure: "Figure | SubFigure", body: int | None = None) -> None:
    """Draw the tension before one body of the belt, the forces on it and its slip velocity.

    Parameters
    ----------
    body : int, optional
        Number of the body; the default is `default_body`. Of one that meets no pulley its place is
        drawn instead of forces.
    """
    names = ["pulley_speed", "tension", "normal_force"]
    names += ["friction_force", "slip_velocity"] if has_friction(result) else []
    require_channels(result, "body", [*names, "pulley_index"])
    touched = result.channels["pulley_index"]
    number = default_body(touched) if body is None else body
    _check_body(number, touched.shape[1])
    meets = bool((touched[:, number] >= 0).any())
    if not meets:  # what else is known of it
        names = ["pulley_speed", "tension", *(name for name in "xy" if name in result.channels)]
    axes = stacked_axes(result, figure, names)
    for name, ax in axes.items():
        if name == "pulley_speed":
            handles = _draw_pulleys(ax, result, name)
        else:
            _draw_body(ax, result, name, number)
        if name not in "xy":
            ax.axhline(0.0, color=BLACK, linewidth=0.5)
    for name in "xy" if not meets else "":
        if name in axes:
            axes[name].set_ylabel(label(result, name, f"{name} of body {number}"))
    axes["tension"].set_ylabel(label(result, "tension", f"tension before\nbody {number}"))
    if not meets:
        time = result.channels["time"]
        span = f"from {picture_text(time[0])} s to {picture_text(time[-1])} s"
        words = f"body {number} meets no pulley {span}: there are no forces on it, and no slip"
        axes["pulley_speed"].set_title(words, fontsize="small", loc="left")
    handles += _shade_touch(list(axes.values()), result, number)
    if "slip_velocity" in axes:
        handles += _mark_sticking(axes["slip_velocity"], result, number)
    add_legend(figure, handles)


def default_body(touched: Any) -> int:
    """Return the body in the middle of the first span at the start, if it meets a pulley.

    Else the one that touches pulleys for the longest time.

    Parameters
    ----------
    touched : (samples, bodies)
        The pulley that each body touches; -1 if none.
    """
    number = middle_of_first_span(touched[0])
    if (touched[:, number] >= 0).any():
        return number
    longest = np.sum(touched >= 0, axis=0)
    return int(np.argmax(longest)) if longest.any() else number


def _check_body(number: int, count: int) -> None:
    if not 0 <= number < count:
        raise InputError(f"there is no body {number}; the bodies of this belt are 0 to {count - 1}")


def _draw_body(ax: Any, result: "Record", name: str, number: int) -> None:
    values = result.channels[name][:, number]
    if name not in ("tension", *"xy"):  # the others are defined while the body touches a pulley
        values = np.where(result.channels["pulley_index"][:, number] < 0, np.nan, values)
    # Black: the colours are those of the pulleys.
    ax.plot(result.channels["time"], values, color=BLACK, linewidth=1.2)


def _shade_touch(axes: Sequence[Any], result: "Record", number: int) -> list[Any]:
    """Shade the times in which the body touches a pulley, with a grey for each pulley."""
    time = result.channels["time"]
    names = [pulley.name for pulley in pulleys_of(result)]
    min_gap = MIN_GAP / relative_width(axes[0].figure) * np.ptp(time)
    handles = {}
    for value, first, stop in constant_runs(result.channels["pulley_index"][:, number]):
        if value < 0:
            continue
        pulley = int(value)
        colour = ARC_SHADES[pulley % len(ARC_SHADES)]
        span = time[first], time[min(stop, len(time) - 1)]
        for ax in axes:
            ax.axvspan(*span, color=colour, linewidth=0)
        if np.ptp(span) > min_gap:
            annotate_above(axes[0], float(np.mean(span)), names[pulley], row=0)
        handles[pulley] = Patch(color=colour, label=f"body {number} on {names[pulley]}")
    return [handles[pulley] for pulley in sorted(handles)]


def _mark_sticking(ax: Any, result: "Record", number: int) -> list[Any]:
    if "sticking" not in result.channels:
        return []
    sticks = result.channels["sticking"][:, number] > 0
    style: Style = {"color": VERMILION, "linewidth": 3.0, "solid_capstyle": "butt"}
    ax.plot(result.channels["time"], np.where(sticks, 0.0, np.nan), **style)
    return [Line2D([], [], **style, label="sticking")] if sticks.any() else []
