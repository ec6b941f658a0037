"""The self-audit of a run of one coordinate.

energy_balance      energy input = change of kinetic and potential energy + dissipated energy
friction_law        |T| at most the static limit while sticking, the kinetic limit while sliding
dissipation_sign    the power of dry friction is never positive
stick_drift         the position is constant while the contact sticks
end_stops           the position is never beyond an end stop
impact_law          an impact on a stop leaves e^2 of the energy, none below the capture speed
release             of located events: what leaves stick was at its static limit just before, or a
                    jump of the load takes it past the limit
"""

from math import ulp
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.results import STICK, Check, Transition
from frictionsim.solvers.common import SAME_TIME_ULPS
from frictionsim.solvers.end_stops import EVENT

if TYPE_CHECKING:
    from frictionsim.results import Array
    from frictionsim.solvers.mechanism import DryFriction, EndStops, Mechanism, Trajectory

# Allowed sum of the local errors of all steps, in relative tolerances, and of long runs that of
# each step: a flywheel with an eccentric mass was measured to have 0.03.
ENERGY_ERROR_PER_RTOL = 100.0
ENERGY_ERROR_PER_STEP = 0.1
# Allowed error of the energy for tolerances below the roundoff.
ROUNDING = 1e-12
# Upper limit of the allowed error, whatever the tolerance.
MAX_ENERGY_ERROR = 0.01
# Allowed error of the energy after an impact, relative to the largest energy before one. A rebound
# whose flight rounding hides is left out; it has to be of less energy.
IMPACT_ERROR = 1e-9
# Allowed distance from the static limit of what leaves stick, relative to the limit.
RELEASE_DISTANCE = 1e-9
# Limit of what the absolute tolerance allows, relative to the energy scale of the scenario.
ABSOLUTE_ERROR_LIMIT = 1e-8


def audit(
    trajectory: "Trajectory",
    contact: "DryFriction | None",
    energy_limit: float,
    atol: float,
    size: float,
    stops: "EndStops | None" = None,
) -> dict[str, Check]:
    """Return the checks that apply, by name; all are relative except two, in rad.

    Parameters
    ----------
    trajectory : Trajectory
    contact : DryFriction or None
        None without set-valued dry friction.
    energy_limit : float
        Allowed residual of the energy balance.
    atol : float
        Absolute tolerance of the integration.
    size : float, J
        Energy scale of the scenario: its kinetic energy at the start plus the work of the largest
        applied torque over one radian.
    stops : EndStops or None
    """
    checks = {"energy_balance": energy_check(trajectory, energy_limit, atol, size)}
    if contact is not None:
        checks["friction_law"] = Check(float(friction_violation(trajectory, contact)), ROUNDING)
        checks["dissipation_sign"] = Check(float(driving_power(trajectory, atol)), 0.0)
        checks["stick_drift"] = Check(stick_drift(trajectory), 0.0)
    if stops is not None:
        checks["end_stops"] = end_stops_check(trajectory, stops)
        if trajectory.velocity_before is not None:
            checks["impact_law"] = Check(impact_violation(trajectory, stops), IMPACT_ERROR)
    return checks


def allowed_residual(rtol: float, steps: int = 0) -> float:
    """Return the allowed residual of the energy balance of a run with a number of steps."""
    errors = max(ENERGY_ERROR_PER_RTOL, ENERGY_ERROR_PER_STEP * steps)
    return min(errors * rtol + ROUNDING, MAX_ENERGY_ERROR)


def energy_check(trajectory: "Trajectory", limit: float, atol: float, size: float) -> Check:
    """Return the check of the energy balance; the parameters are those of `energy_residual`."""
    return Check(float(energy_residual(trajectory, limit, atol, size)), limit)


