"""The free-body diagram of a body on a shaft: where each force acts, how large it is, the reaction.

Sizes and directions are those of the equation of motion; points of application, moments and
resultants follow from them. A cord of arm r that leaves the body in the unit direction d touches it
at the point p with p x d = r, which is r (d_y, -d_x).
"""

from math import hypot, radians
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from frictionsim.mechanisms.shaft.equation import Shaft, loads_of, shaft_of
from frictionsim.mechanisms.shaft.loads import ANGLE, SPEED, TIME

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.shaft.loads import Load
    from frictionsim.mechanisms.shaft.schema import Force, ShaftScenario

    Array = npt.NDArray[np.floating[Any]]

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
    moment : (n,), N m
        Of all applied forces and couples about the axis.
    across, up : (n,), N
        Components of the resultant of the applied forces.
    reaction_across, reaction_up : (n,), N
        Components of the force of the shaft on the body.
    scale : (n,), N
        Sum of the sizes of all forces, to which a resultant is small or not.
    """

    forces: tuple[AppliedForce, ...]
    couples: tuple[AppliedCouple, ...]
    moment: "Array"
    across: "Array"
    up: "Array"
    reaction_across: "Array"
    reaction_up: "Array"
    scale: "Array"

    def vanishes(self, size: "Array") -> Any:
        """Return whether a force is nothing but rounding, (n,) of bool."""
        return np.abs(size) <= VANISHES * self.scale


def channels_needed(scenario: "ShaftScenario") -> tuple[str, ...]:
    """Return the channels without which the free body of a result is not known."""
    effects, names = scenario.effects, ["angle"]
    over_speed = any(load.over == "speed" for load in loads_of(scenario))
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
    shaft, state = shaft_of(scenario), (time, angle, velocity)
    zero = np.zeros_like(time)
    forces, couples = _forces(scenario, shaft, state), _couples(scenario, shaft, state)
    moment = sum((force.x * force.up - force.y * force.across for force in forces), zero)
    across = sum((force.across for force in forces), zero)
    up = sum((force.up for force in forces), zero)
    loads = [across, up]
    eccentric = scenario.effects.eccentric_mass
    if eccentric is not None:
        place = _turned((eccentric.radius, 0.0), angle + radians(eccentric.azimuth_deg))
        # The centre of mass accelerates by a J p - w^2 p at the place p, J a quarter turn.
        (x, y), w_2, m = place, velocity * velocity, eccentric.mass
        inert = m * (w_2 * x + acceleration * y), m * (w_2 * y - acceleration * x)
        size = np.hypot(*inert)
        along = (component / np.where(size > 0.0, size, 1.0) for component in inert)
        forces.append(AppliedForce(INERTIA_FORCE, "inertia", *place, size, *along))
        loads = [component + part for component, part in zip(loads, inert, strict=True)]
    return FreeBody(
        tuple(forces),
        tuple(couples),
        sum((couple.size for couple in couples), moment),
        across,
        up,
        -loads[0],
        -loads[1],
        sum((np.abs(force.size) for force in forces), zero),
    )


def _forces(
    scenario: "ShaftScenario", shaft: Shaft, state: "tuple[Array, Array, Array]"
) -> list[AppliedForce]:
    forces = []
    for force, load in zip(scenario.forces, shaft.loads, strict=False):
        kind: Literal["force", "cord"] = "force" if force.cord_radius is None else "cord"
        forces.append(_force(force.name, kind, load, _point(force, state[1]), state))
    angle, eccentric = state[1], scenario.effects.eccentric_mass
    zero = np.zeros_like(angle)
    places = [(zero, zero)]
    if eccentric is not None:
        azimuth = angle + radians(eccentric.azimuth_deg)
        places.append(_turned((eccentric.radius, 0.0), azimuth))
    named = zip((WEIGHT, ECCENTRIC_WEIGHT), shaft.weights, places, strict=False)
    forces += [_force(name, "weight", load, place, state) for name, load, place in named]
    return [force for force in forces if force.kind != "weight" or np.any(force.size != 0.0)]


def _size(load: "Load", state: "tuple[Array, Array, Array]") -> "Array":
    """Return the size of a load at some times, (n,)."""
    x = dict(zip((TIME, ANGLE, SPEED), state, strict=True))[load.over]
    return np.array([load.size(value) for value in x.tolist()])


def _force(
    name: str,
    kind: Any,
    load: "Load",
    place: "tuple[Array, Array]",
    state: "tuple[Array, Array, Array]",
) -> AppliedForce:
    angle = state[1]
    along = (
        a + b * np.cos(angle) + c * np.sin(angle)
        for a, b, c in zip(*(triple[1:] for triple in load.arms), strict=True)
    )
    return AppliedForce(name, kind, *place, _size(load, state), *along)


def _point(force: "Force", angle: "Array") -> "tuple[Array, Array]":
    """Return where a force acts."""
    if force.cord_radius is not None:
        length = hypot(*force.direction)
        x, y = (component / length for component in force.direction)
        zero = np.zeros_like(angle)
        return zero + force.cord_radius * y, zero - force.cord_radius * x
    assert force.point is not None  # checked by the model of the force
    return _turned(force.point, angle if force.point_turns else np.zeros_like(angle))


def _turned(point: tuple[float, float], angle: "Array") -> "tuple[Array, Array]":
    """Return a point that has turned about the axis."""
    (x, y), cosine, sine = point, np.cos(angle), np.sin(angle)
    return cosine * x - sine * y, sine * x + cosine * y


def _couples(
    scenario: "ShaftScenario", shaft: Shaft, state: "tuple[Array, Array, Array]"
) -> list[AppliedCouple]:
    couples = [
        AppliedCouple(couple.name, _size(load, state))
        for couple, load in zip(scenario.couples, shaft.loads[len(scenario.forces) :], strict=True)
    ]
    _, angle, velocity = state
    damping = scenario.effects.viscous_damping
    couples += [AppliedCouple(SPRING, -k * (angle - free)) for k, free in shaft.spring]
    if damping is not None:
        couples.append(AppliedCouple(DAMPING, -damping.coefficient * velocity))
    return couples
