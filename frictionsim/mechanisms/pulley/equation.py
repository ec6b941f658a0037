"""The equation of motion of a pulley without masses on its cord."""

from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.mechanisms.effects import (
    CONTACT_NAME,
    ROUNDING,
    Damping,
    Journal,
    damping_of,
    journal_of,
    with_damping,
    with_damping_power,
)
from frictionsim.mechanisms.pulley.schema import PulleyScenario
from frictionsim.mechanisms.pulley.statics import impending_motion_forces, limit_torques
from frictionsim.mechanisms.single_dof import kinetic_energy_of, set_up, sqrt
from frictionsim.results import Quantities
from frictionsim.scenario.signal_tables import signal_from
from frictionsim.scenario.signals import Curve, curve_of, doubles
from frictionsim.solvers.mechanism import Mechanism, Trajectory, Value, equation_of, friction_of

if TYPE_CHECKING:
    from array import array

    from frictionsim.solvers.contacts import MultiContactMechanism


class CordForce(NamedTuple):
    """A force P on the cord, which carries the load W."""

    W: float
    r_e: float

    def moment(self, P: Value) -> Value:
        """Return (P - W) r_e, N m."""
        return (P - self.W) * self.r_e

    def power(self, P: Value, w: Value) -> Value:
        """Return the power of the drive, W."""
        return P * self.r_e * w

    def rounding(self, P: Value) -> Value:
        """Return the roundoff of moment and limit, N m."""
        return ROUNDING * self.r_e * (abs(P) + self.W)


class VerticalForce(CordForce):
    """A force parallel to the load."""

    def shaft_reaction(self, P: Value) -> Value:
        """Return R, N."""
        return abs(P + self.W)


class HorizontalForce(CordForce):
    """A force across the load."""

    def shaft_reaction(self, P: Value) -> Value:
        """Return R, N."""
        return sqrt(P * P + self.W * self.W)


class Torque(NamedTuple):
    """A torque tau on the pulley: P is zero, so that the reaction of the shaft is W."""

    W: float
    r_e: float

    def moment(self, tau: Value) -> Value:
        """Return tau - W r_e, N m."""
        return tau - self.W * self.r_e

    def shaft_reaction(self, tau: Value) -> Value:
        """Return R, N."""
        return self.W + 0.0 * tau  # for arrays of the drive

    def power(self, tau: Value, w: Value) -> Value:
        """Return the power of the drive, W."""
        return tau * w

    def rounding(self, tau: Value) -> Value:
        """Return the roundoff of moment and limit, N m."""
        return ROUNDING * (abs(tau) + self.r_e * self.W)


class Pulley(NamedTuple):
    """I w' = M - b w + T; `load` gives the moment M of load and drive, and the reaction R."""

    drive: Curve
    load: VerticalForce | HorizontalForce | Torque
    inertia: float
    journal: tuple[Journal, ...]
    damping: tuple[Damping, ...]
    breaks: "array[float]"
    surfaces: tuple[Any, ...] = ()
    stops: tuple[Any, ...] = ()
    reversing_load: tuple[Any, ...] = ()

    def applied_torque(self, u: Value, angle: Value, w: Value) -> Value:
        """Return M - b w, N m."""
        return with_damping(self.load.moment(u), self.damping, w)

    def static_limit(self, u: Value, angle: Value) -> Value:
        """Return r_s R, N m."""
        return self.journal[0].r_s * self.load.shaft_reaction(u)

    def kinetic_limit(self, u: Value, angle: Value, w: Value, s: Value) -> Value:
        """Return r_k R, N m."""
        return self.journal[0].r_k * self.load.shaft_reaction(u)

    def roundoff(self, u: Value, angle: Value) -> Value:
        """Return the roundoff of the torque and its limit, N m."""
        return self.load.rounding(u)

    def powers(self, u: Value, angle: Value, w: Value) -> tuple[Value, ...]:
        """Return the powers of drive and damping, W."""
        powers: tuple[Value, ...] = with_damping_power((self.load.power(u, w),), self.damping, w)
        return powers

    def torques_and_powers(
        self, u: Value, angle: Value, w: Value, s: Value
    ) -> tuple[Value, Value, tuple[Value, ...]]:
        """Return the applied torque, its kinetic limit and the powers."""
        load = self.load
        return (
            with_damping(load.moment(u), self.damping, w),
            self.journal[0].r_k * load.shaft_reaction(u),
            with_damping_power((load.power(u, w),), self.damping, w),
        )

    def stored_energies(self, angle: Value, w: Value) -> tuple[Value, ...]:
        """Return the kinetic energy, and the potential one of the load, J."""
        return kinetic_energy_of(self.inertia, w), self.load.W * self.load.r_e * angle

    def first_excess(self, angle: float, a: float, b: float) -> float:
        """Return b: the limits are monotone between the breaks."""
        return b


def build(scenario: PulleyScenario) -> "Mechanism | MultiContactMechanism":
    """Return the mechanism, composed of the effects in the scenario."""
    if scenario.effects.hanging_masses is not None:
        from frictionsim.mechanisms.pulley.masses import mechanism_with_masses

        return mechanism_with_masses(scenario)
    r_e, load = scenario.mechanism.cord_radius, scenario.mechanism.load
    journal, damping = scenario.effects.shaft_friction, scenario.effects.viscous_damping
    by_torque = scenario.drive.force is None
    table = scenario.drive.torque if by_torque else scenario.drive.force
    assert table is not None  # checked by the model of the drive
    signal, vertical = signal_from(table), scenario.drive.direction == "vertical"
    form = Torque if by_torque else VerticalForce if vertical else HorizontalForce
    r_s = journal.static_radius if journal else 0.0
    breaks = () if by_torque else _critical_forces(r_e, r_s, load, vertical)
    system = Pulley(
        curve_of(signal),
        form(load, r_e),
        scenario.mechanism.inertia,
        journal_of(journal),
        damping_of(damping),
        doubles(breaks),
    )

    def channels(trajectory: Trajectory) -> dict[str, Value]:
        drive = trajectory.drive
        name = "drive_torque" if by_torque else "drive_force"
        return {name: drive, "shaft_reaction": system.load.shaft_reaction(drive)}

    def quantities(trajectory: Trajectory) -> Quantities:
        return limit_torques(scenario) if by_torque else impending_motion_forces(scenario)

    flows = ("energy_input", "energy_damping")[: 2 if damping else 1]
    return Mechanism(
        drive=signal,
        contact=friction_of(system, CONTACT_NAME, journal.law_of_contact()) if journal else None,
        channels=channels,
        quantities=quantities,
        **equation_of(system, flows, ("energy_kinetic", "energy_potential")),
        **set_up(scenario),
    )


def _critical_forces(arm: float, r_s: float, load: float, vertical: bool) -> tuple[float, ...]:
    """Return the extrema of +-(P - W) r_e - r_s R over P, N."""
    if vertical:
        return (-load,)
    if r_s <= arm:
        return (0.0,)
    extremum = load * arm / sqrt(r_s * r_s - arm * arm)
    return (-extremum, extremum)
