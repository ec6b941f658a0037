"""The free-body diagram of a body on a shaft: where each force acts, how large it is, the reaction.

Sizes and directions are those of the equation of motion; points of application, moments and
resultants follow from them. A cord of arm r that leaves the body in the unit direction d touches it
at the point p with p x d = r, which is r (d_y, -d_x).
"""

from math import hypot, radians
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from frictionsim.mechanisms.shaft.equation import Shaft
from frictionsim.mechanisms.shaft.loads import ANGLE, SPEED, TIME

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.shaft.loads import Load
    from frictionsim.mechanisms.shaft.schema import Force, ShaftScenario

    Array = npt.NDArray[np.floating[Any]]
    Pair = tuple[Array, Array]

# Names with spaces, which no force or couple of a scenario has.
WEIGHT, ECCENTRIC_WEIGHT = "weight of the body", "weight of the eccentric mass"
INERTIA_FORCE = "inertia force of the eccentric mass"
SPRING, DAMPING = "torsion spring", "viscous damping"
VANISHES = 1e-9  # of the sum of the sizes: a resultant that is not larger is rounding


class AppliedForce(NamedTuple):
    """A force on the body at some times.

    Attributes
    ----------
    name : str
    kind : {"force", "cord", "weight", "inertia"}
    x, y : (n,), m
        Where it acts, from the axis.
    size : (n,), N
        Negative where the scenario's size is.
    along_x, along_y : (n,)
        Unit vector of a force of positive size.
    """

    name: str
    kind: Literal["force", "cord", "weight", "inertia"]
    x: "Array"
    y: "Array"
    size: "Array"
    along_x: "Array"
    along_y: "Array"

    @property
    def across(self) -> "Array":
        """Component to the right, N."""
        return self.size * self.along_x

    @property
    def up(self) -> "Array":
        """Component upwards, N."""
        return self.size * self.along_y


class AppliedCouple(NamedTuple):
    """A couple on the body at some times, (n,) in N m, positive counter-clockwise."""

    name: str
    size: "Array"


class FreeBody(NamedTuple):
    """All that acts on the body at some times.

    Attributes
    ----------
    forces : tuple of AppliedForce
        With the inertia force of an eccentric mass, which loads the shaft as a force does.
    couples : tuple of AppliedCouple
        With those of spring and damping.
    reaction : pair of (n,), N
        Components of the force of the shaft on the body.
    reaction_vanishes : (n,) of bool
        Whether it is nothing but rounding.
    """

    forces: tuple[AppliedForce, ...]
    couples: tuple[AppliedCouple, ...]
    reaction: "Pair"
    reaction_vanishes: Any


def channels_needed(scenario: "ShaftScenario") -> tuple[str, ...]:
    """Return the channels without which the free body of a result is not known."""
    effects, names = scenario.effects, ["angle"]
    over_speed = any(load.over == SPEED for load in Shaft(scenario).loads)
    if over_speed or effects.viscous_damping is not None or effects.eccentric_mass is not None:
        names.append("angular_velocity")
    if effects.eccentric_mass is not None:
        names.append("angular_acceleration")
    if effects.shaft_friction is not None:
        names.append("friction_torque")
    return tuple(names)


def free_body(scenario: "ShaftScenario", motion: "tuple[Array, Array, Array, Array]") -> FreeBody:
    """Return the forces on the body.

    The motion is time, s, angle, rad, and its first and second derivative, (n,) each; the
    derivatives count where `channels_needed` names them.
    """
    time, angle, velocity, acceleration = (np.asarray(values, dtype=float) for values in motion)
    shaft, effects, zero = Shaft(scenario), scenario.effects, np.zeros_like(time)
    state, eccentric = {TIME: time, ANGLE: angle, SPEED: velocity}, effects.eccentric_mass
    places = [(zero, zero)]  # of the weights
    if eccentric is not None:
        azimuth = angle + radians(eccentric.azimuth_deg)
        places.append(_turned((eccentric.radius, 0.0), azimuth))
    forces = [
        _force(force.name, "force" if force.cord_radius is None else "cord", load, place, state)
        for force, load in zip(scenario.forces, shaft.loads, strict=False)
        for place in [_point(force, angle)]
    ]
    for name, load, place in zip((WEIGHT, ECCENTRIC_WEIGHT), shaft.weights, places, strict=False):
        weight = _force(name, "weight", load, place, state)
        forces += [weight] if np.any(weight.size != 0.0) else []
    if eccentric is not None:
        # The centre of mass accelerates by a J p - w^2 p at the place p, J a quarter turn.
        (x, y), w_2, m = places[1], velocity * velocity, eccentric.mass
        inert = m * (w_2 * x + acceleration * y), m * (w_2 * y - acceleration * x)
        size = np.hypot(*inert)
        along = (component / np.where(size > 0.0, size, 1.0) for component in inert)
        forces.append(AppliedForce(INERTIA_FORCE, "inertia", *places[1], size, *along))
    couples = [
        AppliedCouple(couple.name, _size(load, state))
        for couple, load in zip(scenario.couples, shaft.loads[len(scenario.forces) :], strict=True)
    ]
    if shaft.spring is not None:
        k, free = shaft.spring
        couples.append(AppliedCouple(SPRING, -k * (angle - free)))
    if (damping := effects.viscous_damping) is not None:
        couples.append(AppliedCouple(DAMPING, -damping.coefficient * velocity))
    reaction = sum((-f.across for f in forces), zero), sum((-f.up for f in forces), zero)
    scale = sum((np.abs(force.size) for force in forces), zero)
    vanishes = np.hypot(*reaction) <= VANISHES * scale
    return FreeBody(tuple(forces), tuple(couples), reaction, vanishes)


def _size(load: "Load", state: "dict[str, Array]") -> "Array":
    """Return the size of a load at some times, (n,)."""
    return np.array([load.size(value) for value in state[load.over].tolist()])


def _force(
    name: str, kind: Any, load: "Load", place: "Pair", state: "dict[str, Array]"
) -> AppliedForce:
    c, s = np.cos(state[ANGLE]), np.sin(state[ANGLE])
    along = (a + b * c + d * s for a, b, d in zip(*(of[1:] for of in load.arms), strict=True))
    return AppliedForce(name, kind, *place, _size(load, state), *along)


def _point(force: "Force", angle: "Array") -> "Pair":
    """Return where a force acts."""
    if force.cord_radius is not None:
        length = hypot(*force.direction)
        x, y = (component / length for component in force.direction)
        zero = np.zeros_like(angle)
        return zero + force.cord_radius * y, zero - force.cord_radius * x
    assert force.point is not None  # checked by the model of the force
    return _turned(force.point, angle if force.point_turns else np.zeros_like(angle))


def _turned(point: tuple[float, float], angle: "Array") -> "Pair":
    """Return a point that has turned about the axis."""
    (x, y), cosine, sine = point, np.cos(angle), np.sin(angle)
    return cosine * x - sine * y, sine * x + cosine * y
