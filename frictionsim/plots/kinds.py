"""The views of pulley, marble machine, epicyclic gear and shaft."""

from collections.abc import Callable, Mapping, Sequence
from math import radians
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.patches import Patch

from frictionsim.display import (
    BLACK,
    CORD_SLIPS_SHADE,
    CORD_STICKS_SHADE,
    EDGE,
    GREY,
    ROLES,
    picture_text,
    with_minus,
)
from frictionsim.errors import InputError, counted
from frictionsim.mechanisms.effects import ShaftFriction
from frictionsim.mechanisms.epicyclic.equation import path_of
from frictionsim.mechanisms.pulley.schema import limiting_ratio
from frictionsim.motion.parts import Body, Detail, Line
from frictionsim.motion.samples import effect_in, scenario_in
from frictionsim.motion.shapes import bounds_around
from frictionsim.plots.mechanism import draw_still, motion_at
from frictionsim.plots.over_time import WHOLE, event_look, over_time, panels_of, within, write_above
from frictionsim.plots.style import (
    LIMIT,
    Look,
    add_legend,
    axis_label,
    line_look,
    require_channels,
    set_height,
    set_title,
    single_panel,
    title_of,
)
from frictionsim.scenario.toml_data import scenario_of
from frictionsim.simulation.record import sticking_phases, with_jumps

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.fits.data import Target
    from frictionsim.motion.parts import Part, Role
    from frictionsim.plots.over_time import Window
    from frictionsim.results import Record


class View(NamedTuple):
    """A picture of a kind."""

    # `draw(record, figure, **options)` draws a result into an empty figure or subfigure.
    draw: Callable[..., None]
    # Those of "time", "window", "channels", "measured" and "body" that it takes; `time` as
    # `sample`, the number of a sample.
    options: tuple[str, ...] = ()
    # The channels in which several results are drawn over each other, () for those of the kind;
    # None for a view in which they are not.
    overlaid: tuple[str, ...] | None = None
    effect: str = ""  # the effect that a result needs for this view; empty if it needs none


OVER_TIME = ("window", "channels", "measured")


def response(
    record: "Record",
    figure: "Figure | SubFigure",
    channels: Sequence[str] = (),
    window: "Window" = WHOLE,
    measured: Sequence["Target"] = (),
) -> None:
    """Draw the channels of the kind over time, or others, with the limits of static friction."""
    if not channels and "hanging_masses" in scenario_of(record).get("effects", {}):
        _response_with_masses(record, figure, window)
        return
    panels = panels_of(record, channels)
    limits = _limits(record, panels)
    look: Look = {"limits": limits, "window": window, "measured": measured}
    _, handles = over_time([record], panels, figure, **look)
    add_legend(figure, handles)


MAX_LIMIT = 3.0  # of the largest force; a higher limit would flatten the channel
DRIVES = {"drive_force": "force", "drive_torque": "torque"}


def _limits(record: "Record", panels: Mapping[str, Mapping[str, str]]) -> dict[str, dict[str, Any]]:
    """Return the force or torque of impending motion, and the limit of the friction torque."""
    limits: dict[str, dict[str, Any]] = {}
    journal = effect_in(record, "shaft_friction")
    for label, channels in panels.items():
        name = next(iter(channels))
        if name in DRIVES and "friction_torque" in record.channels:
            highest = MAX_LIMIT * np.max(np.abs(record.channels[name]))
            for way in ("lift", "hold"):
                quantity = record.quantities.get(f"{DRIVES[name]}_to_{way}")
                value = None if quantity is None else quantity.value
                if value is not None and abs(value) <= highest:
                    words = f"to {way}: {with_minus(picture_text(value))} {record.units[name]}"
                    limits.setdefault(label, {})[words] = value
        if not isinstance(journal, ShaftFriction):
            continue
        radius = journal.static_radius
        if name == "friction_torque" and "shaft_reaction" in record.channels:
            load = journal.load_of(np.asarray(record.channels["shaft_reaction"]))
            limit = radius * load + np.zeros(len(record.time))
            both = np.column_stack([limit, -limit])
            limits[label] = {"limit of static friction": (record.time, both)}
        if name == "lever_arm" and journal.normal_load is None:
            limits[label] = {f"static friction radius: {picture_text(radius)} m": radius}
    return limits


