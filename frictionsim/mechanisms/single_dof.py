"""Parts that mechanisms of one coordinate share: scenario base, channels, terms, sine, cosine."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from frictionsim.results import (
    BACKWARD,
    FORWARD,
    MODES,
    SINGLE_DOF_METRICS,
    STICK,
    Channel,
    Flags,
    Metric,
)
from frictionsim.scenario.methods import SINGLE_DOF, Pairs
from frictionsim.scenario.settings import Scenario
from frictionsim.solvers.compilation import compilable, compiled_as
from frictionsim.solvers.mechanism import Mechanism, Value

if TYPE_CHECKING:
    from frictionsim.simulation.base import Simulation
    from frictionsim.solvers.contacts import MultiContactMechanism

# The modes of one coordinate; the others are of belts.
SINGLE_DOF_MODES: Flags = tuple(flag for flag in MODES if flag[0] in (BACKWARD, STICK, FORWARD))

# The error metrics of a work-precision study.
METRICS = (*SINGLE_DOF_METRICS, Metric("friction_heat", "quantity", "energy_friction", "J"))


class SingleDofScenario(Scenario):
    """A scenario of one coordinate; its `mechanism` has the initial angle and angular velocity."""

    PAIRS: ClassVar[Pairs] = SINGLE_DOF


def base_channels(body: str) -> dict[str, Channel]:
    """Return the channels of the motion and dry friction of a body, by name.

    The simulation records them. A mechanism may replace a description and adds its own channels.
    """
    return {
        "angle": Channel("rad", f"angle of the {body}"),
        "angular_velocity": Channel("rad/s", f"angular velocity of the {body}"),
        "angular_acceleration": Channel("rad/s^2", f"angular acceleration of the {body}"),
        "friction_torque": Channel("N m", f"torque of the dry friction on the {body}"),
        "mode": Channel("1", "0 sticking, +1 and -1 sliding", integer=True, flags=SINGLE_DOF_MODES),
        "energy_friction": Channel("J", "heat of the dry friction in the shaft"),
    }


def simulation_of(
    build: "Callable[[Any], Mechanism | MultiContactMechanism]",
) -> Callable[[Scenario], "Simulation"]:
    """Return the function `simulation` of a kind, from its `build`."""

    def simulation(scenario: Scenario) -> "Simulation":
        mechanism = build(scenario)
        # Imported here because it imports numpy, which `check` does not need.
        if not isinstance(mechanism, Mechanism):
            from frictionsim.simulation.multi_contact import MultiContactSimulation

            return MultiContactSimulation(scenario, mechanism)
        from frictionsim.simulation.single_dof import SingleDofSimulation

        return SingleDofSimulation(scenario, mechanism)

    return simulation


def set_up(scenario: Any) -> dict[str, Any]:
    """Return the arguments of `Mechanism` taken from the scenario: start, effects, channels."""
    return {
        "position": radians(scenario.mechanism.initial_angle_deg),
        "velocity": scenario.mechanism.initial_angular_velocity,
        "effects": scenario.effect_names,
        "channel_info": scenario.CHANNELS,
    }


def kinetic_energy(inertia: float) -> Callable[[Value, Value], Value]:
    """Return the kinetic energy of the coordinate, a function of angle and velocity, J."""
    return lambda angle, velocity: 0.5 * inertia * velocity * velocity


@compilable
def kinetic_energy_of(inertia: Any, velocity: Any) -> Any:
    """Return the kinetic energy of the coordinate, J."""
    return 0.5 * inertia * velocity * velocity


class MultiplesOf(NamedTuple):
    """A switching surface at the multiples of an angle, rad; with the name of its event, if any."""

    every: float
    is_event: bool
    event: str = ""
    is_of_table: bool = False

    def beyond(self, q0: float, v0: float, q1: float, q: float, v: float) -> float:
        """Return a number that is positive beyond the first multiple in a step from q0 to q1."""
        if q1 > q0:
            return q - (math.floor(q0 / self.every) + 1) * self.every
        return (math.ceil(q0 / self.every) - 1) * self.every - q


def total(*terms: Callable[..., Value] | None) -> Callable[..., Value]:
    """Return the sum of functions of the same arguments, added from left to right.

    Terms of absent effects are None and are removed once.
    """
    present = [term for term in terms if term is not None]
    while len(present) > 1:  # three at a time, to reduce the number of nested calls
        present = [_sum(*present[:3]), *present[3:]]
    return present[0]


def _sum(
    one: Callable[..., Value], two: Callable[..., Value], three: Callable[..., Value] | None = None
) -> Callable[..., Value]:
    if three is None:
        return lambda *arguments: one(*arguments) + two(*arguments)
    return lambda *arguments: one(*arguments) + two(*arguments) + three(*arguments)


def _sin(x: float) -> float:
    return math.sin(x)


@compiled_as(_sin)
def sin(x: Any) -> Any:
    """Return the sine of a float, or of each element of an array; NaN of an infinite one."""
    if isinstance(x, float):
        return math.sin(x) if abs(x) < math.inf else math.nan
    return _numpy().sin(x)


def _cos(x: float) -> float:
    return math.cos(x)


@compiled_as(_cos)
def cos(x: Any) -> Any:
    """Return the cosine of a float, or of each element of an array; NaN of an infinite one."""
    if isinstance(x, float):
        return math.cos(x) if abs(x) < math.inf else math.nan
    return _numpy().cos(x)


def _sqrt(x: float) -> float:
    return math.sqrt(x)


@compiled_as(_sqrt)
def sqrt(x: Any) -> Any:
    """Return the square root of a float, or of each element of an array."""
    return math.sqrt(x) if isinstance(x, float) else _numpy().sqrt(x)


def radians(x: Any) -> Any:
    """Return an angle in degrees, or each element of an array, in radians."""
    return math.radians(x) if isinstance(x, float) else _numpy().radians(x)


def hypot(x: float, y: Any) -> Any:
    """Return the hypotenuse for a float, or for each element of an array."""
    if isinstance(y, int | float):
        return math.hypot(x, y)
    each = [math.hypot(x, one) for one in _numpy().asarray(y).tolist()]  # numpy's has other bits
    return _numpy().array(each).view(type(y))


def _numpy() -> Any:
    import numpy  # imported here because `check` does not need it

    return numpy
