"""What every run of one coordinate is checked for before its quantities are shown.

energy      work in = change of kinetic and potential energy + heat of friction and damping
friction    |T| within the static limit where it sticks, at the kinetic limit where it slides
power       dry friction never drives
drift       the position does not change while it sticks
"""

from typing import TYPE_CHECKING

import numpy as np

from frictionsim.results import Check

if TYPE_CHECKING:
    from frictionsim.solvers.mechanism import DryFriction, Trajectory

# The local errors of all steps may add up to this many times the relative tolerance.
ENERGY_ERROR_PER_RTOL = 100.0
# ... and rounding is left when the tolerance is below it.
ROUNDING = 1e-12
# Whatever the tolerance, quantities whose energy is further off are of no use.
WORST_ENERGY = 0.01
# An absolute tolerance lets energies be off by no more than this share of the scenario's own size.
SMALL = 1e-8


def audit(
    trajectory: "Trajectory", contact: "DryFriction | None", rtol: float, atol: float, size: float
) -> dict[str, Check]:
    """Return the checks that apply, by name; all are relative but the drift, in rad.

    Parameters
    ----------
    series : Series
    contact : Contact or None
        None where there is no dry friction.
    rtol, atol : float
        Of the integration.
    size : float, J
        An energy of the size of the scenario: its kinetic energy at the start, and the work of the
        largest moment along one radian.
    """
    checks = {"energy_balance": energy_check(trajectory, rtol, atol, size)}
    if contact is not None:
        checks["friction_law"] = friction_check(trajectory, contact)
        checks["dissipation_sign"] = power_check(trajectory)
        checks["stick_drift"] = drift_check(trajectory)
    return checks


def energy_check(trajectory: "Trajectory", rtol: float, atol: float, size: float) -> Check:
    """Compare the work in with where it went, over the largest of the energies.

    Small energies are only integrated to the absolute tolerance, which counts as far as it is
    small for the scenario, too.
    """
    limit = min(ENERGY_ERROR_PER_RTOL * rtol + ROUNDING, WORST_ENERGY)
    residual = -trajectory.energy_integrals["energy_input"]
    floor = min(ENERGY_ERROR_PER_RTOL * atol, SMALL * size) / limit
    largest = np.max(np.abs(residual), initial=floor)
    for name, energy in (*trajectory.energy_integrals.items(), *trajectory.stored_energies.items()):
        if name != "energy_input":
            change = energy - energy[:1]
            residual = residual + change
            largest = max(largest, np.max(np.abs(change), initial=0.0))
    worst = np.max(np.abs(residual), initial=0.0)
    return Check(float(worst / largest) if largest else 0.0, limit)


def friction_check(trajectory: "Trajectory", contact: "DryFriction") -> Check:
    """Return by how much the friction is off what its law allows, over the static limit."""
    u, q, v, mode = trajectory.drive, trajectory.position, trajectory.velocity, trajectory.mode
    static = contact.static_limit(u, q) + contact.roundoff(u, q)
    size = np.abs(trajectory.friction)
    off = np.where(mode == 0, size - static, np.abs(size - contact.kinetic_limit(u, q, v, mode)))
    largest = np.max(static, initial=0.0)
    worst = np.max(off, initial=0.0)
    return Check(float(worst / largest) if largest else float(worst), ROUNDING)


def power_check(trajectory: "Trajectory") -> Check:
    """Return the largest power that friction puts in, over the largest that it takes out."""
    power = trajectory.friction * trajectory.velocity
    largest = np.max(np.abs(power), initial=0.0)
    worst = np.max(power, initial=0.0)
    return Check(float(worst / largest) if worst > 0.0 else 0.0, 0.0)


def drift_check(trajectory: "Trajectory") -> Check:
    """Return the largest change of the position from sample to sample of one stick, rad."""
    sticking = (trajectory.mode[1:] == 0) & (trajectory.mode[:-1] == 0)
    moved = np.abs(np.diff(trajectory.position))
    # Two samples that stick may have a slip between them.
    slips = np.array([e.time for e in trajectory.transitions if e.mode_to != 0])
    between = np.searchsorted(slips, trajectory.time)
    same_stick = sticking & (between[1:] == between[:-1])
    return Check(float(np.max(moved[same_stick], initial=0.0)), 0.0)