CORD = "cord"
CAR, COUNTERWEIGHT = "rope_tension_car", "rope_tension_counterweight"
RIM, SLIDING, RATIO = "rim_speed", "slip_speed", "tension_ratio"
GAPS = {"car_gap": "car", "counterweight_gap": "counterweight"}
DERIVED = {RIM: "m/s", SLIDING: "m/s", RATIO: "1", **dict.fromkeys(GAPS, "m")}
MIN_GAP = 1e-9  # of the cord radius: a smaller one is roundoff
PANELS = {
    "drive force": {"drive_force": ""},
    "drive torque": {"drive_torque": ""},
    "tension of the rope": {CAR: "car", COUNTERWEIGHT: "counterweight"},
    "friction torque": {"friction_torque": ""},
    "velocity": {"car_velocity": "car", RIM: "rim of the pulley"},
    "height above the start": {"car_position": "car"},
    "slip of the cord": {"cord_slip": ""},
    "slack rope": GAPS,
}
KINETIC: Look = LIMIT | {"color": GREY, "linestyle": (0, (1, 1.2)), "linewidth": 1.2}
BAND = "counterweight's tension at which the cord keeps sticking"


def _response_with_masses(record: "Record", figure: "Figure | SubFigure", window: "Window") -> None:
    """Draw drive, tensions, friction, speeds, height, and slip or slack over time."""
    known = with_derived(record)
    drawn = {
        name
        for name, values in known.channels.items()
        if name not in DRIVES or np.any(values)  # nothing drives it
    }
    panels = {
        label: {name: words for name, words in channels.items() if name in drawn}
        for label, channels in PANELS.items()
        if drawn & channels.keys()
    }
    if not panels:
        raise InputError("cannot draw this result: it has no channel that can be drawn over time")
    limits = _limits(record, panels)
    axes, handles = over_time([known], panels, figure, limits=limits, window=window)
    if {CAR, COUNTERWEIGHT} <= drawn and (largest := ratios(record)) is not None:
        time, tension = with_jumps(record, CAR)
        slips = np.zeros(time.shape, dtype=bool)
        for start, stop in slipping_phases(record):
            slips |= (time > start) & (time < stop)
        ends = tension / largest[0], tension * largest[0]
        ax = axes["tension of the rope"]
        ax.fill_between(time, *ends, where=~slips, color=CORD_STICKS_SHADE, zorder=1.1)
        handles[BAND] = Patch(color=CORD_STICKS_SHADE)
    add_legend(figure, handles)


def ratios(record: "Record") -> tuple[float, Any] | None:
    """Return the largest ratios of tensions, static and kinetic; None if the cord cannot slip.

    That of friction over the speed is one for each sample; at the speed zero without speeds of
    slip, of `with_derived`.
    """
    cord = effect_in(record, "cord_friction")
    if cord is None:
        return None
    static, kinetic = limiting_ratio(cord.mu_s, cord.wrap_deg), cord.ratio_over_speed
    if not kinetic.varies or SLIDING not in record.channels:
        return static, kinetic.at_rest
    return static, np.array([kinetic.at(v) for v in record.channels[SLIDING].tolist()])


def slipping_phases(record: "Record") -> list[tuple[float, float]]:
    """Return start and end of each phase in which the cord slips, s; none if it is not recorded."""
    if "cord_mode" not in record.channels:
        return []
    ends = [record.time[0], *np.ravel(list(sticking_phases(record, CORD))), record.time[-1]]
    return [(float(a), float(b)) for a, b in zip(ends[::2], ends[1::2], strict=True) if b > a]


