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
from typing import TYPE_CHECKING

import numpy as np

from frictionsim.averages import BATCHES, last_part, time_mean
from frictionsim.mechanisms.belt.contact import INERTIA, PULLEY_RADIUS
from frictionsim.series import Check

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt.assembly import Assembly
    from frictionsim.mechanisms.belt.parameters import Scene

    Array = npt.NDArray[np.float64]

# Of the largest force: bodies press some hundredths of a radius deep, where their friction has
# another lever than the rim; 0.8 % in the belt of the paper.
LIMIT = 0.02
# Bodies of the length l lie on a pulley as a polygon, whose corners hold the belt at rest and are
# off the rim by (l/R)^2/8: this times (l/R)^2 of the tension is what they may stand for.
CORNER = 1.0 / 4.0
# Forces of less than this share of the tension are what corners and contacts make at random.
LEAST_FORCE = 0.05
STANDARD_ERRORS = 4.0  # by which a mean of samples may be off
# A mean that is over less than so many times of a wave along the belt and back says nothing.
FEWEST_ROUNDS = 4.0


def torque_balance(
    scene: "Scene", assembly: "Assembly", time: "Array", seen: dict[str, "Array"]
) -> Check:
    """Return the largest difference of the two ways, over the largest force.

    What the means of the samples are uncertain by is not counted.
    """
    radius = assembly.pulleys.table[PULLEY_RADIUS]
    torque = seen["_torque"] / radius
    turned = seen["_speed"] * assembly.pulleys.table[INERTIA] / radius
    rim = torque - seen.get("_friction", np.zeros_like(torque))
    last = last_part(time)
    fall = np.roll(seen["_span_tension"], 1, axis=1) - seen["_span_tension"]
    off, belt = _off(time, rim, turned), scene.mechanism.belt
    wave = np.sqrt(belt.axial_rigidity / belt.mass_per_length)
    rounds = np.ptp(time[last]) * wave / scene.mechanism.path().length
    # Without touch there are no spans on two sides of a pulley.
    if rounds > FEWEST_ROUNDS and np.all(seen["_touching"][last] > 0.0):
        of_last = {name: values[last] for name, values in seen.items()}
        off = max(off, _of_spans(scene, assembly, time[last], of_last))
    means = [time_mean(time, torque), time_mean(time[last], fall[last])]
    least = LEAST_FORCE * float(np.mean(seen["_span_tension"]))
    largest = max(least, float(np.max(np.abs(means))))
    return Check(off / largest, LIMIT)


def _of_spans(
    scene: "Scene", assembly: "Assembly", time: "Array", seen: dict[str, "Array"]
) -> float:
    """Return the largest difference at a pulley between its spans and what turns it, N."""
    path, density = scene.mechanism.path(), scene.mechanism.belt.mass_per_length
    radius, inertia = assembly.pulleys.table[PULLEY_RADIUS], assembly.pulleys.table[INERTIA]
    sweep = np.array([arc.sweep for arc in path.arcs])
    straight = np.array([np.hypot(*np.subtract(s.end, s.start)) for s in path.spans])
    mass = density * (np.abs(sweep) * radius + 0.5 * (straight + np.roll(straight, 1)))
    spans = seen["_span_tension"]
    force = np.roll(spans, 1, axis=1) - spans - np.sign(sweep) * seen["_torque"] / radius
    if assembly.laws.weight is not None:
        middle = np.array([0.5 * np.add(s.start, s.end) for s in path.spans])
        height = -middle @ np.array([assembly.laws.weight.x, assembly.laws.weight.y])
        force = force - density * (np.roll(height, 1) - height)
    gained = np.sign(sweep) * seen["_speed"] * inertia / radius + np.outer(
        seen["_belt_speed"], mass
    )
    corners = CORNER * (assembly.laws.chain.length / radius) ** 2 * spans.mean()
    return _off(time, force, -gained, corners + _moments(scene, straight, spans))


def _off(
    time: "Array", force: "Array", momentum: "Array", uncertain: "Array | float" = 0.0
) -> float:
    """Return the largest mean of forces less the gain of momentum, beyond what is uncertain, N.

    The difference is taken in batches: their scatter is what the mean is uncertain by.

    Parameters
    ----------
    time : (n,), s
    force : (n, np), N
    momentum : (n, np), N s
    uncertain : (np,), N
    """
    ends = np.unique(np.linspace(0, len(time) - 1, BATCHES + 1).astype(int))
    if len(ends) < 3:
        return 0.0
    batches = [slice(a, b + 1) for a, b in pairwise(ends)]
    forces = np.array([time_mean(time[of], force[of]) for of in batches])
    weights = np.diff(time[ends])
    off = forces - np.diff(momentum[ends], axis=0) / weights[:, None]
    chance = STANDARD_ERRORS * off.std(axis=0, ddof=1) / np.sqrt(len(batches))
    mean = np.abs(np.average(off, axis=0, weights=weights))
    return max(0.0, float(np.max(mean - chance - uncertain)))


def _moments(scene: "Scene", straight: "Array", spans: "Array") -> "Array":
    """Return the forces at the rim that moments in the middle of the spans could stand for, N."""
    if scene.effects.bending is None:
        return np.zeros(len(straight))
    rigidity = scene.effects.bending.rigidity
    tension = np.maximum(np.min(spans, axis=0), 0.0)
    decay = np.exp(-0.5 * straight * np.sqrt(tension / rigidity))
    radius = np.array([pulley.radius for pulley in scene.mechanism.pulleys])
    return rigidity / radius**2 * (decay + np.roll(decay, 1))
