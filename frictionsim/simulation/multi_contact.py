"""The simulation of a mechanism of several coordinates and contacts, and its results.

The self-audit of a run of several coordinates and contacts.

energy_balance      energy input = change of kinetic and potential energy + dissipated energy
friction_law        the friction of each contact is within its static limits while it sticks, and
                    has its kinetic limit while it slides
dissipation_sign    the power of dry friction is never positive, to within the roundoff of its
                    limits, and no impact gives energy
stick_drift         the coordinate of a contact that holds is constant
release             what leaves stick was at its static limit just before; or else, at a jump of the
                    load, an impact, a change of another contact or its slip passing zero at that
                    instant, no combination in which more contacts hold is within all limits
"""

from array import array
from collections.abc import Sequence
from itertools import product
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.results import (
    BACKWARD,
    FORWARD,
    SLACK,
    STICK,
    TAUT,
    Check,
    Quantities,
    Quantity,
    Transition,
)
from frictionsim.simulation.audit import (
    RELEASE_DISTANCE,
    ROUNDING,
    allowed_residual,
    drift,
    energy_check,
    just_before,
    leaves_stick,
    relative_margin,
)
from frictionsim.simulation.single_dof import RecordedSimulation, Samples
from frictionsim.solvers import multi_contact_state as multi
from frictionsim.solvers.contacts import HOLDING, Contact, Friction, MultiContactMechanism, Vector
from frictionsim.solvers.event_driven import EventDrivenSolver
from frictionsim.solvers.mechanism import Trajectory
from frictionsim.solvers.one_contact_state import Y
from frictionsim.solvers.problems import event_names

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario


Modes = tuple[int, ...]


def audit(
    trajectory: "Trajectory",
    mechanism: "MultiContactMechanism",
    energy_limit: float,
    atol: float,
) -> dict[str, Check]:
    """Return the checks by name; all are relative except the drift, in the coordinate's unit.

    Parameters
    ----------
    trajectory : Trajectory
    mechanism : MultiContactMechanism
    energy_limit : float
        Allowed residual of the energy balance.
    atol : float
        Absolute tolerance of the integration.
    """
    checks = {
        "energy_balance": energy_check(trajectory, energy_limit, atol, mechanism.energy_scale)
    }
    frictions = mechanism.frictions
    if frictions:
        violation = max(friction_violation(trajectory, c, i) for i, c in frictions)
        checks["friction_law"] = Check(violation, ROUNDING)
    power = max((driving_power(trajectory, c) for _, c in frictions), default=0.0)
    if frictions or "energy_impact" in trajectory.energy_integrals:
        checks["dissipation_sign"] = Check(max(power, _gain(trajectory)), 0.0)
    if mechanism.contacts:
        drifts = [held_drift(trajectory, c, i) for i, c in enumerate(mechanism.contacts)]
        checks["stick_drift"] = Check(max(drifts), 0.0)
    return checks | mechanism.checks(trajectory)


def friction_violation(trajectory: "Trajectory", contact: "Contact", index: int) -> float:
    """Return the largest violation of a friction law, relative to the largest static limit."""
    forces, mode = trajectory.forces, trajectory.modes[index]
    u = trajectory.drive
    friction, roundoff = contact.force_of(forces, u), contact.roundoff_of(forces, u)
    forward, backward = (contact.limit_of("static", s, forces, u) for s in (1, -1))
    excess = np.maximum(-friction - forward, friction - backward) - roundoff
    kinetic = [contact.limit_of("kinetic", s, forces, u) for s in (1, -1)]
    sliding = np.where(mode == BACKWARD, -kinetic[1], kinetic[0])
    error = np.abs(friction + sliding) - roundoff
    worst = float(np.max(np.where(mode == STICK, excess, error), initial=0.0))
    largest = float(np.max(np.maximum(forward, backward), initial=0.0))
    return worst / largest if largest > 0.0 else worst


def driving_power(trajectory: "Trajectory", contact: "Contact") -> float:
    """Return the largest positive power of a contact, relative to the largest magnitude."""
    velocity = trajectory.velocity[contact.coordinate]
    forces, u = trajectory.forces, trajectory.drive
    power = contact.force_of(forces, u) * velocity
    # A rope is taut down to a tension that is below zero by its roundoff.
    beyond = power - contact.roundoff_of(forces, u) * np.abs(velocity)
    largest = float(np.max(np.abs(power), initial=0.0))
    return max(0.0, float(np.max(beyond, initial=0.0)) / largest) if largest > 0.0 else 0.0


def _gain(trajectory: "Trajectory") -> float:
    """Return the largest energy gained in an impact, relative to the largest energy of impacts."""
    lost = trajectory.energy_integrals.get("energy_impact", np.zeros(0))
    gained = -float(np.min(np.diff(lost), initial=0.0))
    return gained / float(np.max(np.abs(lost))) if gained > 0.0 else 0.0