def traction(record: "Record", figure: "Figure | SubFigure", window: "Window" = WHOLE) -> None:
    """Draw the ratio of the tensions with its limits (Euler, Eytelwein), and slip of the cord."""
    require_channels(record, "traction", (CAR, COUNTERWEIGHT))
    known = with_derived(record)
    largest = ratios(known)
    assert largest is not None  # the view is one of cord friction
    wanted = {
        "counterweight's tension / car's": RATIO,
        "speed of slip": SLIDING,
        "slip of the cord": "cord_slip",
    }
    panels = {words: {name: ""} for words, name in wanted.items() if name in known.channels}
    axes, handles = over_time([known], panels, figure, window=window, events=False)
    first = next(iter(axes.values()))
    for sort, ratio, look in zip(("static", "kinetic"), largest, (LIMIT, KINETIC), strict=True):
        if isinstance(ratio, float):
            first.axhline(1.0 / ratio, **look)
            words = f"limit of {sort} friction: {picture_text(1.0 / ratio)} and"
            handles[f"{words} {picture_text(ratio)}"] = first.axhline(ratio, **look)
        else:
            first.plot(known.time, 1.0 / ratio, **look)
            handles[f"limit of {sort} friction"] = first.plot(known.time, ratio, **look)[0]
    ends = record.time[[0, -1]]
    times: dict[float, str] = {}
    for start, stop in slipping_phases(record):
        for ax in axes.values():
            ax.axvspan(start, stop, color=CORD_SLIPS_SHADE, linewidth=0)
        handles["the cord slips"] = Patch(color=CORD_SLIPS_SHADE)
        times |= {at: f"{picture_text(at)} s" for at in (start, stop) if ends[0] < at < ends[1]}
    write_above(first, times, first.get_xlim())
    add_legend(figure, handles)


def with_derived(record: "Record") -> "Record":
    """Return a result with speed of the rim, speed of slip, ratio of tensions and gaps of ropes.

    Each is there if the channels are from which it follows; a gap only if the rope falls slack.
    """
    geometry = scenario_in(record).mechanism
    radius, begin = geometry.cord_radius, radians(geometry.initial_angle_deg)

    def derived(of: Mapping[str, Any]) -> dict[str, Any]:
        new: dict[str, Any] = {}
        if "angular_velocity" in of:
            new[RIM] = radius * of["angular_velocity"]
            if "car_velocity" in of and "cord_slip" in of:
                new[SLIDING] = of["car_velocity"] - new[RIM]
        if {CAR, COUNTERWEIGHT} <= of.keys():
            with np.errstate(divide="ignore", invalid="ignore"):
                new[RATIO] = of[COUNTERWEIGHT] / of[CAR]
        if {"angle", "slack"} <= of.keys():
            for gap, sign in zip(GAPS, (-1.0, 1.0), strict=True):
                if f"{GAPS[gap]}_position" in of:
                    rim = sign * radius * (of["angle"] - begin)
                    new[gap] = of[f"{GAPS[gap]}_position"] + rim
        return new

    new = derived({name: np.asarray(values) for name, values in record.channels.items()})
    new = {
        name: values
        for name, values in new.items()
        if name not in GAPS or np.max(values, initial=0.0) > MIN_GAP * radius
    }
    sides: dict[str, Any] = {}
    for side in ("before", "after"):
        names = {n: "angle" if n == "angle" else f"{n}_{side}" for n in record.channels}
        known = {n: record.events[name] for n, name in names.items() if name in record.events}
        sides |= {f"{n}_{side}": values for n, values in derived(known).items() if n in new}
    none = dict.fromkeys(new, "")
    return record._replace(
        channels={**record.channels, **new},
        axes=record.axes | none,
        units=record.units | {name: DERIVED[name] for name in new},
        long_names=record.long_names | none,
        events=record.events | sides,
    )


