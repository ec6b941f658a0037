"""The self-audit of a run of one coordinate.

energy_balance      energy input = change of kinetic and potential energy + dissipated energy
friction_law        |T| at most the static limit while sticking, the kinetic limit while sliding
dissipation_sign    the power of dry friction is never positive
stick_drift         the position is constant while the contact sticks
"""

from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.results import Check

if TYPE_CHECKING:
    from frictionsim.solvers.mechanism import DryFriction, Trajectory

# Allowed sum of the local errors of all steps, in relative tolerances.
ENERGY_ERROR_PER_RTOL = 100.0
# Allowed error of the energy for tolerances below the roundoff.
ROUNDING = 1e-12
# Upper limit of the allowed error, whatever the tolerance.
MAX_ENERGY_ERROR = 0.01
# Limit of what the absolute tolerance allows, relative to the energy scale of the scenario.
ABSOLUTE_ERROR_LIMIT = 1e-8


def audit(
    trajectory: "Trajectory", contact: "DryFriction | None", rtol: float, atol: float, size: float
) -> dict[str, Check]:
    """Return the checks that apply, by name; all are relative except the drift, in rad.

    Parameters
    ----------
    trajectory : Trajectory
    contact : DryFriction or None
        None without set-valued dry friction.
    rtol, atol : float
        Tolerances of the integration.
    size : float, J
        Energy scale of the scenario: its kinetic energy at the start plus the work of the largest
        applied torque over one radian.

    Returns
    -------
    dict of Check
    """
    found = {"energy_balance": energy_check(trajectory, rtol, atol, size)}
    if contact is not None:
        found["friction_law"] = Check(float(friction_violation(trajectory, contact)), ROUNDING)
        found["dissipation_sign"] = Check(float(driving_power(trajectory)), 0.0)
        found["stick_drift"] = Check(stick_drift(trajectory), 0.0)
    return found


def energy_limit(rtol: float) -> float:
    """Return the allowed residual of the energy balance."""
    return min(ENERGY_ERROR_PER_RTOL * rtol + ROUNDING, MAX_ENERGY_ERROR)


def energy_check(trajectory: "Trajectory", rtol: float, atol: float, size: float) -> Check:
    """Return the check of the energy balance; the parameters are those of `audit`."""
    limit = energy_limit(rtol)
    return Check(float(energy_residual(trajectory, limit, atol, size)), limit)


# The next three also take the samples of many runs, (n, runs), and return one value for each.


def energy_residual(trajectory: "Trajectory", limit: Any, atol: Any, size: Any) -> Any:
    """Return the residual of the energy balance, relative to the largest of the energies.

    Small energies are integrated to the absolute tolerance only. It counts up to
    ABSOLUTE_ERROR_LIMIT times the energy scale of the scenario.

    Parameters
    ----------
    trajectory : Trajectory
    limit : float
        Allowed residual.
    atol : float
        Tolerance of the integration.
    size : float, J
        Energy scale of the scenario.
    """
    residual = -trajectory.energy_integrals["energy_input"]
    floor = np.minimum(ENERGY_ERROR_PER_RTOL * atol, ABSOLUTE_ERROR_LIMIT * size) / limit
    largest = np.maximum(np.max(np.abs(residual), axis=0, initial=0.0), floor)
    for name, energy in (*trajectory.energy_integrals.items(), *trajectory.stored_energies.items()):
        if name != "energy_input":
            change = energy - energy[:1]
            residual = residual + change
            largest = np.maximum(largest, np.max(np.abs(change), axis=0, initial=0.0))
    worst = np.max(np.abs(residual), axis=0, initial=0.0)
    return _ratio(worst, largest, 0.0)


def friction_violation(trajectory: "Trajectory", contact: "DryFriction") -> Any:
    """Return the largest violation of the friction law, relative to the static limit."""
    u, q, v, mode = trajectory.drive, trajectory.position, trajectory.velocity, trajectory.mode
    static = contact.static_limit(u, q) + contact.roundoff(u, q)
    size = np.abs(trajectory.friction)
    sliding_error = np.abs(size - contact.kinetic_limit(u, q, v, mode))
    excess = np.where(mode == 0, size - static, sliding_error)
    largest = np.max(static, axis=0, initial=0.0)
    worst = np.max(excess, axis=0, initial=0.0)
    return _ratio(worst, largest, worst)


def driving_power(trajectory: "Trajectory") -> Any:
    """Return the largest positive power of friction, relative to the largest magnitude."""
    power = trajectory.friction * trajectory.velocity
    largest = np.max(np.abs(power), axis=0, initial=0.0)
    return _ratio(np.max(power, axis=0, initial=0.0), largest, 0.0)


def _ratio(worst: Any, largest: Any, otherwise: Any) -> Any:
    """Return worst/largest where largest is not zero."""
    some = largest != 0.0
    return np.where(some, worst / np.where(some, largest, 1.0), otherwise)


def stick_drift(trajectory: "Trajectory") -> float:
    """Return the largest change of the position between samples of one sticking phase, rad."""
    sticking = (trajectory.mode[1:] == 0) & (trajectory.mode[:-1] == 0)
    moved = np.abs(np.diff(trajectory.position))
    # The contact may slip between two samples at which it sticks.
    slips = np.array([e.time for e in trajectory.transitions if e.mode_to != 0])
    between = np.searchsorted(slips, trajectory.time)
    same_stick = sticking & (between[1:] == between[:-1])
    return float(np.max(moved[same_stick], initial=0.0))
