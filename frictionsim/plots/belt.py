"""The views of a belt drive: over time with its slip, along the belt, one body, the drive."""

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from frictionsim.display import ARC_SHADES, BLACK, FAINT, VERMILION, picture_text
from frictionsim.errors import InputError
from frictionsim.mechanisms.belt_drive.belt import patch_of_bodies, zones_of
from frictionsim.mechanisms.belt_drive.equilibrium import at_rest
from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario
from frictionsim.mechanisms.belt_drive.slip import (
    ends_of,
    senses_of,
    slip_percent,
    span_tensions,
    speed_at_rest,
)
from frictionsim.motion.belt_path import guiding_path, path_of, places_on, pulleys_of
from frictionsim.plots.mechanism import draw_mechanism
from frictionsim.plots.over_time import over_time, panels_of, within, write_above
from frictionsim.plots.style import (
    Look,
    add_legend,
    axis_label,
    letters_across,
    line_look,
    require_channels,
    set_height,
    set_title,
    title_of,
)
from frictionsim.scenario.toml_data import scenario_of
from frictionsim.simulation.averages import last_part, last_seconds, time_mean
from frictionsim.solvers.friction_curve import KINETIC_FROM, friction_curve, rising_part

if TYPE_CHECKING:
    import numpy.typing as npt
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.fits.data import Target
    from frictionsim.plots.over_time import Window
    from frictionsim.results import Record

    Array = npt.NDArray[np.float64]

WHOLE = (None, None)


def scenario_run_of(record: "Record") -> BeltDriveScenario:
    """Return the scenario of a result."""
    return BeltDriveScenario.model_validate(scenario_of(record))


def has_friction(record: "Record") -> bool:
    """Return whether the scenario has friction between belt and pulleys."""
    return "belt_friction" in scenario_of(record).get("effects", {})


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
    if slip is None:
        _, handles = over_time([record], panels, figure, window=window)
    else:
        label = f"slip of {slip.driven}"
        known = record._replace(
            channels={**record.channels, SLIP: slip.percent},
            axes=record.axes | {SLIP: ""},
            units=record.units | {SLIP: "%"},
        )
        axes, handles = over_time([known], panels | {label: {SLIP: ""}}, figure, window=window)
        handles |= _draw_slip(axes[label], known, slip, window)
    add_legend(figure, handles)


class Slip(NamedTuple):
    """The slip of a result.

    Attributes
    ----------
    driver, driven : str
        The pulleys that it is of.
    percent : (n,), %
        Of each sample; not a number where the driver is much slower than at its fastest.
    """

    driver: str
    driven: str
    percent: "Array"


def slip_of(record: "Record") -> Slip | None:
    """Return the slip by the definition of the summary; None without the radii of the pulleys."""
    path = path_of(record)
    time, speed = record.time, np.asarray(record.channels["pulley_speed"])
    if path is None or len(path.arcs) != speed.shape[1]:
        return None
    pulleys = pulleys_of(record)
    part = averaged_part(record)
    ends = ends_of(time, np.asarray(record.channels["pulley_torque"]), speed, part)
    rims = speed * senses_of(path) * [pulley.radius for pulley in pulleys]
    percent = slip_percent(rims, ends, _speed_at_rest(record))
    drive = np.abs(speed[:, ends.drive])
    percent = np.where(drive >= FAST * drive.max(), percent, np.nan)
    return Slip(pulleys[ends.drive].name, pulleys[ends.driven].name, percent)


def _draw_slip(ax: Any, record: "Record", slip: Slip, window: "Window") -> dict[str, Any]:
    """Draw a plain line over the noise of the slip, and its mean of the summary."""
    ax.lines[0].set(color=FAINT, linewidth=0.8)
    shown = within(record, window)
    known = np.isfinite(shown.channels[SLIP])
    if not known.any():
        ax.set_yticks([])
        ax.text(0.5, 0.5, f"no slip: {slip.driver} is at rest", ha="center", transform=ax.transAxes)
        return {}
    time, values = shown.time[known], shown.channels[SLIP][known]
    half = 0.5 * SMOOTHED * float(np.ptp(shown.time))
    (line,) = ax.plot(time, smoothed(time, values, half), color=BLACK)
    handles = {"slip, averaged over 1/50 of the time shown": line}
    mean = record.quantities.get("slip_percent")
    drawn = values
    if mean is not None and mean.value is not None:
        whole = "mean_duration" in record.quantities
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
    duration = record.quantities.get("mean_duration")
    if duration is None or duration.value is None:
        return last_part(record.time)
    return last_seconds(record.time, duration.value)