TURN = 2.0 * np.pi
TORQUES = {
    "drive_torque": "drive",
    "uniform_torque": "for uniform rotation",
    "friction_torque": "friction",
}


def torque_of_gear(
    record: "Record", figure: "Figure | SubFigure", window: "Window" = WHOLE
) -> None:
    """Draw the torques on the crank over its angle: drive, uniform rotation and friction.

    The friction torque is signed: negative where it opposes a forward motion.
    """
    require_channels(record, "torque", ("angle",))
    names = {words: name for name, words in TORQUES.items() if name in record.channels}
    if not names:
        raise InputError(
            "cannot draw the view 'torque': this result has none of the channels"
            f" {', '.join(TORQUES)} (see output.channels)"
        )
    shown = within(record, window)
    ax = single_panel(figure, 4.0, title_of(record))
    torques = {words: shown.channels[name] for words, name in names.items()}
    handles = _over_angle(ax, shown, torques)
    ax.axhline(0.0, color=BLACK, linewidth=0.6)
    ax.set_ylabel(axis_label("torque on the crank", "N m"))
    ax.set_xlabel("angle of the crank, rad")
    of_turns: Any = (lambda angle: angle / TURN, lambda turns: turns * TURN)
    turns = ax.secondary_xaxis("top", functions=of_turns)
    turns.set_xlabel("turns from the horizontal")
    add_legend(figure, handles)


def _over_angle(ax: Any, record: "Record", torques: Mapping[str, Any]) -> dict[str, Any]:
    """Draw torques over the angle; return the handles by words."""
    ax.grid(visible=True)
    ax.margins(x=0.0)
    angle = record.channels["angle"]
    still = {} if np.ptp(angle) > 0.0 else {"marker": "o"}  # a line could not be seen
    return {
        words: ax.plot(angle, values, **line_look(i), **still)[0]
        for i, (words, values) in enumerate(torques.items())
    }


FINER = 0.5  # of the range of all torques: a panel with more of it would show the same
MARGIN = 0.25  # of the range of load and friction, above and below it
TRANSFER, MAX_TRANSFERS = "transfer", 60


def torque_of_machine(
    record: "Record", figure: "Figure | SubFigure", window: "Window" = WHOLE
) -> None:
    """Draw the torques on the gear over its angle: all, and again at the scale of the load.

    The torque of the motor is multiplied by the gear ratio. In steady motion it equals the load
    minus the (negative) friction torque, which is drawn too. The second panel is drawn only if its
    scale is finer.
    """
    require_channels(record, "torque", ("angle", "motor_torque"))
    ratio = scenario_in(record).mechanism.gear_ratio
    shown = within(record, window)
    names = {"load_torque": "load of the marbles", "friction_torque": "friction"}
    resisting = {w: np.asarray(shown.channels[n]) for n, w in names.items() if n in shown.channels}
    if len(resisting) == 2:
        load, friction = resisting.values()
        resisting["load minus friction"] = load - friction
    motor = ratio * np.asarray(shown.channels["motor_torque"])
    torques = {"motor, times the gear ratio": motor, **resisting}
    near = np.concatenate(list(resisting.values())) if resisting else np.zeros(1)
    margin = MARGIN * float(np.ptp(near))
    shown_range = float(np.ptp(near)) + 2.0 * margin
    two = 0.0 < shown_range <= FINER * float(np.ptp(list(torques.values())))
    set_height(figure, 5.5 if two else 3.6)
    set_title(figure, title_of(record))
    axes = figure.subplots(1 + two, 1, sharex=True, squeeze=False)[:, 0]
    for ax in axes:
        handles = _over_angle(ax, shown, torques)
    axes[0].set_ylabel(axis_label("torque on the gear", "N m"))
    if two:
        axes[1].set_ylim(near.min() - margin, near.max() + margin)
        axes[1].set_ylabel(axis_label("at the scale of the load", "N m"))
    axes[-1].set_xlabel("angle of the gear, rad")
    figure.align_ylabels(axes)
    if TRANSFER in shown.contacts and "angle" in shown.events:
        at = shown.events["angle"][shown.events["contact"] == shown.contacts.index(TRANSFER)]
        for angle in at if at.size <= MAX_TRANSFERS else ():
            for ax in axes:
                handles[TRANSFER] = ax.axvline(angle, **event_look(TRANSFER))
    add_legend(figure, handles)


