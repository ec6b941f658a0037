"""The views of a belt drive: over time with its slip, along the belt, one body."""

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from frictionsim.display import ARC_SHADES, BLACK, FAINT, GREY, VERMILION, picture_text
from frictionsim.errors import InputError
from frictionsim.mechanisms.belt_drive.belt import patch_of_bodies, zones_of
from frictionsim.mechanisms.belt_drive.slip import (
    ends_of,
    senses_of,
    slip_percent,
    span_tensions,
    speed_at_rest,
)
from frictionsim.motion.belt_drive import places_on, wear_of
from frictionsim.motion.samples import scenario_in
from frictionsim.plots.over_time import WHOLE, over_time, panels_of, within, write_above
from frictionsim.plots.style import (
    Look,
    add_legend,
    axis_label,
    letters_across,
    line_look,
    require_channels,
    single_panel,
    title_of,
)
from frictionsim.simulation.averages import last_part, last_seconds, time_mean
from frictionsim.solvers.friction_curve import KINETIC_FROM, friction_curve, rising_part

if TYPE_CHECKING:
    import numpy.typing as npt
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.fits.data import Target
    from frictionsim.mechanisms.belt_drive.geometry import Path
    from frictionsim.plots.over_time import Window
    from frictionsim.results import Record

    Array = npt.NDArray[np.float64]


# Speeds and slip over time.

SLIP = "slip"  # a channel of pictures
FAST = 0.1  # of the largest speed of the driver: the slip of a slower one is no more than noise
SMOOTHED = 0.02  # of the time axis, over which the line of the slip is averaged
SLIP_MARGIN = 0.08  # of the range of the slip, above and below it


def speeds(
    record: "Record",
    figure: "Figure | SubFigure",
    channels: Sequence[str] = (),
    window: "Window" = WHOLE,
    measured: Sequence["Target"] = (),
) -> None:
    """Draw speeds and torques of the pulleys and the slip over time, or other channels."""
    if channels:
        panels = panels_of(record, channels)
        _, handles = over_time([record], panels, figure, window=window, measured=measured)
        add_legend(figure, handles)
        return
    names = ("pulley_speed", "pulley_torque")
    require_channels(record, "speeds", names)
    panels = {name.replace("_", " "): {name: ""} for name in names}
    slip = slip_of(record)
    label = f"slip of {slip.driven}"
    panels[label] = {SLIP: ""}
    record = record._replace(
        channels={**record.channels, SLIP: slip.percent},
        axes=record.axes | {SLIP: ""},
        units=record.units | {SLIP: "%"},
    )
    axes, handles = over_time([record], panels, figure, window=window)
    handles |= _draw_slip(axes[label], record, slip.driver, window)
    add_legend(figure, handles)


class Slip(NamedTuple):
    """The slip of a result."""

    driver: str  # the pulleys that it is of
    driven: str
    # (n,), %; of each sample; not a number where the driver is much slower than at its fastest.
    percent: "Array"


def slip_of(record: "Record") -> Slip:
    """Return the slip by the definition of the summary."""
    geometry, part = scenario_in(record).mechanism, averaged_part(record)
    time, speed = record.time, np.asarray(record.channels["pulley_speed"])
    radii = np.array([pulley.radius for pulley in geometry.pulleys])
    at_rest = _speed_at_rest(record, geometry.belt.mass_per_length)
    torque = np.asarray(record.channels["pulley_torque"])
    ends = ends_of(time, torque, speed, part, at_rest / radii)
    percent = slip_percent(speed * senses_of(geometry.path()) * radii, ends, at_rest)
    drive = np.abs(speed[:, ends.drive])
    percent = np.where(drive >= FAST * drive.max(), percent, np.nan)
    return Slip(geometry.names[ends.drive], geometry.names[ends.driven], percent)