def _speed_at_rest(record: "Record") -> float:
    """Return the speed, m/s, below which the summary takes a driver to be at rest."""
    spans = [
        quantity.value
        for name, quantity in record.quantities.items()
        if name.startswith("tension_") and "_to_" in name and quantity.value is not None
    ]
    belt = scenario_of(record).get("mechanism", {}).get("belt", {})
    mass = float(belt.get("mass_per_length", 0.0))
    return speed_at_rest(float(np.mean(spans)), mass) if spans and mass > 0.0 else 0.0


# The tension along the belt.

MAX_SAMPLES = 200  # in the mean of the tension


class BeltLine:
    """The closed line of a belt, starting where it leaves the first pulley.

    That of bodies in the plane goes through the joints; a guided string follows its own line. Joint
    k is between the bodies k - 1 and k.

    Attributes
    ----------
    order : (n,)
        Numbers of the joints in the order of the line.
    place : (n + 1,), m
        Distances of these joints along the line; the last one is the first again.
    length : float, m
    arcs, spans : list of (int, float, float)
        Of each stretch of belt on a pulley the pulley, of each span the one before it, with start
        and end, m.
    """

    def __init__(self, record: "Record", sample: int) -> None:
        touched = np.asarray(record.channels["pulley_index"][sample])
        joints = _joints(record, sample)
        self._path = path = guiding_path(record, sample)
        if path is not None:
            self.length, places = path.length, places_on(path, joints)
            self.order = np.argsort(places, kind="stable")
            self.place = np.append(places[self.order], places.min() + path.length)
            ends, count = path.breakpoints, len(path.arcs)
            on = [((i + 1) % count, ends[2 * i + 1], ends[2 * i + 2]) for i in range(count)]
            self.arcs = [(number, float(start), float(end)) for number, start, end in on]
            self.spans = [(i, float(ends[2 * i]), float(ends[2 * i + 1])) for i in range(count)]
            return
        self.order = np.roll(np.arange(len(joints)), -first_free_body(touched))
        self._points = joints[self.order]
        legs = np.roll(self._points, -1, axis=0) - self._points
        self.place = np.concatenate([[0.0], np.cumsum(np.hypot(*legs.T))])
        self.length = float(self.place[-1])
        runs = runs_of(touched[self.order])
        at = [(value, float(self.place[a]), float(self.place[b])) for value, a, b in runs]
        self.arcs = [run for run in at if run[0] >= 0]
        self.spans = []
        for k, (value, start, end) in enumerate(at):
            before, after = at[k - 1][0], at[(k + 1) % len(at)][0]
            if value < 0 <= before and before != after:
                self.spans.append((before, start, end))

    def places_of(self, points: "Array") -> "Array":
        """Return the distances along the line, m, of the places nearest to points (m, 2)."""
        if self._path is not None:
            return places_on(self._path, points)
        from scipy.spatial import KDTree  # imported here: slow, and needed by this view only

        _, nearest = KDTree(self._points).query(points)
        legs = np.stack([nearest, (nearest - 1) % len(self._points)])
        along = (np.roll(self._points, -1, axis=0) - self._points)[legs]
        away = points - self._points[legs]
        square = np.maximum(np.sum(along * along, axis=-1), np.finfo(float).tiny)
        fraction = np.clip(np.sum(away * along, axis=-1) / square, 0.0, 1.0)
        missed = np.sum((away - fraction[..., None] * along) ** 2, axis=-1)
        closer = np.argmin(missed, axis=0), np.arange(len(points))
        return (self.place[legs] + fraction * np.diff(self.place)[legs])[closer]

    def mean(self, record: "Record", samples: Any) -> "Array":
        """Return the mean tension, N, at the places of the line, which are fixed in space."""
        total = np.zeros_like(self.place)
        for sample in samples:
            places = self.places_of(_joints(record, sample))
            tension = record.channels["tension"][sample]
            total += np.interp(self.place, places, tension, period=self.length)
        return total / len(samples)


def _joints(record: "Record", sample: int) -> "Array":
    bodies = np.column_stack([record.channels["x"][sample], record.channels["y"][sample]])
    return 0.5 * (bodies + np.roll(bodies, 1, axis=0))


def runs_of(values: Any) -> list[tuple[int, int, int]]:
    """Return each run of equal values: the value, its first index, and its last one plus one."""
    ends = [0, *(np.flatnonzero(np.diff(values)) + 1), len(values)]
    return [(int(values[a]), int(a), int(b)) for a, b in pairwise(ends)]