def held_drift(trajectory: "Trajectory", contact: "Contact", index: int) -> float:
    """Return the largest change of a coordinate between samples at which its contact holds."""
    released = [
        e.time
        for e in trajectory.transitions
        if e.contact == contact.name and e.mode_to not in HOLDING
    ]
    holds = np.isin(trajectory.modes[index], HOLDING)
    position = trajectory.position[contact.coordinate]
    return float(drift(position, holds, np.searchsorted(released, trajectory.time)))


def release_check(
    mechanism: "MultiContactMechanism",
    before: "Trajectory",
    after: "Trajectory",
    end: float,
) -> Check:
    """Return the check of the breakaways.

    Parameters
    ----------
    mechanism : MultiContactMechanism
    before, after : Trajectory
        The samples immediately before and after each transition.
    end : float, s
        Duration of the run, which sets the roundoff of the time.
    """
    events, frictions = after.transitions, {c.name: (i, c) for i, c in mechanism.frictions}
    margin = {
        k: _margin(frictions[e.contact][1], before.drive[k], before.forces[:, k], e.mode_to)
        for k, e in enumerate(events)
        if leaves_stick(e)
    }
    distance = {k: abs(value) for k, value in margin.items()}
    for k in margin:
        event, early = events[k], just_before(events[k].time, end)
        if distance[k] <= RELEASE_DISTANCE and event.time > 0.0:
            continue
        index, contact = frictions[event.contact]
        others = [
            i
            for i, other in enumerate(events)
            if other.contact != event.contact and early <= other.time <= 2.0 * event.time - early
        ]
        _, q, v, modes = _state(before, k)
        sides = [
            _margin(contact, u, _balance(mechanism, u, q, v, modes)[1], event.mode_to)
            for u in (mechanism.drive(early), mechanism.drive(event.time))
        ]
        jumps = sides[0] >= 0.0 >= sides[1]
        if event.time == 0.0 or others or jumps or _another_turns(mechanism, q, v, modes):
            # Those that cannot hold: slack now, or at their limits just before.
            gone = {
                events[i].contact
                for i in others
                if events[i].mode_to == SLACK
                or (event.time > 0.0 and abs(margin.get(i, inf)) <= RELEASE_DISTANCE)
            }
            distance[k] = _margin_if_held(mechanism, _state(after, k), index, gone)
    return Check(max(distance.values(), default=0.0), RELEASE_DISTANCE)


def _margin(contact: "Contact", u: float, forces: Vector, direction: int) -> float:
    """Return the margin of a contact to its static limit in a direction, relative to the limit."""
    limit = contact.limit_of("static", direction, forces, u)
    force = -direction * contact.force_of(forces, u)
    return float(relative_margin(limit, force, contact.roundoff_of(forces, u)))


def _balance(
    mechanism: "MultiContactMechanism", u: float, q: list[float], v: list[float], modes: Modes
) -> tuple[list[float], list[float]]:
    """Return accelerations and forces in given modes."""
    s, n = array("d", bytes(8 * multi.LENGTH)), len(q)
    s[Y : Y + 2 * n] = array("d", [*q, *v])
    s[multi.MODES : multi.MODES + len(modes)] = array("d", modes)
    multi.balance(mechanism.system, s, u, Y)
    forces = s[multi.FORCES : multi.TERMS + mechanism.system.contacts.terms]
    return s[multi.ACCELERATION : multi.ACCELERATION + n].tolist(), forces.tolist()


MultiContactState = tuple[float, list[float], list[float], Modes]
"""The drive, positions, velocities and modes of a sample."""


def _state(at: "Trajectory", sample: int) -> MultiContactState:
    modes = tuple(int(mode) for mode in at.modes[:, sample])
    position, velocity = (x[:, sample].tolist() for x in (at.position, at.velocity))
    return float(at.drive[sample]), position, velocity, modes


def _another_turns(
    mechanism: "MultiContactMechanism", q: list[float], v: list[float], modes: Modes
) -> bool:
    """Return whether a contact gives way that may hold: its slip passes zero, without an event."""
    return any(
        mode not in HOLDING and len(_modes_of(c, q[c.coordinate], v[c.coordinate])) > 1
        for c, mode in zip(mechanism.contacts, modes, strict=True)
    )


def _margin_if_held(
    mechanism: "MultiContactMechanism", after: MultiContactState, index: int, gone: set[str]
) -> float:
    """Return the margin of a contact in a combination in which it and more contacts hold; else 0.

    Whatever the solver does, all combinations are tried here, in the state after the event.
    """
    u, q, v, modes = after
    options = [
        (mode,)
        if contact.name in gone
        else _modes_of(contact, q[contact.coordinate], v[contact.coordinate])
        for contact, mode in zip(mechanism.contacts, modes, strict=True)
    ]
    options[index] = tuple(mode for mode in options[index] if mode in HOLDING)
    margins = [
        _smallest_margin(mechanism, (u, q, v, combination), gone)
        for combination in product(*options)
        if np.isin(combination, HOLDING).sum() > np.isin(modes, HOLDING).sum()
    ]
    return max([0.0, *margins])


