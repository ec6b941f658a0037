"""The quantities of a belt drive's summary, and the checks of its run.

The audit `torque_balance`: what turns the pulleys against what the belt shows of it.

Two ways to the same force, from the samples alone. Of a pulley of radius R and inertia I that the
belt passes in the sense sigma (+1 counter-clockwise),

    I (omega_1 - omega_0) = integral of M - R sum T             over the whole run
    T_in - T_out = sigma (<M> - I <alpha>)/R - m <a> + w        over its last fifth

with the torque M on it from outside, the friction T of all bodies on it, and the mean tensions
of the spans before and after it. m is the mass of the belt from the middle of the one span to the
middle of the other, a its acceleration, and w its weight along the belt. A belt that bends also
carries moments in its spans: EI/R exp(-x sqrt(T/EI)) at the distance x from a pulley, which count
as uncertain.
"""

from itertools import pairwise
from math import isfinite
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.averaging import averaging_of
from frictionsim.mechanisms.belt_drive.kernels.system import INERTIA, PULLEY_RADIUS, Array
from frictionsim.mechanisms.belt_drive.slip import (
    ends_of,
    mean_power,
    senses_of,
    slip_percent,
    speed_at_rest,
)
from frictionsim.results import Check, Quantities, Quantity
from frictionsim.scenario.methods import SET_VALUED
from frictionsim.simulation.averages import BATCHES, last_part, time_mean

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.model import BeltModel
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario


# Of the largest force: bodies press some hundredths of a radius deep, where their friction has
# another lever than the rim; 0.8 % in the belt of the paper.
LIMIT = 0.02
# Bodies of the length l lie on a pulley as a polygon, whose corners are off the rim by (l/R)^2/8:
# this times (l/R)^2 is what they do to the force, or, where the belt hardly moves over a pulley and
# a corner may hold it, to the tension. Wrap factors leave of the force what is of higher order.
CORNER_FACTOR = 1.0 / 4.0
MIN_BODIES = 10.0  # that pass while corners even out
# Forces of less than this share of the tension are what corners and contacts make at random.
MIN_FORCE = 0.05
STANDARD_ERRORS = 4.0  # by which a mean of samples may be off
# Least duration of a mean, in times of a wave once along the belt and back.
MIN_ROUND_TRIPS = 4.0


class ForceDifference(NamedTuple):
    """The difference of two ways to one force at each pulley, and its uncertainty, N."""

    off: Array
    uncertain: Array


def torque_balance(
    scenario: "BeltDriveScenario", model: "BeltModel", time: Array, seen: dict[str, Array]
) -> Check:
    """Return the difference of the two ways at the pulley where it is most, and its limit.

    Both are over the largest force. The limit counts what the means of the samples are uncertain
    by, what corners may do, and moments of bending in the middle of short spans.
    """
    radius = model.system.pulleys.table[PULLEY_RADIUS]
    torque = seen["_torque"] / radius
    turned = seen["_speed"] * model.system.pulleys.table[INERTIA] / radius
    rim = torque - seen.get("_friction", np.zeros_like(torque))
    last = last_part(time)
    fall = np.roll(seen["_span_tension"], 1, axis=1) - seen["_span_tension"]
    means = [time_mean(time, torque), time_mean(time[last], fall[last])]
    least = MIN_FORCE * float(np.mean(seen["_span_tension"]))
    largest = max(least, float(np.max(np.abs(means))))
    belt, differences = scenario.mechanism.belt, [_difference(time, rim, turned)]
    wave = np.sqrt(belt.axial_rigidity / belt.mass_per_length)
    if np.ptp(time[last]) * wave > MIN_ROUND_TRIPS * scenario.mechanism.path().length:
        last_samples = {name: values[last] for name, values in seen.items()}
        differences.append(_difference_of_spans(scenario, model, time[last], last_samples))
    off, uncertain = (np.concatenate(parts) / largest for parts in zip(*differences, strict=True))
    limit = LIMIT + uncertain
    worst = int(np.argmax(off / limit))
    return Check(float(off[worst]), float(limit[worst]))


