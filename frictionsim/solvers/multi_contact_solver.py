"""Event-driven integration of several coordinates and contacts.

Between two events all contacts keep their modes and the equations are smooth. A mode ends where a
force reaches its limit, a sliding contact comes to rest, or a slack rope becomes taut, which is an
impact. The combination of modes that follows is the one that is consistent; if several are, the
one in which most contacts hold.
"""

from collections.abc import Mapping
from math import copysign, inf
from typing import TYPE_CHECKING, ClassVar

from frictionsim.results import BACKWARD, FORWARD, SLACK, STICK, TAUT, Transition
from frictionsim.solvers.base import SteppingSolver
from frictionsim.solvers.common import ChatteringDetector, Row, SampleBuffer
from frictionsim.solvers.multi_contact import (
    HOLDING,
    Balance,
    FrictionContact,
    Modes,
    MultiContactMechanism,
    UnilateralContact,
)
from frictionsim.solvers.multi_contact_events import PLACES, Event, first_events
from frictionsim.solvers.multi_contact_modes import (
    RELEASED,
    Margin,
    Released,
    consistent_modes,
    margins_of,
)
from frictionsim.solvers.one_contact_state import CHATTERING_EVENTS, CHATTERING_WINDOW, NEVER
from frictionsim.solvers.runge_kutta_fehlberg import RungeKuttaFehlberg45
from frictionsim.solvers.state_values import DIRECTION, NUMBER, TIME, Values
from frictionsim.solvers.stepper import Rhs, State

if TYPE_CHECKING:
    from frictionsim.scenario.settings import SolverSettings

MODE = Values(low=BACKWARD, high=SLACK, whole=True)


