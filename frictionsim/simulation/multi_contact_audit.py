"""The self-audit of a run of several coordinates and contacts.

energy_balance      energy input = change of kinetic and potential energy + dissipated energy
friction_law        the friction of each contact is within its static limits while it sticks, and
                    has its kinetic limit while it slides
dissipation_sign    the power of dry friction is never positive, to within the roundoff of its
                    limits, and no impact gives energy
stick_drift         the coordinate of a contact that holds is constant
"""

from typing import TYPE_CHECKING

import numpy as np

from frictionsim.results import STICK, Check
from frictionsim.simulation.audit import ROUNDING, energy_check
from frictionsim.solvers.multi_contact import HOLDING

if TYPE_CHECKING:
    from frictionsim.results import Array, Transition
    from frictionsim.solvers.multi_contact import (
        FrictionContact,
        MultiContactMechanism,
        MultiContactTrajectory,
    )


def audit(
    trajectory: "MultiContactTrajectory",
    mechanism: "MultiContactMechanism",
    energy_limit: float,
    atol: float,
) -> dict[str, Check]:
    """Return the checks by name; all are relative except the drift, in the coordinate's unit.

    Parameters
    ----------
    trajectory : MultiContactTrajectory
    mechanism : MultiContactMechanism
    energy_limit : float
        Allowed residual of the energy balance.
    atol : float
        Absolute tolerance of the integration.
    """
    found = {"energy_balance": energy_check(trajectory, energy_limit, atol, mechanism.energy_scale)}
    frictions = mechanism.frictions
    if frictions:
        violation = max(friction_violation(trajectory, c, i) for i, c in frictions)
        found["friction_law"] = Check(violation, ROUNDING)
    power = max((driving_power(trajectory, c) for _, c in frictions), default=0.0)
    if frictions or "energy_impact" in trajectory.energy_integrals:
        found["dissipation_sign"] = Check(max(power, _gain(trajectory)), 0.0)
    if mechanism.contacts:
        drifts = (
            held_drift(trajectory, i, c.coordinate, c.name)
            for i, c in enumerate(mechanism.contacts)
        )
        found["stick_drift"] = Check(max(drifts), 0.0)
    return found | mechanism.checks(trajectory)


def friction_violation(
    trajectory: "MultiContactTrajectory", contact: "FrictionContact", index: int
) -> float:
    """Return the largest violation of a friction law, relative to the largest static limit."""
    forces, mode = trajectory.forces, trajectory.modes[index]
    friction = contact.force(forces)
    forward, backward = (contact.static_limit(forces, s) for s in (1, -1))
    roundoff = contact.roundoff(trajectory.drive, forces)
    excess = np.maximum(-friction - forward, friction - backward) - roundoff
    sliding = np.where(mode == STICK, 1, mode)
    error = np.abs(friction + sliding * contact.kinetic_limit(forces, sliding)) - roundoff
    worst = float(np.max(np.where(mode == STICK, excess, error), initial=0.0))
    largest = float(np.max(np.maximum(forward, backward), initial=0.0))
    return worst / largest if largest > 0.0 else worst


def driving_power(trajectory: "MultiContactTrajectory", contact: "FrictionContact") -> float:
    """Return the largest positive power of a contact, relative to the largest magnitude."""
    velocity = trajectory.velocity[contact.coordinate]
    power = contact.force(trajectory.forces) * velocity
    # A rope is taut down to a tension that is below zero by its roundoff.
    beyond = power - contact.roundoff(trajectory.drive, trajectory.forces) * np.abs(velocity)
    largest = float(np.max(np.abs(power), initial=0.0))
    return max(0.0, float(np.max(beyond, initial=0.0)) / largest) if largest > 0.0 else 0.0


def _gain(trajectory: "MultiContactTrajectory") -> float:
    """Return the largest energy gained in an impact, relative to the largest energy of impacts."""
    lost = trajectory.energy_integrals.get("energy_impact", np.zeros(0))
    gained = -float(np.min(np.diff(lost), initial=0.0))
    return gained / float(np.max(np.abs(lost))) if gained > 0.0 else 0.0


def held_drift(
    trajectory: "MultiContactTrajectory", index: int, coordinate: int, name: str
) -> float:
    """Return the largest change of a coordinate between samples at which its contact holds."""
    holds = np.isin(trajectory.modes[index], HOLDING)
    moved: Array = np.abs(np.diff(trajectory.position[coordinate]))
    between = np.searchsorted(_releases(trajectory.transitions, name), trajectory.time)
    same = holds[1:] & holds[:-1] & (between[1:] == between[:-1])
    return float(np.max(moved[same], initial=0.0))


def _releases(transitions: "list[Transition]", name: str) -> "Array":
    """Return the times at which a contact was released, s: it may hold again before a sample."""
    return np.array([e.time for e in transitions if e.contact == name and e.mode_to not in HOLDING])
