"""The self-audit of a run of one or several coordinates, from the columns of its samples.

energy_balance      energy input = change of kinetic and potential energy + dissipated energy
friction_law        the force of a contact that holds is within its static limits
dissipation_sign    the power of dry friction is never positive, and no impact gives energy
stick_drift         the coordinate of a contact that holds is constant
end_stops           the position is never beyond an end stop
impact_law          an impact on a stop leaves e^2 of the energy, none below the capture speed
release             what leaves stick was at its static limit just before, or a jump of the load
                    takes it past the limit
"""

from math import ulp
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.results import STICK, Check
from frictionsim.scenario import methods
from frictionsim.solvers.events import SAME_TIME_ULPS
from frictionsim.solvers.modes import holds
from frictionsim.solvers.system import STOP

if TYPE_CHECKING:
    from frictionsim.results import Transition
    from frictionsim.scenario.settings import SolverSettings
    from frictionsim.simulation.mechanism import ContactColumns, Mechanism, Samples

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
GIVEN = "angular_velocity"  # what a drive may prescribe
# Limit of what the absolute tolerance allows, relative to the energy scale of the scenario.
ABSOLUTE_ERROR_LIMIT = 1e-8


def audit(
    mechanism: "Mechanism", samples: "Samples", settings: "SolverSettings", steps: int
) -> dict[str, Check]:
    """Return the checks that apply, by name, of a run of so many steps.

    All are relative, but for the drift and the distance beyond a stop, in the coordinate's unit.
    """
    errors = max(ENERGY_ERROR_PER_RTOL, ENERGY_ERROR_PER_STEP * steps)
    limit = min(errors * settings.rtol + ROUNDING, MAX_ENERGY_ERROR)
    atol = settings.atol * mechanism.tolerance_share
    checks = {"energy_balance": Check(energy_residual(mechanism, samples, limit, atol), limit)}
    # Regularised friction creeps instead of sticking; the friction checks do not apply.
    frictions = [
        c for c in mechanism.contacts if c.backward and mechanism.law != methods.REGULARISED
    ]
    impacts = "energy_impact" in mechanism.energies
    free = [c for c in frictions if not (mechanism.prescribed and c.velocity == GIVEN)]
    if frictions:
        carries = mechanism.law == methods.SET_VALUED
        worst = max(friction_violation(samples, c, carries and c in free) for c in frictions)
        checks["friction_law"] = Check(worst, ROUNDING)
    if frictions or (impacts and mechanism.contacts):
        powers = [driving_power(samples, c, atol) for c in frictions]
        powers += [_gain(samples)] if impacts else []
        checks["dissipation_sign"] = Check(max(powers), 0.0)
        checks["stick_drift"] = Check(max(drift(samples, c) for c in mechanism.contacts), 0.0)
    if free and methods.METHODS[settings.backend].locates_events:
        distance = release_distance(samples, free, settings.duration)
        checks["release"] = Check(distance, RELEASE_DISTANCE)
    stops = mechanism.system.stops
    if stops is not None:
        angle = samples["angle"]
        largest = float(np.max(np.abs(angle), initial=0.0))
        excess = np.maximum(angle - stops.highest, stops.lowest - angle)
        beyond = float(np.max(excess, initial=0.0))
        checks["end_stops"] = Check(beyond, ROUNDING * largest)
        checks["impact_law"] = Check(impact_violation(samples, stops), IMPACT_ERROR)
    return checks | mechanism.checks(samples)


def energy_residual(mechanism: "Mechanism", samples: "Samples", limit: float, atol: float) -> float:
    """Return the residual of the energy balance, relative to the largest of the energies.

    These are the work of the drive, the changes of the others, and the kinetic energy. Small
    energies are integrated to the absolute tolerance only. It counts up to ABSOLUTE_ERROR_LIMIT
    times the energy scale of the scenario.
    """
    if not samples.time.size:
        return 0.0
    residual = -samples["energy_input"]
    size = mechanism.energy_scale(samples)
    largest = min(ENERGY_ERROR_PER_RTOL * atol, ABSOLUTE_ERROR_LIMIT * size) / limit
    largest = max(largest, float(np.max(np.abs(residual))))
    stored = [n for n in ("energy_kinetic", "energy_potential") if n in samples.columns]
    for name in (*mechanism.energies, *stored):
        if name != "energy_input":
            column = samples[name]
            change = column - column[0]
            residual = residual + change
            largest = max(largest, float(np.max(np.abs(change))))
    largest = max(largest, float(np.max(samples["energy_kinetic"])))
    return float(np.max(np.abs(residual))) / largest if largest > 0.0 else 0.0


