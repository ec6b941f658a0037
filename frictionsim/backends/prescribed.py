"""A mechanism whose velocity is given: what torque does it take?

Every backend hands such a scene over to this one: there is no breakaway to find, and the only
unknowns are the position and the energies. The drive torque u follows from the equation,

    u = inertia dv/dt - moment(0, q, v) - T,   T = -s kinetic_limit,

where the moment of a mechanism with a prescribed velocity has u as a summand. At rest the friction
can be anything up to its static limit; it is taken as zero.
"""

from math import inf, nextafter
from typing import TYPE_CHECKING

from frictionsim.backends.base import Poll, Recording, advance, new_stepper
from frictionsim.integrator import Rates, State
from frictionsim.roots import sign_change
from frictionsim.series import BACKWARD, FORWARD, STICK, Transition

if TYPE_CHECKING:
    from frictionsim.mechanisms.base import Mechanism
    from frictionsim.parameters import Solver


def solve(mechanism: "Mechanism", settings: "Solver", recording: Recording, poll: Poll) -> None:
    """Follow the prescribed velocity to settings.duration.

    Raises
    ------
    SolverError
        From the integrator.
    """
    stepper = new_stepper(mechanism, settings)
    times, end = recording.times, settings.duration
    t, mode = 0.0, None
    y: State = mechanism.initial_state
    try:
        while t < end:
            limit = _end_of_piece(mechanism, t, end)
            direction = _sign(mechanism.drive(0.5 * (t + limit)))
            if mode is not None and direction != mode:
                name = mechanism.contact.name if mechanism.contact else "drive"
                recording.transitions.append(Transition(t, name, mode, direction, y[0]))
            mode = direction
            torques = _Torques(mechanism, mode, limit)
            stepper.begin(torques.rates(), t, y)
            while stepper.t < limit:
                recording.note(advance(stepper, mechanism, limit), stepper)
                poll(stepper.t)
                while times.next < stepper.t or times.next <= stepper.t == end:
                    at = times.next
                    poll(at)
                    state = stepper.state_at(at)
                    u, velocity, friction, acceleration = torques.at(at, state[0])
                    state[1] = velocity
                    recording.add(at, u, state, acceleration, friction, mode)
            t, y = stepper.t, stepper.y
    finally:
        recording.count(stepper)


class _Torques:
    """Velocity, friction and drive torque on a piece along which the direction is one."""

    def __init__(self, mechanism: "Mechanism", direction: int, limit: float) -> None:
        self._mechanism, self._direction = mechanism, direction
        # The slope at the end of the piece is that of before it, not of after it.
        self._last = nextafter(limit, -inf)

    def at(self, t: float, q: float) -> tuple[float, float, float, float]:
        """Return drive torque, velocity, friction torque and acceleration."""
        mechanism, s = self._mechanism, self._direction
        v, a = mechanism.drive(t), mechanism.drive.slope(min(t, self._last))
        friction = 0.0
        if mechanism.contact is not None and s != STICK:
            friction = -s * mechanism.contact.kinetic_limit(0.0, q, v, s)
        u = mechanism.inertia * a - mechanism.moment(0.0, q, v) - friction
        return u, v, friction, a

    def rates(self) -> Rates:
        powers = tuple(enumerate(self._mechanism.powers.values(), start=2))
        heat = 2 + len(powers) if self._mechanism.contact is not None else 0

        def rates(t: float, y: State, dy: State) -> None:
            u, v, friction, a = self.at(t, y[0])
            dy[0], dy[1] = v, a
            for i, power in powers:
                dy[i] = power(u, y[0], v)
            if heat:
                dy[heat] = -friction * v

        return rates


def _end_of_piece(mechanism: "Mechanism", t: float, end: float) -> float:
    """Return a time up to which the velocity is smooth and of one sign."""
    drive = mechanism.drive
    b = min(end, drive.next_turn(t))
    if drive(t) * drive(b) < 0.0:
        direction = drive(b)
        _, b = sign_change(lambda x: direction * drive(x), t, b)
    return b


def _sign(v: float) -> int:
    return FORWARD if v > 0.0 else BACKWARD if v < 0.0 else STICK
