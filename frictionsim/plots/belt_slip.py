"""The slip of a belt drive over time, with its mean as in the summary."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.display import BLACK
from frictionsim.errors import InputError
from frictionsim.mechanisms.belt_drive.slip import (
    Ends,
    ends_of,
    mean_power,
    senses_of,
    slip_percent,
    speed_at_rest,
)
from frictionsim.motion.belt_path import path_of
from frictionsim.plots.style import Style, axis_label, line_style
from frictionsim.scenario.toml_data import scenario_value
from frictionsim.simulation.averages import last_part, smooth_mean

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.plots.belt_geometry import Pulley
    from frictionsim.results import Record

    Array = npt.NDArray[np.float64]

FAST = 0.1  # of the largest speed of the driver: the scale is that of the slip above it
MARGIN, MIN_MARGIN = 0.08, 0.01  # of the range of the slip, and of the slip, above and below it
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
        Of the mean speeds in the last fifth, as in the summary.
    """

    ends: Ends
    percent: "Array"
    fast: "npt.NDArray[np.bool_]"
    mean: float


def slip_of(result: "Record", pulleys: "list[Pulley]") -> Slip:
    """Return the slip of the driven pulley against the driver, by the definition of the summary."""
    time, speed = result.channels["time"], result.channels["pulley_speed"]
    last = last_part(time)
    torque = result.channels["pulley_torque"][last]
    ends = ends_of(mean_power(time[last], torque, speed[last]))
    mean_speed = smooth_mean(time[last], speed[last])
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


def draw_slip(ax: Any, result: "Record", pulleys: "list[Pulley]") -> list[Any]:
    """Draw the slip over time and its mean; return the legend handles.

    The scale is that of the times in which the driver is not much slower than at its fastest:
    of two speeds near zero, the slip is no more than their difference makes of it.
    """
    found, time = slip_of(result, pulleys), result.channels["time"]
    driven, driver = (pulleys[i].name for i in (found.ends.driven, found.ends.drive))
    ax.set_ylabel(axis_label(f"slip of {driven}", "%", LABEL_WIDTH))
    if not np.isfinite(found.percent).any():
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
    ax.plot(time, found.percent, **(line_style(found.ends.driven) | {"linewidth": 1.0}))
    shown = found.percent[found.fast & np.isfinite(found.percent)]
    handles = []
    if np.isfinite(found.mean):
        last = time[last_part(time)]
        words = f"mean slip over the last fifth, {found.mean:.4g} %"
        handles = ax.plot(last[[0, -1]], [found.mean] * 2, **MEAN, label=words)
        shown = np.append(shown, found.mean)
    if shown.any():
        margin = max(MARGIN * float(np.ptp(shown)), MIN_MARGIN * float(np.max(np.abs(shown))))
        ax.set_ylim(float(shown.min()) - margin, float(shown.max()) + margin)
    return list(handles)