CUSP: Look = {"marker": "D", "mfc": "white", "mec": BLACK, "markersize": 5, "linestyle": ""}
SAME = 1e-9  # of the length of the crank: cusps of several turns that lie in one place
MAX_CUSPS = 100_000  # more would cover the path and take minutes
TRACER, DOT = "tracer point", {"marker": "o", "color": ROLES["path"], "mec": EDGE, "linestyle": ""}
FINE, WIDER = 201, 0.2  # points of a dwell; margin around it where it is enlarged


def path(record: "Record", figure: "Figure | SubFigure", sample: int = -1) -> None:
    """Draw the path of the tracer point of the whole run, with sun, planet and crank at a sample.

    Its cusps are marked, and where the point dwells longest, as the summary counts both; enlarged,
    with the swing of a point beyond the rim.
    """
    if not {"tracer_x", "tracer_y"} <= record.channels.keys():
        raise InputError(
            "cannot draw the view 'path': this result has no channel tracer_x, tracer_y; add"
            " effects.tracer_point to the scenario (see output.channels)"
        )
    motion, traced = motion_at(record, sample), path_of(scenario_in(record))
    channels = record.channels
    # Without forces and couples, which the view `mechanism` has; the path is in front of bodies.
    bodies = [part for part in motion.parts if isinstance(part, Body) and part.name != TRACER]
    lines = [part for part in motion.parts if isinstance(part, Line) and part.size is None]
    parts: list[Part] = [*bodies, *lines]
    motion = motion._replace(scale=0.0)
    if {"angle", "angular_velocity"} <= channels.keys():
        names = ("time", "angle", "angular_velocity")
        dwell = traced.longest_dwell(tuple(channels[name] for name in names))
        if dwell is not None:
            swing, back = traced.swing() or (0.0, 0.0)
            marks: dict[str, tuple[float, Role]] = {
                f"longest dwell, {picture_text(dwell.time)} s": (dwell.half, "cord")
            }
            points: list[Any] = []
            if swing:
                marks[f"swing, {picture_text(swing)} m"] = (back, "marked")
            # The longer one first, which the other is in front of.
            for words, (half, role) in sorted(marks.items(), key=lambda mark: -mark[1][0]):
                turned = dwell.angle + np.linspace(-half, half, FINE)
                points.append(np.stack(traced.position(turned), axis=-1))
                parts.append(Line(words, points[-1][None], role))
            seen = np.concatenate(points)
            around = bounds_around(seen, WIDER * float(np.ptp(seen, axis=0).max()))
            motion = motion._replace(details=(Detail("the dwell, enlarged", around),))
    ax, handles = draw_still(record, figure, motion._replace(parts=tuple(parts)))
    place = channels["tracer_x"][sample], channels["tracer_y"][sample]
    (handles[TRACER],) = ax.plot(*place, zorder=5, **DOT)  # in what is enlarged it would hide all
    if "angle" in channels:
        first, count = traced.cusps(channels["angle"]) or (0.0, 0.0)
        if 0.0 < count <= MAX_CUSPS:
            xy = np.column_stack(traced.position(traced.angle_of(first + np.arange(count))))
            _, once = np.unique(np.round(xy / (SAME * traced.length)), axis=0, return_index=True)
            (handles[counted(int(count), "cusp")],) = ax.plot(*xy[once].T, zorder=5, **CUSP)
    add_legend(figure, handles, columns=3)
