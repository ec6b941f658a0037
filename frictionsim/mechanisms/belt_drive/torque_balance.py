"""The audit `torque_balance`: what turns the pulleys against what the belt shows of it.

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
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.kernels.layout import INERTIA, PULLEY_RADIUS
from frictionsim.results import Check
from frictionsim.simulation.averages import BATCHES, last_part, time_mean

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.composition import BeltModel
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

    Array = npt.NDArray[np.float64]

# Of the largest force: bodies press some hundredths of a radius deep, where their friction has
# another lever than the rim; 0.8 % in the belt of the paper.
LIMIT = 0.02
# Bodies of the length l lie on a pulley as a polygon, whose corners are off the rim by (l/R)^2/8:
# this times (l/R)^2 is what they do to the force, or, where the belt hardly moves over a pulley and
# a corner may hold it, to the tension. Wrap factors leave of the force what is of higher order.
CORNER = 1.0 / 4.0
MIN_BODIES = 10.0  # that pass while corners even out
# Forces of less than this share of the tension are what corners and contacts make at random.
MIN_FORCE = 0.05
STANDARD_ERRORS = 4.0  # by which a mean of samples may be off
# A mean that is over less than so many times of a wave along the belt and back says nothing.
MIN_ROUND_TRIPS = 4.0


class Misfit(NamedTuple):
    """What two ways to one force differ by at each pulley, and what they may beside LIMIT, N."""

    off: "Array"
    uncertain: "Array"


def torque_balance(
    scenario: "BeltDriveScenario", model: "BeltModel", time: "Array", seen: dict[str, "Array"]
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
    belt, misfits = scenario.mechanism.belt, [_misfit(time, rim, turned)]
    wave = np.sqrt(belt.axial_rigidity / belt.mass_per_length)
    if np.ptp(time[last]) * wave > MIN_ROUND_TRIPS * scenario.mechanism.path().length:
        of_last = {name: values[last] for name, values in seen.items()}
        misfits.append(_misfit_of_spans(scenario, model, time[last], of_last))
    off, uncertain = (np.concatenate(parts) / largest for parts in zip(*misfits, strict=True))
    limit = LIMIT + uncertain
    worst = int(np.argmax(off / limit))
    return Check(float(off[worst]), float(limit[worst]))


def _misfit_of_spans(
    scenario: "BeltDriveScenario", model: "BeltModel", time: "Array", seen: dict[str, "Array"]
) -> Misfit:
    """Return what the spans beside each pulley and what turns it differ by.

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
    off, chance = _misfit(time, force, -gained)
    length = model.system.chain.length
    passed = np.max(np.abs(time_mean(time, seen["_speed"]))) * radius * np.ptp(time) / length
    moving = CORNER * (length / radius) ** 2 * np.max(np.abs(time_mean(time, fall)))
    if model.system.contacts.wrap is not None:
        moving *= (length / radius) ** 2
    still = CORNER * (length / radius) ** 2 * spans.mean()
    corners = np.where(passed > MIN_BODIES, moving, still)
    if scenario.guided:
        corners = np.zeros_like(corners)
    touched = np.all(seen["_touching"] > 0.0, axis=0)
    judged = touched & (np.sum(touched) > 1)
    return Misfit(
        np.where(judged, off, 0.0), chance + corners + _moments(scenario, straight, spans)
    )


def _misfit(time: "Array", force: "Array", momentum: "Array") -> Misfit:
    """Return the mean of forces less the gain of momentum; their scatter makes it uncertain.

    Parameters
    ----------
    time : (n,), s
    force : (n, np), N
    momentum : (n, np), N s
    """
    ends = np.unique(np.linspace(0, len(time) - 1, BATCHES + 1).astype(int))
    if len(ends) < 3:  # nothing is told of the scatter
        return Misfit(np.zeros(force.shape[1]), np.zeros(force.shape[1]))
    batches = [slice(a, b + 1) for a, b in pairwise(ends)]
    forces = np.array([time_mean(time[of], force[of]) for of in batches])
    weights = np.diff(time[ends])
    off = forces - np.diff(momentum[ends], axis=0) / weights[:, None]
    chance = STANDARD_ERRORS * off.std(axis=0, ddof=1) / np.sqrt(len(batches))
    return Misfit(np.abs(np.average(off, axis=0, weights=weights)), chance)


def _moments(scenario: "BeltDriveScenario", straight: "Array", spans: "Array") -> "Array":
    """Return the forces at the rim that moments in the middle of the spans could stand for, N."""
    if scenario.effects.bending is None:
        return np.zeros(len(straight))
    rigidity = scenario.effects.bending.rigidity
    tension = np.maximum(np.min(spans, axis=0), 0.0)
    decay = np.exp(-0.5 * straight * np.sqrt(tension / rigidity))
    radius = np.array([pulley.radius for pulley in scenario.mechanism.pulleys])
    return rigidity / radius**2 * (decay + np.roll(decay, 1))