class MultiContactSolver(SteppingSolver):
    """Event-driven solver of a `MultiContactMechanism`.

    While all contacts hold and there is no other motion, a step is a segment on which the drive is
    monotone, and `y` is the state. Otherwise the integrator takes a step and holds the state.

    Attributes
    ----------
    modes : list of int, (m,)
    ends : list of int, (m,)
        The direction in which each contact is released at the end of the last step; else 0.
    held : float, s
        Last time at which these contacts kept their modes.
    """

    stepper: RungeKuttaFehlberg45
    CHECKPOINT_FIELDS: ClassVar[Mapping[str, Values]] = {
        **SteppingSolver.CHECKPOINT_FIELDS,
        "y": NUMBER,
        "modes": MODE,
        "ends": DIRECTION,
        "sampled_until": TIME,
        "held": TIME._replace(low=NEVER),
        "segment_end": TIME,
    }

    def __init__(
        self, mechanism: MultiContactMechanism, settings: "SolverSettings", buffer: SampleBuffer
    ) -> None:
        stepper = RungeKuttaFehlberg45(
            states=len(mechanism.initial_state),
            rtol=settings.rtol,
            atol=settings.atol,
            max_step=settings.max_step or inf,
            max_steps=settings.max_steps,
            what=mechanism.subject,
            advice=settings.budget_advice,
        )
        super().__init__(stepper, settings, buffer, mechanism.subject)
        self.mechanism = mechanism
        self.chattering = ChatteringDetector(
            CHATTERING_WINDOW * min(1.0, settings.duration),
            CHATTERING_EVENTS,
            "the contacts changed their modes",
            "check whether the drive changes too fast",
        )
        self.y: State = mechanism.initial_state
        self.modes = [
            self._mode_at_start(contact.coordinate, i)
            for i, contact in enumerate(mechanism.contacts)
        ]
        self.ends = [0 for _ in mechanism.contacts]
        self.sampled_until = 0.0  # end, exclusive, of the samples in the last step
        self.held = NEVER
        self.segment_end = 0.0  # of the segment in which the drive is smooth
        self._margins: dict[Modes, list[Margin]] = {}

    def _mode_at_start(self, coordinate: int, contact: int) -> int:
        """Return the mode at the start, before forces are compared with their limits."""
        if isinstance(self.mechanism.contacts[contact], UnilateralContact):
            return TAUT
        rate = self.mechanism.velocity[coordinate]
        return STICK if rate == 0.0 else int(copysign(1, rate))

    @property
    def checkpoint_parts(self) -> dict[str, object]:
        return {**super().checkpoint_parts, "chattering": self.chattering}

    @property
    def resting(self) -> bool:
        """Whether contacts hold all coordinates."""
        contacts = self.mechanism.contacts
        held = {c.coordinate for c, m in zip(contacts, self.modes, strict=True) if m in HOLDING}
        return len(held) == len(self.mechanism.position)

    def restored_fault(self) -> str:
        """Return the field that does not go with the others, empty if all do."""
        self.modes, self.ends = [int(m) for m in self.modes], [int(e) for e in self.ends]
        for contact, mode in zip(self.mechanism.contacts, self.modes, strict=True):
            friction = isinstance(contact, FrictionContact)
            if mode not in ((STICK, FORWARD, BACKWARD) if friction else (TAUT, SLACK)):
                return "modes"
        return ""

    def start(self) -> None:
        self.switch_modes(Released({}, {}), self.y)

    def resume(self) -> None:
        if not self.resting:
            self.stepper.resume(self.rhs(tuple(self.modes)))

    def covers(self, t: float) -> bool:
        return t < self.sampled_until

    def step(self) -> None:
        """Stay at rest, or move, up to the first event or the end of the step."""
        drive, resting = self.mechanism.drive, self.resting
        if resting:
            a, b = self.t, min(self.end, drive.next_extremum(self.t))
            events = self.events_at_rest(a, b)
        else:
            stepper = self.stepper
            if stepper.t >= self.segment_end:
                self.segment_end = min(self.end, drive.next_extremum(stepper.t))
            stepper.advance(self.segment_end)
            b, events = stepper.t, self.events_within_step()
        self.sampled_until = b
        for event in events:
            self.sampled_until, self.held = event.time, event.held
            self.ends[event.margin.contact] = event.margin.direction

    def margins(self) -> list[Margin]:
        """Return the margins of all contacts."""
        modes = tuple(self.modes)
        if modes not in self._margins:
            self._margins[modes] = margins_of(self.mechanism, modes)
        return self._margins[modes]

    def events_at_rest(self, a: float, b: float) -> list[Event]:
        """Return the events within a segment: margins are monotone."""

        def at(t: float) -> tuple[float, Balance, State, State]:
            return self.at_state(t, self.y)

        return first_events(self.margins(), at, [(a, False), (b, False)], at, self.end)

    def events_within_step(self) -> list[Event]:
        """Return the first events within the last step of the integrator."""
        stepper = self.stepper
        t_old, h = stepper.t_old, stepper.t - stepper.t_old

        def at(t: float) -> tuple[float, Balance, State, State]:
            y = stepper.y_old if t <= t_old else stepper.interpolate(t)
            return self.at_state(t, list(y))

        def rough(t: float) -> tuple[float, Balance, State, State]:
            return self.at_state(t, cubic(stepper, (t - t_old) / h))

        places = [
            (stepper.t if place == 1.0 else t_old + place * h, 0.0 < place < 1.0)
            for place in PLACES
        ]
        return first_events(self.margins(), at, places, rough, self.end)

    def at_state(self, t: float, y: State) -> tuple[float, Balance, State, State]:
        """Return drive, balance, positions and velocities at a time and state."""
        n, u = len(self.mechanism.position), self.mechanism.drive(t)
        q, v = y[:n], y[n : 2 * n]
        return u, self.mechanism.balance(u, q, v, tuple(self.modes)), q, v

    def process_step(self) -> None:
        self.t = self.sampled_until
        if not any(self.ends):
            return
        before = self.y if self.resting else list(self.stepper.interpolate(self.t))
        after, n = list(before), len(self.mechanism.position)
        released = Released({}, {})
        for i, (contact, mode) in enumerate(zip(self.mechanism.contacts, self.modes, strict=True)):
            if not self.ends[i]:
                if mode not in HOLDING and self.just_released(contact.coordinate, before):
                    released.before[i] = RELEASED if mode == SLACK else mode
            elif mode in HOLDING:
                released.now[i] = self.ends[i]
            elif mode == SLACK:
                before[contact.coordinate] = after[contact.coordinate] = 0.0
                self.take_up(i, after)
            else:
                before[n + contact.coordinate] = after[n + contact.coordinate] = 0.0
        self.y = after
        self.switch_modes(released, before)

    def just_released(self, coordinate: int, y: State) -> bool:
        """Return whether a contact that gives way was released at this very time."""
        return y[len(self.mechanism.position) + coordinate] == 0.0

    def take_up(self, index: int, y: State) -> None:
        """Change the state by the impact of a slack rope that becomes taut."""
        contact = self.mechanism.contacts[index]
        assert isinstance(contact, UnilateralContact)
        n, c = len(self.mechanism.position), contact.coordinate
        slow = -y[n + c] < contact.capture_speed
        restitution = 0.0 if slow else contact.restitution
        modes = tuple(self.modes)
        y[n : 2 * n], losses = self.mechanism.impact(index, y[n : 2 * n], modes, restitution)
        for i, name in enumerate(self.mechanism.energy_integrals, start=2 * n):
            y[i] += losses.get(name, 0.0)

    def switch_modes(self, released: Released, before: State) -> None:
        """Switch to the consistent modes, record what changes, and start the integrator."""
        self.chattering.count(self.t)
        n = len(self.mechanism.position)
        q, v = self.y[:n], self.y[n : 2 * n]
        modes = consistent_modes(self.mechanism, self.t, q, v, released)
        changed = [
            i
            for i, (old, new) in enumerate(zip(self.modes, modes, strict=True))
            if old != new or (old == SLACK and self.ends[i])
        ]
        side = None
        if changed and self.t > 0.0:
            held = min(self.held, self.t) if released.now else self.t
            side = (self.t, *self.row(held, before)[1:])
        old, self.modes = self.modes, list(modes)
        self.ends = [0 for _ in modes]
        for i in changed:
            after = self.row(self.t, self.y)
            name = self.mechanism.contacts[i].name
            transition = Transition(self.t, name, old[i], modes[i], self.y[0])
            self.buffer.record_event(transition, side or after, after)
        if not self.resting:
            self.stepper.start(self.rhs(modes), self.t, self.y)
            self.segment_end = self.t

    def finish(self) -> None:
        if self.buffer.times.next <= self.end:
            self.sample(self.end)

    def sample(self, t: float) -> None:
        self.buffer.add(self.row(t, self.y if self.resting else self.stepper.interpolate(t)))

    def row(self, t: float, y: State) -> Row:
        """Return the sample: time, drive, q, v, accelerations, forces, modes, energy integrals."""
        n = len(self.mechanism.position)
        u, balance, _, _ = self.at_state(t, y)
        motion = (*y[: 2 * n], *balance.acceleration)
        return (t, u, *motion, *balance.forces, *self.modes, *y[2 * n :])

    def rhs(self, modes: Modes) -> Rhs:
        """Return the right-hand side while the contacts keep their modes."""
        mechanism, n = self.mechanism, len(self.mechanism.position)
        drive, balance = mechanism.drive, mechanism.balance
        flows = tuple(enumerate(mechanism.power_flows.values(), start=2 * n))
        heat = 2 * n + len(flows)
        frictions = tuple((c.coordinate, c.force) for _, c in mechanism.frictions)
        impact = heat + len(frictions) < len(mechanism.initial_state)

        def rhs(t: float, y: State, dy: State) -> None:
            u, q, v = drive(t), y[:n], y[n : 2 * n]
            acceleration, forces = balance(u, q, v, modes)
            dy[:n] = v
            dy[n : 2 * n] = acceleration
            for i, power in flows:
                dy[i] = power(u, q, v)
            for i, (coordinate, force) in enumerate(frictions, start=heat):
                dy[i] = -force(forces) * v[coordinate]
            if impact:
                dy[-1] = 0.0

        return rhs


def cubic(stepper: RungeKuttaFehlberg45, x: float) -> State:
    """Return the state at a part x of the last step, by the cubic polynomial through its ends."""
    h = stepper.t - stepper.t_old
    found = []
    for y0, y1, f0, f1 in zip(stepper.y_old, stepper.y, stepper.f_old, stepper.f, strict=True):
        rise, end_rise = h * f0, h * f1
        rest = 3.0 * (y1 - y0) - 2.0 * rise - end_rise
        last = rise + end_rise - 2.0 * (y1 - y0)
        found.append(y0 + x * (rise + x * (rest + x * last)))
    return found


SOLVER = MultiContactSolver
