"""The quantities of a belt drive's summary, and the checks of its run: all from its samples.

Means are over the last fifth of a run. With a patch the motion repeats as often as the belt goes
round, with sines of one frequency as often as they do: the means are over whole periods then.

The audit `torque_balance` compares, at every pulley of radius R and inertia I that the belt passes
in the sense sigma (+1 counter-clockwise), what turns it with what the belt shows of that:

    0 = <M>/R - I <alpha>/R - <sum T>
    0 = sigma (<M>/R - I <alpha>/R) - <T_in - T_out> - m <a> + w

with the torque M on it from outside, the friction T of all bodies on it, and the mean tensions of
the spans before and after it. m is the mass of the belt from the middle of the one span to the
middle of the other, a its acceleration, and w its weight along the belt.
"""

from math import isfinite
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.belt import patch_of_bodies, zones_of
from frictionsim.mechanisms.belt_drive.slip import (
    ends_of,
    mean_power,
    senses_of,
    slip_percent,
    speed_at_rest,
)
from frictionsim.results import Check, Quantities, Quantity
from frictionsim.scenario.signal_tables import SineTable
from frictionsim.simulation.averages import (
    LAST_PART,
    last_part,
    last_periods,
    last_seconds,
    smooth_mean,
    standard_error,
    time_mean,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.channels import BeltSamples

    Array = npt.NDArray[np.float64]

# Of the energy in the springs: less work than this share is none.
MIN_RELATIVE_WORK = 1e-6
# A fixed step closes the energies to second order, the adaptive one to its tolerance; both see
# the jumps of contacts that open, which neither locates.
ENERGY_LIMIT = 5e-3
# A run in which less than this share of the stored energy moved has nothing to be relative to.
STORED_SHARE = 1e-3
FRICTION_LIMIT = 1e-9  # rounding
# While residual slip relaxes, friction may do a little positive work: of its heat, or, where this
# is small against the energies of the run, a hundredth of what their balance may be off.
POWER_LIMIT = 1e-3
SMALL_HEAT = 0.01 * ENERGY_LIMIT / POWER_LIMIT
# Of the largest force: bodies press some hundredths of a radius deep, where their friction has
# another lever than the rim; 0.8 % in the belt of the paper.
FORCE_LIMIT = 0.02
# What may be off by more of it, by the corners of few bodies or by too few samples, is not judged.
MAX_LIMIT = 0.5
# Forces of less than this share of the tension are what corners and contacts make at random.
MIN_FORCE = 0.05
STANDARD_ERRORS = 4.0  # by which a mean of samples may be off
MIN_ROUND_TRIPS = 4.0  # of a wave along the belt in a run whose spans are judged
# Bodies of the length l lie on a pulley as a polygon, whose corners are off the rim by (l/R)^2/8;
# those where the belt comes and goes may differ: this times (l/R)^2 is what they do to a force.
CORNER_FACTOR = 1.0 / 4.0


# --- the part of a run that means are over ------------------------------------------------------


class Averaging(NamedTuple):
    """The samples that means are over.

    Attributes
    ----------
    samples : (n,) of bool
    periods : int
        How many whole periods they are; none for the last fifth.
    to_go : (n,) or None
        Periods from each sample to the end of the run, of a motion that has one.
    """

    samples: "npt.NDArray[np.bool_]"
    periods: int
    to_go: "Array | None"

    @property
    def words(self) -> str:
        """What they are, for messages."""
        if not self.periods:
            return f"the last {round(100.0 * LAST_PART)} % of the run"
        return f"the last {self.periods} whole period{'s' if self.periods > 1 else ''} of the run"

    def mean_speed(self, time: "Array", speed: "Array") -> Any:
        """Return the mean of speeds, (n, ...), whose ripple is not to be left over."""
        mean = time_mean if self.periods else smooth_mean
        return mean(time[self.samples], speed[self.samples])


def averaging_of(run: "BeltSamples") -> Averaging:
    """Return what the means of a run are over."""
    to_go = _periods_to_go(run)
    periods = 0 if to_go is None else last_periods(run.time, to_go)
    if to_go is None or periods == 0:
        return Averaging(last_part(run.time), 0, to_go)
    first = int(np.argmin(np.abs(to_go - periods)))
    return Averaging(last_seconds(run.time, run.time[-1] - run.time[first]), periods, to_go)


def _periods_to_go(run: "BeltSamples") -> "Array | None":
    """Return the periods from each sample to the end; None of a motion that has not one period."""
    time, speed = run.time, run.seen["_belt_speed"]
    terms = [term for drive in run.scenario.drive.values() for term in drive.terms]
    sines = [term.sine for term in terms if isinstance(term, SineTable)]
    frequencies = {sine.frequency_hz for sine in sines if sine.amplitude}
    patched = bool((patch_of_bodies(run.scenario, run.body_length) >= 0).any())
    if len(frequencies) + patched != 1:
        return None
    if frequencies:
        return np.asarray((time[-1] - time) * frequencies.pop())
    belt = run.scenario.mechanism.belt
    stretch = float(np.mean(run.seen["_mean_tension"])) / belt.axial_rigidity
    passed = np.append(0.0, np.cumsum(0.5 * np.diff(time) * (speed[1:] + speed[:-1])))
    return np.abs(passed[-1] - passed) / (run.body_length * belt.bodies * (1.0 + stretch))


# --- the summary --------------------------------------------------------------------------------


def quantities_of(run: "BeltSamples") -> Quantities:
    """Return the summary's quantities of a run."""
    time, seen = run.time, run.seen
    if not time.size:
        return {}
    averaging = averaging_of(run)
    last, friction = averaging.samples, run.scenario.effects.belt_friction is not None

    def mean(name: str) -> Any:
        return time_mean(time[last], seen[name][last])

    spans, touching, sticking = mean("_span_tension"), mean("_touching"), mean("_sticking")
    # A ripple of 0.1 % of two speeds would be 1 % of their difference, the slip.
    speed = averaging.mean_speed(time, seen["_speed"])
    ends = ends_of(time, seen["_torque"], seen["_speed"], last)
    rims = speed * run.radii * senses_of(run.scenario.mechanism.path())
    slip = float(slip_percent(rims, ends, min_rim_speed(run)))
    values = {
        "pretension": (seen["_mean_tension"][0], "N"),
        "tension_tight": (np.max(spans), "N"),
        "tension_slack": (np.min(spans), "N"),
        **{f"tension_{a}_to_{b}": (T, "N") for (a, b), T in zip(run.spans, spans, strict=True)},
        "drive_speed": (speed[ends.drive], "rad/s"),
        "driven_speed": (speed[ends.driven], "rad/s"),
        "slip_percent": (slip if isfinite(slip) else None, "%"),
        "efficiency": (_efficiency(run, last), "1"),
    }
    if friction:
        share = np.sum(sticking) / np.sum(touching) if np.sum(touching) else None
        values["stick_fraction"] = share, "1"
    for name, radius, on, stuck in zip(run.names, run.radii, touching, sticking, strict=True):
        per_body = run.body_length / radius
        values[f"contact_arc_{name}"] = on * per_body, "rad"
        if friction:
            values[f"adhesion_arc_{name}"] = stuck * per_body, "rad"
    values["final_time"] = time[-1], "s"
    if averaging.periods:
        values["mean_duration"] = np.ptp(time[last]), "s"
    if run.scenario.effects.wear is not None:
        zones = zones_of(run.scenario, run.body_length)
        for (name, inside), work in zip(zones.items(), seen["_zone_work"][-1], strict=True):
            length = np.sum(inside) * run.body_length
            values[f"friction_work_{name}"] = work / length if length else None, "J/m"
    values["initial_energy"] = seen["energy_kinetic"][0] + seen["energy_potential"][0], "J"
    for name, energy in seen.items():
        if name.startswith("energy"):
            values[name] = energy[-1], "J"
    return {
        name: Quantity(None if value is None else float(value), unit)
        for name, (value, unit) in values.items()
    }


def min_rim_speed(run: "BeltSamples") -> float:
    """Return the speed below which a rim is at rest, m/s: it may vibrate."""
    tension = float(np.mean(run.seen["_span_tension"][last_part(run.time)]))
    return speed_at_rest(tension, run.scenario.mechanism.belt.mass_per_length)


def _efficiency(run: "BeltSamples", last: Any) -> float | None:
    """Return the work taken out, over the sum of it and the losses.

    That is the work put in less what the drive stores meanwhile, in motion and springs. None where
    nothing is taken out or lost.
    """
    time, seen = run.time[last], run.seen
    heats = (seen[name][last] for name in ("energy_friction", "energy_damping") if name in seen)
    lost = float(sum(heat[-1] - heat[0] for heat in heats))
    power = mean_power(time, seen["_torque"][last], seen["_speed"][last])
    delivered = float(np.sum((-power).clip(min=0.0)) * np.ptp(time))
    least = MIN_RELATIVE_WORK * float(abs(seen["energy_potential"][0]))
    return delivered / (delivered + lost) if delivered + lost > least else None


# --- the audit ----------------------------------------------------------------------------------


def checks_of(run: "BeltSamples") -> dict[str, Check]:
    """Return the audit: energies over the largest of them, forces over their limits."""
    time, seen = run.time, run.seen
    if not time.size:
        return {}
    changes = {n: v - v[0] for n, v in seen.items() if n.startswith("energy")}
    residual = -changes["energy_input"]
    for name, change in changes.items():
        if name != "energy_input":
            residual = residual + change
    largest = max(float(np.max(np.abs(change))) for change in changes.values())
    largest = max(largest, STORED_SHARE * float(abs(seen["energy_potential"][0])))
    checks = {"energy_balance": _relative(float(np.max(np.abs(residual))), largest, ENERGY_LIMIT)}
    if run.scenario.effects.belt_friction is not None:
        over, limit = np.max(seen["_excess"], axis=0)
        checks["friction_law"] = _relative(over, limit, FRICTION_LIMIT)
        driving, heat = np.mean(seen["_power"], axis=0) * np.ptp(time)
        checks["dissipation_sign"] = _relative(
            driving, max(heat, SMALL_HEAT * largest), POWER_LIMIT
        )
    checks["torque_balance"] = torque_balance(run)
    return checks


def _relative(value: float, size: float, limit: float) -> Check:
    return Check(float(value / size if size > 0.0 else value) + 0.0, limit)  # no minus zero


def torque_balance(run: "BeltSamples") -> Check:
    """Return the difference of two ways to one force at the pulley where it is most, and its limit.

    Both are means over the run, over the largest force. The limit counts what the means of samples
    are uncertain by, and of spans what corners do and what bending moments stand for, `_allowance`.
    """
    time, seen, radius = run.time, run.seen, run.radii
    path, belt = run.scenario.mechanism.path(), run.scenario.mechanism.belt
    senses, spans = senses_of(path), seen["_span_tension"]
    torque = seen["_torque"] / radius
    momentum = seen["_speed"] * [p.inertia for p in run.scenario.mechanism.pulleys] / radius
    fall = np.roll(spans, 1, axis=1) - spans
    straight = np.array([np.hypot(*np.subtract(span.end, span.start)) for span in path.spans])
    wrapped = radius * np.abs([arc.wrap_angle for arc in path.arcs])
    mass = belt.mass_per_length * (wrapped + 0.5 * (straight + np.roll(straight, 1)))
    on_belt = senses * torque - fall
    if run.scenario.effects.gravity is not None:
        height = np.array([0.5 * (span.start[1] + span.end[1]) for span in path.spans])
        weight = belt.mass_per_length * run.scenario.effects.gravity.g
        on_belt += weight * (np.roll(height, 1) - height)
    off, uncertain = _mean_difference(
        time,
        np.hstack([torque - seen.get("_friction", np.zeros_like(torque)), on_belt]),
        np.hstack([momentum, senses * momentum + np.outer(seen["_belt_speed"], mass)]),
    )
    # A pulley that bodies leave, or that no other stands beside, has not two spans. And what is in
    # the middle of a span is told by waves.
    touched = np.all(seen["_touching"] > 0.0, axis=0)
    round_trip = path.length * np.sqrt(belt.mass_per_length / belt.axial_rigidity)
    is_told = np.sum(touched) > 1 and np.ptp(time) > MIN_ROUND_TRIPS * round_trip
    off[len(radius) :] *= touched & is_told
    mean_fall = np.abs(time_mean(time, fall))
    if not run.scenario.guided:
        uncertain[len(radius) :] += _allowance(run, straight, mean_fall)
    least = MIN_FORCE * float(np.mean(spans))
    largest = max(least, float(np.max(mean_fall)), float(np.max(np.abs(time_mean(time, torque)))))
    limit = FORCE_LIMIT + uncertain / largest
    worst = int(np.argmax(np.where(limit <= MAX_LIMIT, off / limit, 0.0)))
    return Check(float(off[worst] / largest), float(limit[worst]))


def _allowance(run: "BeltSamples", straight: "Array", mean_fall: "Array") -> "Array":
    """Return by how much the spans of bodies may be off, (pulleys,), N.

    In a belt that moves each corner stands where the others stood, and of a difference of tensions
    a share of it is off; in one at rest a share of the tension may be. A moment in the middle of a
    span of the length x, EI/R exp(-x/2 sqrt(T/EI)), turns a pulley as well.
    """
    time, radius, spans = run.time, run.radii, run.seen["_span_tension"]
    passed = np.max(np.abs(time_mean(time, run.seen["_speed"]))) * radius * np.ptp(time)
    held = float(np.mean(spans)) / np.maximum(passed / run.body_length, 1.0)
    allowed: Array = CORNER_FACTOR * (run.body_length / radius) ** 2 * (mean_fall + held)
    if run.scenario.effects.bending is not None:
        rigidity = run.scenario.effects.bending.rigidity
        least = np.maximum(np.min(spans, axis=0), 0.0)
        decay = np.exp(-0.5 * straight * np.sqrt(least / rigidity))
        allowed += rigidity / radius**2 * (decay + np.roll(decay, 1))
    return allowed


def _mean_difference(time: "Array", force: "Array", momentum: "Array") -> tuple["Array", "Array"]:
    """Return the mean of forces less the gain of momentum, (m,), N, and what it is uncertain by.

    Of forces, (n, m), N, and momenta, (n, m), N s; of two samples nothing is told.
    """
    if len(time) < 3:
        return np.zeros(force.shape[1]), np.zeros(force.shape[1])
    steps = np.diff(time)
    between = 0.5 * (force[1:] + force[:-1]) - np.diff(momentum, axis=0) / steps[:, None]
    off = np.abs(np.average(between, axis=0, weights=steps))
    return off, STANDARD_ERRORS * standard_error(between)
