"""What mechanisms of one coordinate share: the base of their scenarios, channels, warnings."""

from collections.abc import Callable, Iterable, Mapping
from math import ceil, floor, radians
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Self

from pydantic import model_validator

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
from frictionsim.scenario.methods import SET_VALUED, SINGLE_DOF, Pairs
from frictionsim.scenario.schema import inconsistent
from frictionsim.scenario.settings import Scenario
from frictionsim.scenario.signal_tables import signal_from
from frictionsim.scenario.signals import Signal
from frictionsim.simulation.mechanism import ContactColumns, Mechanism, Samples
from frictionsim.solvers.system import MARGINS, OneCoordinate

if TYPE_CHECKING:
    from frictionsim.results import Quantities
    from frictionsim.simulation.mechanism import Derived, Simulation

# The modes of dry friction; the others are of belts and ropes.
SINGLE_DOF_MODES: Flags = tuple(flag for flag in MODES if flag[0] in (BACKWARD, STICK, FORWARD))

# The error metrics of a work-precision study.
METRICS = (*SINGLE_DOF_METRICS, Metric("friction_heat", "quantity", "energy_friction", "J"))


class SingleDofScenario(Scenario):
    """A scenario of one coordinate; its `mechanism` has the initial angle and angular velocity.

    Of a kind with PRESCRIBES, the key `drive.speed` gives the velocity.
    """

    PAIRS: ClassVar[Pairs] = SINGLE_DOF
    PRESCRIBES: ClassVar[bool] = False

    @property
    def given_speed(self) -> Signal | None:
        """The prescribed angular velocity, rad/s; None if it follows from the equation."""
        speed = getattr(getattr(self, "drive", None), "speed", None) if self.PRESCRIBES else None
        return None if speed is None else signal_from(speed)

    @property
    def law(self) -> str:
        """The friction law; empty with a prescribed speed, which needs none."""
        return super().law if self.given_speed is None else ""

    @model_validator(mode="after")
    def _check_given_speed(self) -> Self:
        if self.given_speed is None:
            return self
        scenario: Any = self
        if scenario.mechanism.initial_angular_velocity != 0.0:
            raise inconsistent(
                ("mechanism", "initial_angular_velocity"),
                "the drive prescribes the speed; remove this key",
            )
        for name, effect in scenario.effects:
            if (getattr(effect, "law", None) or SET_VALUED) != SET_VALUED:
                raise inconsistent(
                    ("effects", name, "law"),
                    f"'{effect.law}' tells stick from slip by other rules, and the drive prescribes"
                    f" the speed: remove this key, or use law = '{SET_VALUED}'",
                )
        return self


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


def simulation_of(build: Callable[[Any], Mechanism]) -> Callable[[Scenario], "Simulation"]:
    """Return the function `simulation` of a kind, from its `build`."""

    def simulation(scenario: Scenario) -> "Simulation":
        # Imported here because it imports numpy, which `check` does not need.
        from frictionsim.simulation.coordinates import CoordinateSimulation

        return CoordinateSimulation(scenario, build(scenario))

    return simulation


def start_of(scenario: Any) -> tuple[float, float]:
    """Return angle, rad, and angular velocity, rad/s, at the start."""
    mechanism, speed = scenario.mechanism, getattr(scenario, "given_speed", None)
    velocity = mechanism.initial_angular_velocity if speed is None else speed(0.0)
    return radians(mechanism.initial_angle_deg), velocity


def one_coordinate(
    scenario: Scenario,
    system: OneCoordinate,
    quantities: "Callable[[Samples], Quantities]",
    *,
    run_warnings: Callable[[Samples], list[str]] = lambda samples: [],
    torques: Callable[[float], Iterable[float]] | None = None,
    tolerance_share: float = 1.0,
    prescribed: bool = False,
    derived: "Mapping[str, Derived]" = MappingProxyType({}),
) -> Mechanism:
    """Return a mechanism of one coordinate for the simulation.

    Parameters
    ----------
    scenario : Scenario
    system : OneCoordinate
    quantities, run_warnings : callable
        Of the samples: the quantities of the summary and the warnings that are specific to the
        mechanism. A warning about a body that moves too little for `solver.atol` is there
        without them.
    torques : callable or None
        Of a time, s: the torques on the body at rest at the start, one by one, N m. Without it
        those of the terms, of which the drive's may then be no sum of several.
    tolerance_share : float
        See `Mechanism`.
    prescribed : bool
        The drive is the velocity, rad/s, and its torque the channel `drive_torque`, N m.
    derived : mapping of name to Derived
        See `Mechanism`; of a journal with friction `journal_channels`.

    Returns
    -------
    Mechanism
        Its channels are those columns of the system that are in the `CHANNELS` of the scenario.
    """
    motion = "angle", "angular_velocity", "friction_torque", "mode"
    friction = system.friction
    atol = scenario.solver.atol * tolerance_share

    def energy_scale(samples: Samples) -> float:
        import numpy as np  # imported here because `check` does not need it

        torque = samples["drive_torque"] if prescribed else torque_at_rest(samples)
        return float(np.max(np.abs(torque), initial=0.0)) + system.kinetic(system.start[1])

    def warnings(samples: Samples) -> list[str]:
        from frictionsim.simulation.run_warnings import tiny_motion

        tiny = tiny_motion(samples["angle"], samples["angular_velocity"], atol)
        return [*tiny, *run_warnings(samples)]

    def torques_of_terms(t: float) -> list[float]:
        u = system.acting(t, system.start[0], 0.0)
        return [torque(u, system.start[0], 0.0) for torque in system.torques]

    return Mechanism(
        system=system,
        columns=system.columns,
        contacts=() if friction is None else (ContactColumns(friction.name, *motion, *MARGINS),),
        energies=system.energies,
        channel_info=scenario.CHANNELS,
        effects=scenario.effect_names,
        quantities=quantities,
        energy_scale=energy_scale,
        run_warnings=warnings,
        law="" if friction is None else SET_VALUED if prescribed else friction.law,
        tolerance_share=tolerance_share,
        prescribed=prescribed,
        torques=torques or torques_of_terms,
        derived=derived,
    )


def torque_at_rest(samples: Samples) -> Any:
    """Return the torque at rest of all but dry friction, (n,), N m."""
    if "torque_at_rest" in samples.columns:
        return samples["torque_at_rest"]
    forward, backward, _ = MARGINS
    return 0.5 * (samples[backward] - samples[forward])


class MultiplesOf(NamedTuple):
    """The surface of the multiples of an angle, at each of which a step ends.

    Attributes
    ----------
    every : float, rad
        Above 0.
    event : str
        The name of the event that is recorded there; empty for none.
    """

    every: float
    event: str = ""

    def beyond(self, step: Any, t: float, y: list[float]) -> float:
        """Return a number that is positive beyond the first multiple in a step."""
        every, start = self.every, step.y_old[0]
        if step.y[0] > start:
            first: float = (floor(start / every) + 1) * every
            return y[0] - first
        return (ceil(start / every) - 1) * every - y[0]
