"""The quantities of a belt drive's summary, and the checks of its run: all from its samples.

Means are over the last fifth of a run. With a patch the motion repeats as often as the belt goes
round, with sines of one frequency as often as they do: the means are over whole periods then.

The audit `torque_balance` compares, at every pulley of radius R and inertia I that the belt passes
in the sense sigma (+1 counter-clockwise), what turns it with what the belt shows of that:

    0 = <M>/R - I <alpha>/R - <sum T>
    0 = sigma (<M>/R - I <alpha>/R) - <T_in - T_out> - m <a>

with the torque M on it from outside, the friction T of all bodies on it, and, of a guided belt, the
mean tensions of the spans before and after it. m is the mass of the belt from the middle of the one
span to the middle of the other, a its acceleration. The spans of bodies in the plane are off by
what corners and bending make of them.
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

    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

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
# What may be off by more of it, as of too few samples, is not judged.
MAX_LIMIT = 0.5
# Forces of less than this share of the tension are what corners and contacts make at random.
MIN_FORCE = 0.05
STANDARD_ERRORS = 4.0  # by which a mean of samples may be off, and two means differ, by chance
MIN_ROUND_TRIPS = 4.0  # of a wave along the belt in a run whose spans are judged


class BeltSamples(NamedTuple):
    """The samples of a run, from which summary, audit, transitions and warnings follow."""

    scenario: "BeltDriveScenario"
    body_length: float  # m, unstretched
    pretension: float  # N, the mean tension at rest
    time: "Array"
    seen: "dict[str, Array]"  # (n, ...), what `sampling` keeps of each sample, by name

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the pulleys."""
        return self.scenario.mechanism.names

    @property
    def spans(self) -> list[tuple[str, str]]:
        """The names of the pulleys that each span leads from and to."""
        return list(zip(self.names, (*self.names[1:], self.names[0]), strict=True))

    @property
    def radii(self) -> "Array":
        """The radii of the pulleys, (pulleys,), m."""
        return np.array([pulley.radius for pulley in self.scenario.mechanism.pulleys])


# --- the part of a run that means are over ------------------------------------------------------