def friction_violation(samples: "Samples", contact: "ContactColumns", carries: bool) -> float:
    """Return by how much a force exceeds its static limit at most, relative to the largest one.

    `carries` says that a contact that holds carries what its margins are of, which eq 30 need not:
    then they are judged, too, as the limits may differ by direction.
    """
    limit = 0.5 * (samples[contact.forward] + samples[contact.backward])
    excess = np.abs(samples[contact.force]) - limit
    if carries:
        least = np.minimum(samples[contact.forward], samples[contact.backward])
        excess = np.maximum(excess, -least)
    excess = excess - samples[contact.roundoff]
    worst = float(np.max(np.where(samples[contact.mode] == STICK, excess, 0.0), initial=0.0))
    largest = float(np.max(limit, initial=0.0))
    return worst / largest if largest > 0.0 else worst


def driving_power(samples: "Samples", contact: "ContactColumns", atol: float) -> float:
    """Return the largest positive power of a contact, relative to the largest magnitude.

    A speed below the absolute tolerance may have either sign, a force below its roundoff, too.
    """
    velocity = samples[contact.velocity]
    power = samples[contact.force] * velocity
    beyond = power - samples[contact.roundoff] * np.abs(velocity)
    driving = float(np.max(np.where(np.abs(velocity) > atol, beyond, 0.0), initial=0.0))
    largest = float(np.max(np.abs(power), initial=0.0))
    return driving / largest if largest > 0.0 else 0.0


def _gain(samples: "Samples") -> float:
    """Return the largest energy gained in an impact, relative to the largest energy of impacts."""
    lost = samples["energy_impact"]
    gained = -float(np.min(np.diff(lost), initial=0.0))
    return gained / float(np.max(np.abs(lost))) if gained > 0.0 else 0.0


def drift(samples: "Samples", contact: "ContactColumns") -> float:
    """Return the largest change of a coordinate between samples of one hold of its contact."""
    released = [
        e.time
        for e in samples.transitions
        if e.contact in (contact.name, STOP) and not holds(e.mode_to)
    ]
    holding = np.array([holds(int(mode)) for mode in samples[contact.mode]], dtype=bool)
    releases = np.searchsorted(released, samples.time)
    same = holding[1:] & holding[:-1] & (np.diff(releases) == 0)
    moved = np.abs(np.diff(samples[contact.position]))
    return float(np.max(np.where(same, moved, 0.0), initial=0.0))


def impact_violation(samples: "Samples", stops: Any) -> float:
    """Return the largest error of the energy after an impact, relative to that before one."""
    hits = np.array([e.contact == STOP for e in samples.transitions], dtype=bool)
    before = np.abs(samples.before["angular_velocity"][hits])
    after = samples.after["angular_velocity"][hits]
    rebound = np.where(before >= stops.capture_speed, stops.restitution * before, 0.0)
    largest = float(np.max(before, initial=0.0))
    if largest == 0.0:
        return 0.0
    return float(np.max(np.abs((after / largest) ** 2 - (rebound / largest) ** 2)))


def _breaks_away(event: "Transition") -> bool:
    return event.mode_from == STICK and event.mode_to != STICK and event.contact != STOP


def release_distance(samples: "Samples", frictions: list["ContactColumns"], end: float) -> float:
    """Return the largest distance of a breakaway from its static limit, relative to this.

    Just before it; or, where another event or a jump of the load comes with it, and at the start of
    the run, by how much the contact could hold just after it. One that comes as another contact
    turns, its slip passing zero without an event, is left out; so are two that come at the start of
    the run, of which each may hold only as long as the other one does.
    """
    columns, worst = {c.name: c for c in frictions}, 0.0
    apart = 2.0 * SAME_TIME_ULPS * ulp(end)
    for i, event in enumerate(samples.transitions):
        if not _breaks_away(event) or event.contact not in columns:
            continue
        contact = columns[event.contact]
        others_turn = [_turns(samples.before, c, i) for c in frictions if c is not contact]
        if event.time > 0.0 and any(others_turn):
            continue
        before, after = (
            _margin(side, contact, i, event.mode_to) for side in (samples.before, samples.after)
        )
        others = [e for e in samples.transitions if e.contact != event.contact]
        jumps = before >= 0.0 >= after
        if event.time == 0.0:
            is_alone = not any(_breaks_away(e) and e.time == 0.0 for e in others)
            worst = max(worst, after if is_alone else 0.0)
        elif jumps or any(abs(e.time - event.time) <= apart for e in others):
            worst = max(worst, min(abs(before), max(after, 0.0)))
        else:
            worst = max(worst, abs(before))
    return worst


def _turns(side: Any, contact: "ContactColumns", i: int) -> bool:
    """Return whether a contact that slides is at rest on a side of an event."""
    return bool(side[contact.mode][i] != STICK and side[contact.velocity][i] == 0.0)


def _margin(side: Any, contact: "ContactColumns", i: int, direction: int) -> float:
    """Return a margin in a direction, relative to limit and force; zero if it is roundoff."""
    forward, backward = float(side[contact.forward][i]), float(side[contact.backward][i])
    margin = forward if direction > 0 else backward
    size = 0.5 * (abs(forward + backward) + abs(backward - forward))
    beyond = max(abs(margin) - float(side[contact.roundoff][i]), 0.0)
    return float(np.copysign(beyond, margin)) / size if size > 0.0 else 0.0
