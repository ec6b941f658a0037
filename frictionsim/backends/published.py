"""Eq 30 of the paper as it is printed, with its switch of abs and sign [1]_.

    I dw/dt = (-sign(w) r_k R + M) sign(|sign(|x| - x)| + |sign(w)|),   x = r_s - |M|/R

It is here to show what it does; use `events` for results. At rest and beyond the static limit
sign(0) = 0 takes all friction away for that evaluation. After the first motion a numerical step
never hits w = 0 again, so that the static limit is out of use: where r_k R < |M| <= r_s R
the body should stop and stay, and runs back instead; where |M| < r_k R it chatters about rest.

References
----------
.. [1] "Analysis of friction systems on shafts", Int. J. Applied Engineering Research 13(11),
   2018, 8871-8881, eq 30.
"""

from typing import TYPE_CHECKING

from frictionsim.backends.base import (
    Poll,
    Recording,
    StormGuard,
    advance,
    end_of_piece,
    new_stepper,
    rates_with_friction,
    run_without_friction,
)
from frictionsim.series import Transition

if TYPE_CHECKING:
    from frictionsim.mechanisms.base import Contact, Mechanism
    from frictionsim.parameters import Solver

# A hundred changes of direction within this share of the run are no motion, but chatter.
STORM = 1e-4
# Nor are a thousand steps within this share: stages of both signs then cancel in each of them,
# and the velocity creeps without changing its own.
CRAWL = 1e-6

ADVICE = (
    "eq 30 chatters where it should stick; backend 'events' or 'rkf45' sticks, and a fixed"
    " solver.step shows the chatter"
)


def sign(x: float) -> int:
    """Return -1, 0 or +1, as the paper's sign() has it."""
    return (x > 0.0) - (x < 0.0)


def switch(moment: float, static_limit: float, velocity: float) -> int:
    """Return the factor of eq 30, 0 or 1; R x = r_s R - |M| has the sign of x and no division."""
    x = static_limit - abs(moment)
    return sign(abs(sign(abs(x) - x)) + abs(sign(velocity)))


def solve(mechanism: "Mechanism", settings: "Solver", recording: Recording, poll: Poll) -> None:
    """Step eq 30 to settings.duration, adaptively or with steps of settings.step.

    Raises
    ------
    SolverError
        From the integrator, or where the adaptive steps chatter about rest without end.
    """
    if mechanism.contact is None:
        run_without_friction(mechanism, settings, recording, poll)
        return
    _solve_eq_30(mechanism, mechanism.contact, settings, recording, poll)


def _solve_eq_30(
    mechanism: "Mechanism",
    contact: "Contact",
    settings: "Solver",
    recording: Recording,
    poll: Poll,
) -> None:
    drive, times, end = mechanism.drive, recording.times, settings.duration
    changed = f"the contact '{contact.name}' changed its mode"
    storm = StormGuard(STORM * settings.duration, 100, changed, ADVICE)
    crept = f"the contact '{contact.name}' let the solver creep on"
    crawl = StormGuard(CRAWL * settings.duration, 1000, crept, ADVICE)
    stepper = new_stepper(mechanism, settings)

    def friction(u: float, q: float, v: float, moment: float) -> float:
        if switch(moment, contact.static_limit(u, q), v) == 0:
            return -moment
        s = sign(v)
        return -s * contact.kinetic_limit(u, q, v, s)

    stepper.begin(rates_with_friction(mechanism, friction), 0.0, mechanism.initial_state)
    mode, limit = sign(mechanism.velocity), 0.0
    try:
        while True:
            while times.next <= stepper.t:
                t = times.next
                poll(t)
                y = stepper.state_at(t)
                u, q, v = drive(t), y[0], y[1]
                moment = mechanism.moment(u, q, v)
                torque = friction(u, q, v, moment)
                acceleration = (moment + torque) / mechanism.inertia
                recording.add(t, u, y, acceleration, torque, sign(v))
            if stepper.t >= end:
                return
            poll(stepper.t)
            if stepper.t >= limit:
                limit = end_of_piece(mechanism, contact, stepper.t, end)
            recording.note(advance(stepper, mechanism, limit), stepper)
            direction = sign(stepper.y[1])
            if direction != mode:
                recording.transitions.append(
                    Transition(stepper.t, contact.name, mode, direction, stepper.y[0])
                )
                mode = direction
                if settings.step is None:
                    storm.note(stepper.t)
            if settings.step is None:
                crawl.note(stepper.t)
    finally:
        recording.count(stepper)