def first_free_body(touched: "Array") -> int:
    """Return the first body after the contact arc of the first pulley; 0 if none touches it.

    Bodies within the arc may lift off, so the arc ends where the longest gap begins.
    """
    on = np.flatnonzero(touched == 0)
    if not on.size:
        return 0
    gaps = np.diff(on, append=on[0] + len(touched))
    return int(on[np.argmax(gaps)] + 1) % len(touched)


def tension(record: "Record", figure: "Figure | SubFigure", sample: int = -1) -> None:
    """Draw the tension along the belt: at a sample, its mean until then, and that of the spans."""
    require_channels(record, "tension", ("x", "y", "pulley_index", "tension"))
    pulleys = pulleys_of(record)
    until = slice(0, sample % len(record.time) + 1)
    part = record._replace(channels={n: v[until] for n, v in record.channels.items()})
    belt = BeltLine(part, -1)
    now = np.asarray(part.channels["tension"][-1])[np.append(belt.order, belt.order[0])]
    samples = np.flatnonzero(averaged_part(part))
    whole = "mean_duration" in record.quantities
    words = f"mean over {'whole periods' if whole else 'the last fifth'}"
    set_height(figure, 4.0)
    set_title(figure, title_of(record))
    ax = figure.subplots()
    ax.grid(visible=True)
    ax.margins(x=0.0)
    few = samples[:: -(-len(samples) // MAX_SAMPLES)]
    handles: dict[str, Any] = {}
    last = sample % len(record.time) == len(record.time) - 1
    at = "last sample" if last else f"at {picture_text(part.time[-1])} s"
    (handles[at],) = ax.plot(belt.place, now, **line_look(0))
    (handles[words],) = ax.plot(belt.place, belt.mean(part, few), **line_look(1))
    means = mean_spans(part, samples, len(pulleys))
    for number, start, end in belt.spans:
        (line,) = ax.plot([start, end], [means[number]] * 2, **line_look(2))
        handles["mean of a span, as in the summary"] = line
    longest: dict[int, tuple[float, float]] = {}
    for number, start, end in belt.arcs:
        ax.axvspan(start, end, color=ARC_SHADES[0], linewidth=0)
        handles["on a pulley"] = Patch(color=ARC_SHADES[0])
        longest[number] = max(longest.get(number, (0.0, 0.0)), (start, end), key=np.ptp)
    names = {float(np.mean(ends)): pulleys[number].name for number, ends in longest.items()}
    write_above(ax, names, belt.place)
    ax.set_ylabel(axis_label("tension", record.units["tension"]))
    first, second, *_ = (pulley.name for pulley in pulleys)
    words = f"distance along the belt from {first} towards {second}"
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

    Parameters
    ----------
    body : int, optional
        By default the one in the middle of the first span at the start, or the one that touches
        pulleys longest. Of one that meets no pulley its place is drawn instead of forces.
    """
    names = ["pulley_speed", "tension", "normal_force"]
    names += ["friction_force", "slip_velocity"] if has_friction(record) else []
    require_channels(record, "body", [*names, "pulley_index"])
    pulleys = pulleys_of(record)
    index = np.asarray(record.channels["pulley_index"])
    number = default_body(index) if body is None else body
    if not 0 <= number < index.shape[1]:
        raise InputError(
            f"there is no body {number}; the bodies of this belt are 0 to {index.shape[1] - 1}"
        )
    touched = index[:, number]
    meets = bool((within(record, window).channels["pulley_index"][:, number] >= 0).any())
    if not meets:  # what else is known of it
        names = ["pulley_speed", "tension", *(name for name in "xy" if name in record.channels)]
    words = {"tension": f"tension before body {number}"}
    words |= {name: f"{name} of body {number}" for name in "xy"}
    panels = {words.get(name, name.replace("_", " ")): {name: ""} for name in names}
    own = {name: np.asarray(record.channels[name])[:, number] for name in names[1:]}
    for name in set(own) - {"tension", "x", "y"}:  # defined while the body touches a pulley
        own[name] = np.where(touched < 0, np.nan, own[name])
    known = record._replace(
        channels={**record.channels, **own}, axes=record.axes | dict.fromkeys(own, "")
    )
    by_label, handles = over_time([known], panels, figure, window=window, events=False)
    axes = list(by_label.values())
    for ax, name in zip(axes, names, strict=True):
        if name in own:
            ax.lines[0].set_color(BLACK)  # the colours are those of the pulleys
        if name not in "xy":
            ax.axhline(0.0, color=BLACK, linewidth=0.5)
    time, places = record.time, {}
    for value, first, stop in runs_of(touched):
        if value >= 0:
            start, end = time[first], time[min(stop, len(time) - 1)]
            colour = ARC_SHADES[value % len(ARC_SHADES)]
            for ax in axes:
                ax.axvspan(start, end, color=colour, linewidth=0)
            places[float(0.5 * (start + end))] = pulleys[value].name
            handles[f"body {number} on {pulleys[value].name}"] = Patch(color=colour)
    ends = axes[-1].get_xlim()
    if not meets:
        span = f"from {picture_text(ends[0])} s to {picture_text(ends[1])} s"
        text = f"body {number} meets no pulley {span}: there are no forces on it, and no slip"
        axes[0].set_title(text, fontsize="small", loc="left")
    write_above(axes[0], places, ends)
    if "slip_velocity" in names and "sticking" in record.channels:
        sticks = np.asarray(record.channels["sticking"])[:, number] > 0
        look: Look = {"color": VERMILION, "linewidth": 3.0, "solid_capstyle": "butt"}
        axes[names.index("slip_velocity")].plot(time, np.where(sticks, 0.0, np.nan), **look)
        if sticks.any():
            handles["sticking"] = Line2D([], [], **look)
    axes[-1].set_xlim(ends)
    add_legend(figure, handles)


def default_body(touched: "Array") -> int:
    """Return the body in the middle of the first span at the start, if it meets a pulley.

    Else the one that touches pulleys for the longest time.

    Parameters
    ----------
    touched : (samples, bodies)
        The pulley that each body touches; -1 if none.
    """
    start = first_free_body(touched[0])
    ahead = np.flatnonzero(np.roll(touched[0], -start) >= 0)
    number = int(start + (ahead[0] if ahead.size else 0) // 2) % touched.shape[1]
    longest = np.sum(touched >= 0, axis=0)
    return number if longest[number] or not longest.any() else int(np.argmax(longest))


# Friction over slip.

MAX_POINTS = 10_000  # of a cloud
FINE = 400  # points of a curve
SLOWEST = 1e-6  # m/s, to which the axis reaches at least
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
    set_height(figure, 4.5)
    set_title(figure, title_of(record))
    ax = figure.subplots()
    ax.grid(visible=True)
    handles: dict[str, Any] = {}
    for j, pulley in enumerate(pulleys_of(record)):
        on = np.flatnonzero((index == j) & (normal > 0.0))
        few = on[:: -(-on.size // MAX_POINTS)] if on.size else on
        ratio = force.ravel()[few] / normal.ravel()[few]
        look: Look = {"color": line_look(j)["color"], "linestyle": "", "markersize": 2.5}
        (handles[f"bodies on {pulley.name}"],) = ax.plot(
            slip.ravel()[few], ratio, marker="o", mew=0.0, zorder=3, rasterized=True, **look
        )
    handles |= _draw_law(ax, record, float(np.max(np.abs(slip[index >= 0]), initial=SLOWEST)))
    ax.axhline(0.0, color=BLACK, linewidth=0.5)
    ax.set_ylabel("friction over normal force, 1")
    words = "slip velocity of the rim against the belt"
    ax.set_xlabel(axis_label(words, "m/s", letters_across(figure)))
    add_legend(figure, handles)


def _draw_law(ax: Any, record: "Record", fastest: float) -> dict[str, Any]:
    """Draw mu(v) of each pair of coefficients up to a slip velocity, m/s."""
    effects, handles = scenario_run_of(record).effects, dict[str, Any]()
    law = effects.belt_friction
    assert law is not None  # there are channels of friction
    assert record.statistics is not None
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
            time = law.elementary_time or record.time[-1] / max(record.statistics.steps, 1)
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
    scenario = scenario_run_of(record)
    length = at_rest(scenario).body_length
    work = np.asarray(record.channels["friction_work"][sample]) / length
    edges = length * np.arange(len(work) + 1)
    set_height(figure, 4.0)
    set_title(figure, title_of(record))
    ax = figure.subplots()
    ax.grid(visible=True)
    ax.margins(x=0.0)
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


# The drive.

NEEDED = ("x", "y", "tension", "normal_force", "pulley_index")


def drive(record: "Record", figure: "Figure | SubFigure", sample: int = -1) -> None:
    """Draw belt and pulleys at a sample, with the forces on the bodies as bars.

    The belt is coloured by its tension. Outward bars are the normal forces on its bodies, inward
    bars the friction forces. A strip on the belt is black where it sticks, white where it slips.
    """
    more = ("friction_force", "sticking") if has_friction(record) else ()
    require_channels(record, "drive", (*NEEDED, *more))
    draw_mechanism(record, figure, sample)