def energy_residual(trajectory: "Trajectory", limit: Any, atol: Any, size: Any) -> Any:
    """Return the residual of the energy balance, relative to the largest of the energies.

    These are the work of the drive, the changes of the others, and the kinetic energy. Small
    energies are integrated to the absolute tolerance only. It counts up to ABSOLUTE_ERROR_LIMIT
    times the energy scale of the scenario.

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
    kinetic = trajectory.stored_energies["energy_kinetic"]
    largest = np.maximum(largest, np.max(kinetic, axis=0, initial=0.0))
    worst = np.max(np.abs(residual), axis=0, initial=0.0)
    return _ratio(worst, largest, 0.0)


def friction_violation(trajectory: "Trajectory", contact: "DryFriction") -> Any:
    """Return the largest violation of the friction law, relative to the largest of its limits.

    The inertia of an eccentric mass loads a contact that slides, and none that sticks.
    """
    u, q, v, mode = trajectory.drive, trajectory.position, trajectory.velocity, trajectory.mode
    static = contact.static_limit(u, q) + contact.roundoff(u, q)
    kinetic = contact.kinetic_limit(u, q, v, mode)
    size = np.abs(trajectory.friction)
    excess = np.where(mode == 0, size - static, np.abs(size - kinetic))
    limits = np.maximum(static, np.where(mode == 0, 0.0, kinetic))
    largest = np.max(limits, axis=0, initial=0.0)
    worst = np.max(excess, axis=0, initial=0.0)
    return _ratio(worst, largest, worst)


def driving_power(trajectory: "Trajectory", atol: Any) -> Any:
    """Return the largest positive power of friction, relative to the largest magnitude.

    A speed below the absolute tolerance may have either sign.
    """
    velocity = trajectory.velocity
    power = trajectory.friction * velocity
    largest = np.max(np.abs(power), axis=0, initial=0.0)
    driving = np.where(np.abs(velocity) > atol, power, 0.0)
    return _ratio(np.max(driving, axis=0, initial=0.0), largest, 0.0)


def _ratio(worst: Any, largest: Any, otherwise: Any) -> Any:
    """Return worst/largest where largest is not zero."""
    some = largest != 0.0
    return np.where(some, worst / np.where(some, largest, 1.0), otherwise)


def stick_drift(trajectory: "Trajectory") -> float:
    """Return the largest change of the position between samples of one sticking phase, rad."""
    slips = [e.time for e in trajectory.transitions if e.mode_to != STICK]
    releases = np.searchsorted(slips, trajectory.time)
    return float(drift(trajectory.position, trajectory.mode == STICK, releases))


def drift(position: Any, holds: Any, releases: Any) -> Any:
    """Return the largest change of a coordinate between samples at which its contact holds.

    `releases` says how often it was released before a sample: it may hold again at the next one.
    """
    same = holds[1:] & holds[:-1] & (np.diff(releases, axis=0) == 0)
    moved = np.where(same, np.abs(np.diff(position, axis=0)), 0.0)
    return np.max(moved, axis=0, initial=0.0)


def end_stops_check(trajectory: "Trajectory", stops: "EndStops") -> Check:
    """Return the check of the largest distance beyond a stop, rad, but for rounding."""
    largest = np.max(np.abs(trajectory.position), initial=0.0)
    beyond = np.max(stops.excess(trajectory.position), initial=0.0)
    return Check(float(beyond), ROUNDING * float(largest))


def impact_violation(trajectory: "Trajectory", stops: "EndStops") -> float:
    """Return the largest error of the energy after an impact on a stop.

    It is relative to the largest energy before an impact.
    """
    assert trajectory.velocity_before is not None  # checked by the caller
    assert trajectory.velocity_after is not None
    hits = np.array([event.contact == EVENT for event in trajectory.transitions], dtype=bool)
    before, after = np.abs(trajectory.velocity_before[hits]), trajectory.velocity_after[hits]
    rebound = np.where(before >= stops.capture_speed, stops.restitution * before, 0.0)
    largest = np.max(before, initial=0.0)
    if largest == 0.0:
        return 0.0
    return float(np.max(np.abs((after / largest) ** 2 - (rebound / largest) ** 2)))


def leaves_stick(event: Transition) -> bool:
    """Return whether a contact breaks away at an event."""
    return event.mode_from == STICK and event.mode_to != STICK and event.contact != EVENT


def release_check(
    mechanism: "Mechanism", before: "Trajectory", after: "Trajectory", end: float
) -> Check:
    """Return the check of the breakaways, each with the samples immediately before and after it.

    Parameters
    ----------
    mechanism : Mechanism
    before, after : Trajectory
        A sample for each breakaway.
    end : float, s
        Duration of the run, which sets the roundoff of the time.
    """
    distance = release_distance(mechanism, before, after)
    for i in np.flatnonzero(distance > RELEASE_DISTANCE):
        t, q, s = (float(x[i]) for x in (after.time, after.position, after.mode))
        # At a jump, the load passes the limit within the roundoff of the time.
        early, late = (
            margin_at_rest(mechanism, mechanism.drive(x), q, s) for x in (just_before(t, end), t)
        )
        if early >= 0.0 >= late:
            distance[i] = 0.0
    return Check(float(np.max(distance, initial=0.0)), RELEASE_DISTANCE)


def just_before(t: float, end: float) -> float:
    """Return a time that is earlier by the roundoff of event location in a run to `end`, s."""
    return t - 2.0 * SAME_TIME_ULPS * ulp(end)


def release_distance(mechanism: "Mechanism", before: "Trajectory", after: "Trajectory") -> "Array":
    """Return the distance of each breakaway from its static limit, relative to this, (n,).

    Just before it; of a breakaway at the start of the run, by how much the contact could hold.
    """
    off, left = (
        margin_at_rest(mechanism, at.drive, at.position, after.mode) for at in (before, after)
    )
    distance: Array = np.where(after.time > 0.0, np.abs(off), np.maximum(left, 0.0))
    return distance


def margin_at_rest(mechanism: "Mechanism", u: Any, q: Any, direction: Any) -> Any:
    """Return the margin of the torque in a direction, at rest, to the static limit."""
    contact = mechanism.contact
    assert contact is not None  # which breaks away
    torque = direction * mechanism.applied_torque(u, q, 0.0 * q)
    return relative_margin(contact.static_limit(u, q), torque, contact.roundoff(u, q))


def relative_margin(limit: Any, force: Any, roundoff: Any) -> Any:
    """Return a limit minus a force, over the sum of their sizes; zero if it is roundoff.

    A limit is negative where a rope pushes, and what needs that does not hold.
    """
    margin = limit - force
    beyond = np.copysign(np.maximum(np.abs(margin) - roundoff, 0.0), margin)
    return _ratio(beyond, np.abs(limit) + np.abs(force), 0.0)
