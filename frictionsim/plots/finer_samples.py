"""Samples between the recorded ones, for curves over an angle that turns far from sample to sample.

What is drawn remains what the file says: the angle between two samples follows from its velocities
at these (a cubic polynomial), torques from the equations of the scenario at that angle, if these
give the recorded torques at both samples. Other channels are linear in between, as their drawn
lines are, and so is everything next to events, where torques may jump.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.errors import InputError
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.recorded import scenario_of
from frictionsim.scenario.validation import ValidationFailure, validate
from frictionsim.solvers.mechanism import Mechanism, Trajectory

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.results import Record

    Array = npt.NDArray[np.float64]

FAR = 0.06  # rad, between two samples: there are finer ones in between
STEP = 0.04  # rad, from one of these to the next
MAX_POINTS = 20_000
AGREES = 1e-6  # of the largest torque: the equations give what is recorded
NEEDED = ("angle", "angular_velocity", "mode")


def refined(result: "Record") -> "Record":
    """Return a record with finer samples where the angle turns far between its own.

    Parameters
    ----------
    result : Record
        Of one coordinate. Without `angle`, `angular_velocity` or `mode` it is returned as it is.
    """
    channels = result.channels
    if not set(NEEDED) <= channels.keys() or channels["time"].size < 2:
        return result
    mechanism = _mechanism_of(result)
    fine, interval = _fine_times(result)
    if mechanism is None or fine.size == channels["time"].size:
        return result
    time = channels["time"]
    angle, velocity = _hermite(
        time, channels["angle"], channels["angular_velocity"], fine, interval
    )
    found: dict[str, Any] = {}
    for name, values in channels.items():
        if result.axes.get(name):
            found[name] = np.stack([np.interp(fine, time, column) for column in values.T], axis=1)
        elif np.asarray(values).dtype.kind in "iub":
            found[name] = values[interval]
        else:
            found[name] = np.interp(fine, time, values)
    found |= {"time": fine, "angle": angle, "angular_velocity": velocity}
    mode = found["mode"]
    at_samples = _torques(
        mechanism, channels["angle"], channels["angular_velocity"], channels["mode"]
    )
    between = _torques(mechanism, angle, velocity, mode)
    for name in at_samples.keys() & channels.keys():
        off = np.abs(at_samples[name] - channels[name])
        agree = off <= AGREES * float(np.max(np.abs(channels[name])))
        after = np.minimum(interval + 1, time.size - 1)
        sound = agree[interval] & agree[after] & ~np.isin(fine, time)
        found[name] = np.where(sound, between[name], found[name])
    return result._replace(channels=found)


def _mechanism_of(result: "Record") -> Mechanism | None:
    """Return the mechanism of the scenario; None if another version wrote it."""
    try:
        scenario = validate(scenario_of(result), Path())
    except (InputError, ValidationFailure):
        return None
    build = getattr(mechanism_module(scenario.kind), "build", None)
    found = None if build is None else build(scenario)
    return found if isinstance(found, Mechanism) else None


def _fine_times(result: "Record") -> tuple["Array", Any]:
    """Return all times, s, those of the samples among them, and the sample before each."""
    time, angle = result.channels["time"], result.channels["angle"]
    turned = np.abs(np.diff(angle))
    at_event = np.isin(time, result.events["time"])
    smooth = ~(at_event[1:] | at_event[:-1]) & np.isfinite(turned) & (turned > FAR)
    counts = np.where(smooth, np.ceil(turned / STEP), 1.0).astype(int)
    if counts.sum() > MAX_POINTS:
        counts = np.minimum(counts, max(1, MAX_POINTS // counts.size))
    interval = np.repeat(np.arange(counts.size), counts)
    within = np.arange(interval.size) - np.repeat(np.cumsum(counts) - counts, counts)
    share = within / counts[interval]
    fine = time[interval] + share * np.diff(time)[interval]
    fine = np.where(within == 0, time[interval], fine)
    return np.append(fine, time[-1]), np.append(interval, time.size - 1)


def _hermite(
    time: "Array", angle: "Array", velocity: "Array", fine: "Array", interval: Any
) -> tuple["Array", "Array"]:
    """Return angle and velocity at fine times, by the cubic polynomial between two samples."""
    first = np.minimum(interval, time.size - 2)
    step = np.diff(time)[first]
    u = np.divide(fine - time[first], step, out=np.zeros_like(fine), where=step > 0.0)
    start, stop = angle[first], angle[first + 1]
    rise, end_rise = step * velocity[first], step * velocity[first + 1]
    rest = 3.0 * (stop - start) - 2.0 * rise - end_rise
    cubic = rise + end_rise - 2.0 * (stop - start)
    found = start + u * (rise + u * (rest + u * cubic))
    slope = np.divide(
        rise + u * (2.0 * rest + 3.0 * u * cubic), step, out=velocity[first] * 1.0, where=step > 0.0
    )
    return found, slope


def _torques(mechanism: Mechanism, angle: "Array", velocity: "Array", mode: Any) -> dict[str, Any]:
    """Return the torques that follow from angle, velocity and mode, N m, by channel."""
    none = np.zeros_like(angle)
    trajectory = Trajectory(
        none, none, angle, velocity, none, none, np.asarray(mode, dtype=float), {}, {}, []
    )
    found = dict(mechanism.channels(trajectory))
    found.pop("drive_torque", None)  # of the time
    if mechanism.contact is not None:
        forward = mechanism.contact.kinetic_limit(0.0, angle, velocity, 1)
        backward = mechanism.contact.kinetic_limit(0.0, angle, velocity, -1)
        found["friction_torque"] = np.where(mode > 0, -forward, np.where(mode < 0, backward, none))
    return found