def _draw_slip(ax: Any, record: "Record", driver: str, window: "Window") -> dict[str, Any]:
    """Draw a plain line over the noise of the slip, and its mean of the summary."""
    ax.lines[0].set(color=FAINT, linewidth=0.8)
    shown = within(record, window)
    known = np.isfinite(shown.channels[SLIP])
    if not known.any():
        ax.set_yticks([])
        ax.text(0.5, 0.5, f"no slip: {driver} is at rest", ha="center", transform=ax.transAxes)
        return {}
    time, values = shown.time[known], shown.channels[SLIP][known]
    half = 0.5 * SMOOTHED * float(np.ptp(shown.time))
    (line,) = ax.plot(time, smoothed(time, values, half), color=BLACK)
    handles = {"slip, averaged over 1/50 of the time shown": line}
    mean = record.quantities.get("slip_percent")
    drawn = values
    if mean is not None and mean.value is not None:
        whole = averaged_periods(record) is not None
        words = (
            "slip of the mean speeds over whole periods"
            if whole
            else "weighted mean slip over the last fifth"
        )
        look = line_look(2)
        last = record.time[averaged_part(record)][[0, -1]]
        (handles[f"{words}, {picture_text(mean.value)} %"],) = ax.plot(
            last, [mean.value] * 2, **look
        )
        drawn = np.append(values, mean.value)
    margin = SLIP_MARGIN * float(np.ptp(drawn)) or 0.01 * abs(float(drawn[0])) or 1.0
    ax.set_ylim(float(drawn.min()) - margin, float(drawn.max()) + margin)
    return handles


def smoothed(time: "Array", values: "Array", half: float) -> "Array":
    """Return the mean over time around each sample, at most `half` seconds to both sides."""
    steps = 0.5 * (values[1:] + values[:-1]) * np.diff(time)
    area = np.concatenate([[0.0], np.cumsum(steps)])
    low, high = np.maximum(time - half, time[0]), np.minimum(time + half, time[-1])
    span = high - low
    mean = np.interp(high, time, area) - np.interp(low, time, area)
    return np.divide(mean, span, out=np.array(values, dtype=float), where=span > 0.0)


def averaged_part(record: "Record") -> Any:
    """Return the samples that the means of the summary are over."""
    seconds = averaged_periods(record)
    return last_part(record.time) if seconds is None else last_seconds(record.time, seconds)


def averaged_periods(record: "Record") -> float | None:
    """Return the whole periods, s, that the means of the summary are over.

    None where they are over the last fifth, or the samples are of a shorter time.
    """
    duration = record.quantities.get("mean_duration")
    if duration is None or duration.value is None or duration.value > np.ptp(record.time):
        return None
    return duration.value


def _speed_at_rest(record: "Record", mass: float) -> float:
    """Return the speed, m/s, below which a driver is at rest with the tensions of the summary.

    The mass of the belt is that of a metre, kg/m.
    """
    spans = [
        quantity.value
        for name, quantity in record.quantities.items()
        if name.startswith("tension_") and "_to_" in name and quantity.value is not None
    ]
    return speed_at_rest(float(np.mean(spans)), mass) if spans else 0.0


# The tension along the belt.

MAX_SAMPLES = 200  # in the mean of the tension


def along_belt(path: "Path", record: "Record", sample: int) -> tuple["Array", "Array"]:
    """Return where the joints are along the line of the belt, m, ascending, and their tension, N.

    Joint k is between the bodies k - 1 and k.
    """
    bodies = np.column_stack([record.channels["x"][sample], record.channels["y"][sample]])
    places = places_on(path, 0.5 * (bodies + np.roll(bodies, 1, axis=0)))
    order = np.argsort(places, kind="stable")
    return places[order], np.asarray(record.channels["tension"][sample])[order]


def runs_of(values: Any) -> list[tuple[int, int, int]]:
    """Return each run of equal values: the value, its first index, and its last one plus one."""
    ends = [0, *(np.flatnonzero(np.diff(values)) + 1), len(values)]
    return [(int(values[a]), int(a), int(b)) for a, b in pairwise(ends)]