def _difference_of_spans(
    scenario: "BeltDriveScenario", model: "BeltModel", time: Array, seen: dict[str, Array]
) -> ForceDifference:
    """Return the difference between the spans of each pulley and the torque on it.

    Zero where bodies do not touch the pulley all the time, or no other: it has not two spans then.
    """
    path, density = scenario.mechanism.path(), scenario.mechanism.belt.mass_per_length
    radius, inertia = model.system.pulleys.table[PULLEY_RADIUS], model.system.pulleys.table[INERTIA]
    wrap_angle = np.array([arc.wrap_angle for arc in path.arcs])
    straight = np.array([np.hypot(*np.subtract(s.end, s.start)) for s in path.spans])
    mass = density * (np.abs(wrap_angle) * radius + 0.5 * (straight + np.roll(straight, 1)))
    spans = seen["_span_tension"]
    fall = np.roll(spans, 1, axis=1) - spans
    force = fall - np.sign(wrap_angle) * seen["_torque"] / radius
    if model.system.effects.gravity is not None:
        middle = np.array([0.5 * np.add(s.start, s.end) for s in path.spans])
        height = -middle @ np.array(
            [model.system.effects.gravity.x, model.system.effects.gravity.y]
        )
        force = force - density * (np.roll(height, 1) - height)
    gained = np.sign(wrap_angle) * seen["_speed"] * inertia / radius + np.outer(
        seen["_belt_speed"], mass
    )
    off, chance = _difference(time, force, -gained)
    length = model.system.chain.length
    passed = np.max(np.abs(time_mean(time, seen["_speed"]))) * radius * np.ptp(time) / length
    moving = CORNER_FACTOR * (length / radius) ** 2 * np.max(np.abs(time_mean(time, fall)))
    if model.system.contacts.wrap is not None:
        moving *= (length / radius) ** 2
    still = CORNER_FACTOR * (length / radius) ** 2 * spans.mean()
    corners = np.where(passed > MIN_BODIES, moving, still)
    if scenario.guided:
        corners = np.zeros_like(corners)
    touched = np.all(seen["_touching"] > 0.0, axis=0)
    judged = touched & (np.sum(touched) > 1)
    return ForceDifference(
        np.where(judged, off, 0.0), chance + corners + _moments(scenario, straight, spans)
    )


def _difference(time: Array, force: Array, momentum: Array) -> ForceDifference:
    """Return the mean of forces less the gain of momentum; their scatter makes it uncertain.

    Parameters
    ----------
    time : (n,), s
    force : (n, np), N
    momentum : (n, np), N s
    """
    ends = np.unique(np.linspace(0, len(time) - 1, BATCHES + 1).astype(int))
    if len(ends) < 3:  # nothing is told of the scatter
        return ForceDifference(np.zeros(force.shape[1]), np.zeros(force.shape[1]))
    batches = [slice(a, b + 1) for a, b in pairwise(ends)]
    forces = np.array([time_mean(time[of], force[of]) for of in batches])
    weights = np.diff(time[ends])
    off = forces - np.diff(momentum[ends], axis=0) / weights[:, None]
    chance = STANDARD_ERRORS * off.std(axis=0, ddof=1) / np.sqrt(len(batches))
    return ForceDifference(np.abs(np.average(off, axis=0, weights=weights)), chance)


def _moments(scenario: "BeltDriveScenario", straight: Array, spans: Array) -> Array:
    """Return the forces at the rim that moments in the middle of the spans could stand for, N."""
    if scenario.effects.bending is None:
        return np.zeros(len(straight))
    rigidity = scenario.effects.bending.rigidity
    tension = np.maximum(np.min(spans, axis=0), 0.0)
    decay = np.exp(-0.5 * straight * np.sqrt(tension / rigidity))
    radius = np.array([pulley.radius for pulley in scenario.mechanism.pulleys])
    return rigidity / radius**2 * (decay + np.roll(decay, 1))


MIN_RELATIVE_WORK = 1e-6  # of the energy in the springs: less work counts as zero

# A fixed step closes the energies to second order, the adaptive one to its tolerance; both see
# the jumps of contacts that open, which neither locates.
ENERGY_LIMIT = 5e-3
# A run in which less than this share of the stored energy moved has nothing to be relative to.
STORED_SHARE = 1e-3
ROUNDING = 1e-9
# While residual slip relaxes, friction may do a little positive work: of its heat, or, where this
# is small against the energies of the run, a hundredth of what their balance may be off.
POWER_LIMIT = 1e-3
SMALL_HEAT = 0.01 * ENERGY_LIMIT / POWER_LIMIT