class Averaging(NamedTuple):
    """The samples that means are over."""

    samples: "npt.NDArray[np.bool_]"
    periods: int  # how many whole ones they are; none for the last fifth
    to_go: "Array | None"  # periods from each sample to the end, of a motion that has one

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
    at_rest = min_rim_speed(run)
    ends = ends_of(time, seen["_torque"], seen["_speed"], last, at_rest / run.radii)
    rims = speed * run.radii * senses_of(run.scenario.mechanism.path())
    slip = float(slip_percent(rims, ends, at_rest))
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
    nothing is taken out or lost, and at rest, where no more is taken out than was stored.
    """
    time, seen = run.time[last], run.seen
    heats = (seen[name][last] for name in ("energy_friction", "energy_damping") if name in seen)
    lost = float(sum(heat[-1] - heat[0] for heat in heats))
    power = mean_power(time, seen["_torque"][last], seen["_speed"][last])
    delivered = float(np.sum((-power).clip(min=0.0)) * np.ptp(time))
    least = MIN_RELATIVE_WORK * float(abs(seen["energy_potential"][0]))
    rims = np.abs(time_mean(time, seen["_speed"][last])) * run.radii
    if float(np.max(rims)) <= min_rim_speed(run):
        stored = (seen[f"energy_{of}"][last] for of in ("kinetic", "potential"))
        if delivered <= sum(abs(float(energy[-1] - energy[0])) for energy in stored):
            return None
    return delivered / (delivered + lost) if delivered + lost > least else None


# --- the audit ----------------------------------------------------------------------------------


def checks_of(run: "BeltSamples") -> dict[str, Check]:
    """Return the audit: energies over the largest of them, forces over their limits."""
    time, seen = run.time, run.seen
    if not time.size:
        return {}
    energies = (v for name, v in seen.items() if name.startswith("energy"))
    largest = max(float(np.max(np.abs(energy - energy[0]))) for energy in energies)
    largest = max(largest, STORED_SHARE * float(abs(seen["energy_potential"][0])))
    off = float(np.max(np.abs(energy_residual(seen))))
    checks = {"energy_balance": _relative(off, largest, ENERGY_LIMIT)}
    if run.scenario.effects.belt_friction is not None:
        over, limit = np.max(seen["_excess"], axis=0)
        checks["friction_law"] = _relative(over, limit, FRICTION_LIMIT)
        driving, heat = np.mean(seen["_power"], axis=0) * np.ptp(time)
        checks["dissipation_sign"] = _relative(
            driving, max(heat, SMALL_HEAT * largest), POWER_LIMIT
        )
    if (balance := torque_balance(run)) is not None:
        checks["torque_balance"] = balance
    return checks


def energy_residual(seen: "dict[str, Array]") -> "Array":
    """Return by how much the drive has gained more energy than was put in, of samples, (n,), J."""
    changes = {name: v - v[0] for name, v in seen.items() if name.startswith("energy")}
    put_in = changes.pop("energy_input")
    return sum(changes.values(), start=-put_in)


def _relative(value: float, size: float, limit: float) -> Check:
    return Check(float(value / size if size > 0.0 else value) + 0.0, limit)  # no minus zero


def torque_balance(run: "BeltSamples") -> Check | None:
    """Return the difference of two ways to one force at the pulley where it is most, and its limit.

    Both are means over the run, over the largest force; the limit counts what these are uncertain
    by. None where no pulley can be judged, as in a run of a few samples.
    """
    time, seen, radius = run.time, run.seen, run.radii
    path, belt = run.scenario.mechanism.path(), run.scenario.mechanism.belt
    senses, spans = senses_of(path), seen["_span_tension"]
    torque = seen["_torque"] / radius
    momentum = seen["_speed"] * [p.inertia for p in run.scenario.mechanism.pulleys] / radius
    fall = np.roll(spans, 1, axis=1) - spans
    forces, momenta = torque - seen.get("_friction", np.zeros_like(torque)), momentum
    # Waves carry the tension to the middle of a span.
    round_trip = path.length * np.sqrt(belt.mass_per_length / belt.axial_rigidity)
    if run.scenario.guided and np.ptp(time) > MIN_ROUND_TRIPS * round_trip:
        straight = np.array([np.hypot(*np.subtract(span.end, span.start)) for span in path.spans])
        wrapped = radius * np.abs([arc.wrap_angle for arc in path.arcs])
        mass = belt.mass_per_length * (wrapped + 0.5 * (straight + np.roll(straight, 1)))
        moved = senses * momentum + np.outer(seen["_belt_speed"], mass)
        forces, momenta = np.hstack([forces, senses * torque - fall]), np.hstack([momenta, moved])
    off, uncertain = _mean_difference(time, forces, momenta)
    means = time_mean(time, fall), time_mean(time, torque)
    largest = max(MIN_FORCE * float(np.mean(spans)), float(np.max(np.abs(means))))
    limit = FORCE_LIMIT + uncertain / largest
    worst = int(np.argmax(np.where(limit <= MAX_LIMIT, off / limit, -1.0)))
    if limit[worst] > MAX_LIMIT:
        return None
    return Check(float(off[worst] / largest), float(limit[worst]))


def _mean_difference(time: "Array", force: "Array", momentum: "Array") -> tuple["Array", "Array"]:
    """Return the mean of forces less the gain of momentum, (m,), N, and what it is uncertain by.

    Of forces, (n, m), N, and momenta, (n, m), N s; zeros for fewer than three samples.
    """
    if len(time) < 3:
        return np.zeros(force.shape[1]), np.zeros(force.shape[1])
    steps = np.diff(time)
    between = 0.5 * (force[1:] + force[:-1]) - np.diff(momentum, axis=0) / steps[:, None]
    off = np.abs(np.average(between, axis=0, weights=steps))
    return off, STANDARD_ERRORS * standard_error(between)