def tension(record: "Record", figure: "Figure | SubFigure", sample: int = -1) -> None:
    """Draw the tension along the belt: at a sample, its mean until then, and that of the spans.

    Places are those on the line of an ideal belt, from where it leaves the first pulley.
    """
    require_channels(record, "tension", ("x", "y", "pulley_index", "tension"))
    geometry = scenario_in(record).mechanism
    names, path = geometry.names, geometry.path()
    last = sample % len(record.time) + 1
    part = record._replace(channels={n: v[:last] for n, v in record.channels.items()})
    samples = np.flatnonzero(averaged_part(part))
    ax = single_panel(figure, 4.0, title_of(record))
    place, now = along_belt(path, part, -1)
    few = samples[:: -(-len(samples) // MAX_SAMPLES)]
    steady = [np.interp(place, *along_belt(path, part, k), period=path.length) for k in few]
    words = "last sample" if last == len(record.time) else f"at {picture_text(part.time[-1])} s"
    whole = "the last fifth" if averaged_periods(part) is None else "whole periods"
    handles: dict[str, Any] = {}
    around = np.concatenate([[place[-1] - path.length], place, [place[0] + path.length]])
    curves = {words: now, f"mean over {whole}": np.mean(steady, axis=0)}
    for i, (words, values) in enumerate(curves.items()):
        (handles[words],) = ax.plot(
            around, values.take(range(-1, len(values) + 1), mode="wrap"), **line_look(i)
        )
    means = mean_spans(part, samples, len(names))
    summary = ", as in the summary" if last == len(record.time) else ""
    ends, above = path.breakpoints, dict[float, str]()
    for i, (start, end) in enumerate(path.arc_ends.T.tolist()):
        (line,) = ax.plot(ends[2 * i : 2 * i + 2], [means[i]] * 2, **line_look(2))
        handles[f"mean of a span{summary}"] = line
        ax.axvspan(start, end, color=ARC_SHADES[0], linewidth=0)
        handles["wrap of an ideal belt"] = Patch(color=ARC_SHADES[0])
        above[0.5 * (start + end)] = names[i]
    ax.set_xlim(0.0, path.length)
    write_above(ax, above, (0.0, path.length))
    ax.set_ylabel(axis_label("tension", record.units["tension"]))
    words = f"distance along the belt from {names[0]} towards {names[1]}"
    ax.set_xlabel(axis_label(words, "m", int(0.8 * letters_across(figure))))
    add_legend(figure, handles)


def mean_spans(record: "Record", samples: Any, pulleys: int) -> Any:
    """Return the mean tension of each span as in the summary, N."""
    tension, touched = record.channels["tension"], record.channels["pulley_index"]
    return time_mean(
        record.time[samples], span_tensions(tension[samples], touched[samples], pulleys)
    )


# One body of the belt.


def body(
    record: "Record",
    figure: "Figure | SubFigure",
    body: int | None = None,
    window: "Window" = WHOLE,
) -> None:
    """Draw the tension before one body of the belt, the forces on it and its slip velocity.

    The default is the body that touches pulleys for the longest time.
    """
    scenario = scenario_in(record)
    names = ["pulley_speed", "tension", "normal_force"]
    names += ["friction_force", "slip_velocity"] if scenario.effects.belt_friction else []
    require_channels(record, "body", [*names, "pulley_index"])
    pulleys, index = scenario.mechanism.names, np.asarray(record.channels["pulley_index"])
    number = int(np.argmax(np.sum(index >= 0, axis=0))) if body is None else body
    if not 0 <= number < index.shape[1]:
        raise InputError(
            f"there is no body {number}; the bodies of this belt are 0 to {index.shape[1] - 1}"
        )
    touched = index[:, number]
    panels = {name.replace("_", " "): {name: ""} for name in names}
    panels = {
        f"tension before body {number}" if n == "tension" else n: c for n, c in panels.items()
    }
    own = {name: np.asarray(record.channels[name])[:, number] for name in names[1:]}
    for name in names[2:]:  # defined while the body touches a pulley
        own[name] = np.where(touched < 0, np.nan, own[name])
    known = record._replace(
        channels={**record.channels, **own}, axes=record.axes | dict.fromkeys(own, "")
    )
    by_label, handles = over_time([known], panels, figure, window=window, events=False)
    axes = list(by_label.values())
    for ax in axes[1:]:
        ax.lines[0].set_color(BLACK)  # the colours are those of the pulleys
        ax.axhline(0.0, color=BLACK, linewidth=0.5)
    time, places = record.time, {}
    for value, first, stop in runs_of(touched):
        if value >= 0:
            start, end = time[first], time[min(stop, len(time) - 1)]
            colour = ARC_SHADES[value % len(ARC_SHADES)]
            for ax in axes:
                ax.axvspan(start, end, color=colour, linewidth=0)
            places[float(0.5 * (start + end))] = pulleys[value]
            handles[f"body {number} on {pulleys[value]}"] = Patch(color=colour)
    ends = axes[-1].get_xlim()
    write_above(axes[0], places, ends)
    if "slip_velocity" in names and "sticking" in record.channels:
        sticks = np.asarray(record.channels["sticking"])[:, number] > 0
        look: Look = {"color": VERMILION, "linewidth": 3.0, "solid_capstyle": "butt"}
        axes[-1].plot(time, np.where(sticks, 0.0, np.nan), **look)
        if sticks.any():
            handles["sticking"] = Line2D([], [], **look)
    axes[-1].set_xlim(ends)
    add_legend(figure, handles)


# Friction over slip.

MAX_POINTS = 10_000  # of a cloud
FINE = 400  # points of a curve
SLOWEST = 1e-6  # m/s, to which the axis reaches at least
SEEN_SLIP = 2e-3  # of the fastest slip: a ring marks a body that sticks and has more
LINEAR_UP_TO = 2.0  # transition speeds: slip is drawn by its logarithm beyond, if it is much faster
MUCH = 20.0


def friction(record: "Record", figure: "Figure | SubFigure") -> None:
    """Draw friction over normal force against the slip velocity, of all bodies on pulleys.

    In the samples that the means of the summary are over. Behind them stands mu(v) of the law, by
    each pair of coefficients: a vertical of set-valued friction, the smoothed curve [1]_ eq 12, or
    that of the creep law [1]_ eq 13 with its share of the creep, (1 - beta) mu_1.

    References
    ----------
    .. [1] K. Kubas, "A two-dimensional discrete model for dynamic analysis of belt transmission
       with dry friction", Archive of Mechanical Engineering 61(4), 2014, figs 5 and 6.
    """
    names = ("friction_force", "normal_force", "slip_velocity", "pulley_index")
    require_channels(record, "friction", names)
    late = averaged_part(record)
    force, normal, slip, index = (np.asarray(record.channels[name])[late] for name in names)
    sticks = record.channels["sticking"][late] > 0 if "sticking" in record.channels else None
    fastest = float(np.max(np.abs(slip[index >= 0]), initial=SLOWEST))
    ax = single_panel(figure, 4.5, title_of(record))
    ax.margins(x=0.05)
    handles: dict[str, Any] = {}
    scenario = scenario_in(record)
    for j, name in enumerate(scenario.mechanism.names):
        on = np.flatnonzero((index == j) & (normal > 0.0))
        few = on[:: -(-on.size // MAX_POINTS)] if on.size else on
        ratio, speed = force.ravel()[few] / normal.ravel()[few], slip.ravel()[few]
        look: Look = {"color": line_look(j)["color"], "linestyle": "", "rasterized": True}
        (handles[f"bodies on {name}"],) = ax.plot(
            speed, ratio, marker="o", markersize=2.5, mew=0.0, zorder=3, **look
        )
        residual = np.abs(speed) > SEEN_SLIP * fastest
        if sticks is not None and (of := residual & sticks.ravel()[few]).any():
            ring: Look = {"marker": "o", "mfc": "none", "markersize": 5.0, "mew": 0.6, "zorder": 3}
            ax.plot(speed[of], ratio[of], **look, **ring)
            handles["sticks, with residual slip"] = Line2D([], [], color=GREY, linestyle="", **ring)
    handles |= _draw_law(ax, record, scenario.effects, fastest)
    ax.axhline(0.0, color=BLACK, linewidth=0.5)
    ax.set_ylabel("friction over normal force, 1")
    words = "slip velocity of the rim against the belt"
    ax.set_xlabel(axis_label(words, "m/s", letters_across(figure)))
    add_legend(figure, handles)


def _draw_law(ax: Any, record: "Record", effects: Any, fastest: float) -> dict[str, Any]:
    """Draw mu(v) of each pair of coefficients up to a slip velocity, m/s."""
    law, handles = effects.belt_friction, dict[str, Any]()
    steps = record.statistics.steps if record.statistics else 1
    speed = law.transition_speed
    tables = (law, *law.pulleys.values(), *effects.patches)
    end = 1.1 * max(fastest, KINETIC_FROM * (speed or 0.0))
    slip = np.append(np.linspace(0.0, KINETIC_FROM, FINE) * (speed or 0.0), end)
    if speed is not None and fastest > MUCH * speed:
        ax.set_xscale("symlog", linthresh=LINEAR_UP_TO * speed)
    names = {(of.mu_s, of.mu_k): getattr(of, "name", "") for of in reversed(tables)}
    for number, (mu_s, mu_k) in enumerate(dict.fromkeys((of.mu_s, of.mu_k) for of in tables)):
        if speed is None:
            slip, mu = np.array([0.0, 0.0, 0.0, end]), np.array([0.0, mu_s, mu_k, mu_k])
        else:
            mu = np.array([friction_curve(v / speed, mu_s, mu_k) for v in slip])
        if speed is not None and law.maximum_creep is not None:
            time = law.elementary_time or record.time[-1] / max(steps, 1)
            creep = np.array([rising_part(v * time / law.maximum_creep) for v in slip])
            share = mu_s * creep * [1.0 - rising_part(v / speed) for v in slip]
            look: Look = {"color": VERMILION, "linestyle": ":"}
            (handles["share of the creep, (1 - β) μ1"],) = ax.plot(*_odd(slip, share), **look)
            mu += share
        look = line_look(number) | {"color": BLACK}
        words = f"law, μs = {picture_text(mu_s)}, μk = {picture_text(mu_k)}"
        words += f" ({name})" if (name := names[mu_s, mu_k]) else ""
        (handles[words],) = ax.plot(*_odd(slip, mu), **look)
    return handles


def _odd(slip: "Array", mu: "Array") -> tuple["Array", "Array"]:
    """Return a curve with its image on the other side of the origin."""
    return np.append(-slip[::-1], slip), np.append(-mu[::-1], mu)


# The work of friction.


def wear(record: "Record", figure: "Figure | SubFigure", sample: int = -1) -> None:
    """Draw the friction work of each body over its place on the belt, patches shaded, until then.

    And its mean over the belt outside of patches and over those of each name, as in the summary.
    """
    require_channels(record, "wear", ("friction_work",))
    scenario = scenario_in(record)
    edges, work = wear_of(record, sample)
    length = float(edges[1])
    ax = single_panel(figure, 4.0, title_of(record))
    at = f"until {picture_text(record.time[sample])} s"
    handles: dict[str, Any] = {at: ax.stairs(work, edges, color=BLACK, baseline=None, zorder=3)}
    for value, first, end in runs_of(patch_of_bodies(scenario, length)):
        if value >= 0:
            ax.axvspan(edges[first], edges[end], color=ARC_SHADES[0], linewidth=0)
            handles["patch"] = Patch(color=ARC_SHADES[0])
    for number, (name, inside) in enumerate(zones_of(scenario, length).items()):
        mean = float(work[inside].mean()) if inside.any() else np.nan
        for _, first, end in (run for run in runs_of(inside) if run[0]):
            (line,) = ax.plot(edges[[first, end]], [mean] * 2, **line_look(number + 1))
            handles[f"mean of {name}, {picture_text(mean)} J/m"] = line
    if np.min(work) > 0.0 and np.max(work) > MUCH * np.min(work):
        ax.set_yscale("log")
    ax.set_ylabel(axis_label("friction work per metre of belt", "J/m"))
    words = "distance along the unstretched belt, from the first pulley at the start"
    ax.set_xlabel(axis_label(words, "m", letters_across(figure)))
    add_legend(figure, handles)