def quantities_of(
    scenario: "BeltDriveScenario", model: "BeltModel", time: Array, seen: dict[str, Array]
) -> Quantities:
    """Return the summary's quantities; means are over the samples of `averaging_of`.

    Parameters
    ----------
    time : (n,), s
    seen : dict of (n, ...)
        What the observer keeps of each sample.
    """
    quantities: Quantities = {}
    if not time.size:
        return quantities
    averaging = averaging_of(scenario, model, time, seen)
    last = averaging.samples

    def mean(name: str) -> Any:
        return time_mean(time[last], seen[name][last])

    names = scenario.mechanism.names
    quantities["pretension"] = Quantity(float(seen["_mean_tension"][0]), "N")
    spans = mean("_span_tension")
    quantities["tension_tight"] = Quantity(float(np.max(spans)), "N")
    quantities["tension_slack"] = Quantity(float(np.min(spans)), "N")
    for i, name in enumerate(names):
        after = names[(i + 1) % len(names)]
        quantities[f"tension_{name}_to_{after}"] = Quantity(float(spans[i]), "N")
    power = mean_power(time[last], seen["_torque"][last], seen["_speed"][last])
    # A ripple of 0.1 % of two speeds would be 1 % of their difference, the slip.
    speed = averaging.mean_speed(time, seen["_speed"])
    ends = ends_of(time, seen["_torque"], seen["_speed"], last)
    quantities["drive_speed"] = Quantity(float(speed[ends.drive]), "rad/s")
    quantities["driven_speed"] = Quantity(float(speed[ends.driven]), "rad/s")
    radii = model.system.pulleys.table[PULLEY_RADIUS]
    rims = speed * radii * senses_of(scenario.mechanism.path())
    slip = float(slip_percent(rims, ends, min_rim_speed(scenario, time, seen)))
    quantities["slip_percent"] = Quantity(slip if isfinite(slip) else None, "%")
    quantities["efficiency"] = Quantity(
        efficiency(time[last], power, losses(seen, last), _unused_energy(seen)), "1"
    )
    touching, sticking = mean("_touching"), mean("_sticking")
    if model.system.friction is not None:
        share = float(np.sum(sticking) / np.sum(touching)) if np.sum(touching) else None
        quantities["stick_fraction"] = Quantity(share, "1")
    for j, name in enumerate(names):
        per_body = model.system.chain.length / model.system.pulleys.table[PULLEY_RADIUS, j]
        quantities[f"contact_arc_{name}"] = Quantity(float(touching[j] * per_body), "rad")
        if model.system.friction is not None:
            quantities[f"adhesion_arc_{name}"] = Quantity(float(sticking[j] * per_body), "rad")
    quantities["final_time"] = Quantity(float(time[-1]), "s")
    if averaging.periods:
        quantities["mean_duration"] = Quantity(float(np.ptp(time[last])), "s")
    stored = sum(float(seen[name][0]) for name in ("energy_kinetic", "energy_potential"))
    quantities["initial_energy"] = Quantity(stored, "J")
    for name, energy in seen.items():
        if name.startswith("energy"):
            quantities[name] = Quantity(float(energy[-1]), "J")
    return quantities


def min_rim_speed(scenario: "BeltDriveScenario", time: Array, seen: dict[str, Array]) -> float:
    """Return the speed below which a rim is at rest, m/s: it may vibrate."""
    last = last_part(time)
    tension = float(np.mean(seen["_span_tension"][last]))
    return speed_at_rest(tension, scenario.mechanism.belt.mass_per_length)


def _unused_energy(seen: dict[str, Array]) -> float:
    """Return an energy, J, that is negligible against the energy stored."""
    return MIN_RELATIVE_WORK * float(abs(seen["energy_potential"][0]))


def losses(seen: dict[str, Array], last: Any) -> float:
    """Return the heat of friction and dampers in a part of a run, J."""
    heats = (seen[name][last] for name in ("energy_friction", "energy_damping") if name in seen)
    return float(sum(heat[-1] - heat[0] for heat in heats))


def efficiency(time: Array, power: Array, lost: float, least: float) -> float | None:
    """Return the work taken out, over the sum of it and the losses.

    That is the work put in less what the drive stores meanwhile, in motion and springs. None where
    nothing is taken out or lost.

    Parameters
    ----------
    time : (n,), s
    power : (np,), W
        The mean of each pulley's, positive into the drive.
    lost : float, J
        In that time.
    least : float, J
        No more than this is nothing.
    """
    delivered = float(np.sum((-power).clip(min=0.0)) * np.ptp(time))
    return delivered / (delivered + lost) if delivered + lost > least else None


def checks_of(
    scenario: "BeltDriveScenario", model: "BeltModel", time: Array, seen: dict[str, Array]
) -> dict[str, Check]:
    """Return the audit: energies over the largest of them, forces over their limits."""
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
    if model.system.friction is not None:
        over, limit = np.max(seen["_excess"], axis=0)
        checks["friction_law"] = _relative(over, limit, ROUNDING)
        driving, heat = np.mean(seen["_power"], axis=0) * np.ptp(time)
        size = max(heat, SMALL_HEAT * largest)
        checks["dissipation_sign"] = _relative(driving, size, POWER_LIMIT)
        if scenario.law == SET_VALUED:
            checks["release"] = Check(float(model.system.contacts.release[0]), ROUNDING)
    checks["torque_balance"] = torque_balance(scenario, model, time, seen)
    return checks


def _relative(value: float, size: float, limit: float) -> Check:
    return Check(float(value / size if size > 0.0 else value) + 0.0, limit)  # no minus zero