def _modes_of(contact: "Contact", q: float, v: float) -> Modes:
    """Return the modes that a contact may have at a slip or gap q with its rate v."""
    if isinstance(contact.law, Friction):
        return (STICK, FORWARD, BACKWARD) if v == 0.0 else (FORWARD if v > 0.0 else BACKWARD,)
    return (SLACK,) if q > 0.0 or v > 0.0 else (TAUT, SLACK)


def _smallest_margin(
    mechanism: "MultiContactMechanism", state: MultiContactState, gone: set[str]
) -> float:
    """Return the smallest margin of the contacts that stick in a combination of modes.

    Not above zero where a rope pushes, or a contact at rest does not move as its mode says.
    """
    u, q, v, modes = state
    acceleration, forces = _balance(mechanism, u, q, v, modes)
    margins = []
    for contact, mode in zip(mechanism.contacts, modes, strict=True):
        c = contact.coordinate
        if mode == STICK and isinstance(contact.law, Friction):
            margins += [_margin(contact, u, forces, s) for s in (FORWARD, BACKWARD)]
        elif mode == TAUT:
            margins += (
                [0.0] if contact.force_of(forces, u) < -contact.roundoff_of(forces, u) else []
            )
        elif v[c] == 0.0 and not (mode == SLACK and q[c] > 0.0) and contact.name not in gone:
            way = FORWARD if mode == SLACK else mode
            margins += [] if way * acceleration[c] > 0.0 else [0.0]
    return min(margins)


def last_rest(trajectory: "Trajectory", contacts: Sequence[str]) -> float | None:
    """Return when all contacts last came to hold, s; None if they never did in the samples.

    Parameters
    ----------
    contacts : sequence of str
        Their names, in the order of the modes.
    """
    if not trajectory.time.size:
        return None
    modes = dict(zip(contacts, trajectory.modes[:, -1].tolist(), strict=True))
    for e in reversed(trajectory.transitions):
        if e.time > trajectory.time[-1]:
            continue
        if all(mode in HOLDING for mode in modes.values()):
            return e.time
        modes[e.contact] = e.mode_from
    return None


class MultiContactSimulation(RecordedSimulation):
    """The `Simulation` of a mechanism of several coordinates and contacts.

    Parameters
    ----------
    scenario : Scenario
    mechanism : MultiContactMechanism
        Built from the scenario.
    """

    def __init__(self, scenario: "Scenario", mechanism: MultiContactMechanism) -> None:
        first = 3 * len(mechanism.position) + mechanism.system.contacts.terms
        last = first + len(mechanism.contacts)
        super().__init__(
            scenario,
            mechanism,
            lambda recording: EventDrivenSolver(mechanism, scenario.solver, recording),
            last + len(mechanism.energy_integrals),
        )
        self.mode_columns = slice(first, last)

    @property
    def _contact_names(self) -> tuple[str, ...]:
        return tuple(contact.name for _, contact in self._mechanism.frictions[:1])

    def _quantities(self, trajectory: Trajectory, energies: dict[str, Any]) -> Quantities:
        quantities = super()._quantities(trajectory, energies)
        if "last_rest_time" in quantities:
            rest = last_rest(trajectory, event_names(self._mechanism))
            quantities["last_rest_time"] = Quantity(rest, "s")
        return quantities

    def _trajectory_of(self, rows: Any, transitions: list[Transition]) -> Trajectory:
        mechanism, n = self._mechanism, len(self._mechanism.position)
        columns = rows.T.copy()
        position, velocity, acceleration = columns[2 : 2 + 3 * n].reshape(3, n, -1)
        stored = mechanism.system.stored_energies(position, velocity)
        return Trajectory(
            time=columns[0],
            drive=columns[1],
            position=position,
            velocity=velocity,
            acceleration=acceleration,
            forces=columns[2 + 3 * n : self.mode_columns.start],
            modes=columns[self.mode_columns],
            energy_integrals=dict(
                zip(mechanism.energy_integrals, columns[self.mode_columns.stop :], strict=True)
            ),
            stored_energies=dict(zip(mechanism.stored_energies, stored, strict=True)),
            transitions=transitions,
        )

    def _channels(self, trajectory: Trajectory) -> dict[str, Any]:
        channels: dict[str, Any] = self._mechanism.channels(trajectory)
        return channels

    def _checks(self, trajectory: Trajectory, samples: Samples) -> dict[str, Check]:
        mechanism, settings = self._mechanism, self._settings
        allowed = allowed_residual(settings.rtol, self.statistics()[0])
        checks = audit(trajectory, mechanism, allowed, settings.atol)
        if mechanism.frictions:
            before, after = (
                self._trajectory_of(rows, samples.transitions)
                for rows in (samples.before, samples.after)
            )
            checks["release"] = release_check(mechanism, before, after, settings.duration)
        return checks

    def _warnings(self, trajectory: Trajectory) -> list[str]:
        warnings = [] if np.any(trajectory.velocity) else ["nothing moves: all contacts hold"]
        return warnings + list(self._mechanism.run_warnings(trajectory))
