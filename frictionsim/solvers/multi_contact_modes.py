"""The modes of contacts that are consistent with a state, and what ends each mode."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product
from typing import NamedTuple

from frictionsim.errors import SolverError
from frictionsim.results import BACKWARD, FORWARD, SLACK, STICK, TAUT
from frictionsim.solvers.multi_contact import (
    HOLDING,
    Balance,
    FrictionContact,
    Modes,
    MultiContactMechanism,
)

RELEASED = 1  # direction in which a rope is released


class Margin(NamedTuple):
    """A quantity that must stay positive, or not negative, for a contact to keep its mode.

    Attributes
    ----------
    contact : int
        Its index.
    direction : int
        In which the contact is released; of a mode that ends by its motion, 1.
    of_force : bool
        A force holds the contact: the margin may be zero. Otherwise it is the velocity or the gap,
        whose zero ends the mode.
    value : callable
        value(balance, q, v).
    roundoff : callable
        roundoff(u, balance): smaller differences of forces count as equal.
    """

    contact: int
    direction: int
    of_force: bool
    value: Callable[[Balance, Sequence[float], Sequence[float]], float]
    roundoff: Callable[[float, Balance], float]


def margins_of(mechanism: MultiContactMechanism, modes: Modes) -> list[Margin]:
    """Return the margins of all contacts in given modes."""
    return [
        margin for index, mode in enumerate(modes) for margin in _margins(mechanism, index, mode)
    ]


def _margins(mechanism: MultiContactMechanism, index: int, mode: int) -> Iterator[Margin]:
    contact = mechanism.contacts[index]
    coordinate, force = contact.coordinate, contact.force

    def roundoff(u: float, balance: Balance) -> float:
        return float(contact.roundoff(u, balance.forces))

    if mode == TAUT:
        yield Margin(index, RELEASED, True, lambda b, q, v: force(b.forces), roundoff)
    elif mode == SLACK:
        yield Margin(index, RELEASED, False, lambda b, q, v: q[coordinate], roundoff)
    elif mode == STICK:
        assert isinstance(contact, FrictionContact)
        limit = contact.static_limit
        yield Margin(
            index, FORWARD, True, lambda b, q, v: limit(b.forces, 1) + force(b.forces), roundoff
        )
        yield Margin(
            index, BACKWARD, True, lambda b, q, v: limit(b.forces, -1) - force(b.forces), roundoff
        )
    elif mode == FORWARD:
        yield Margin(index, RELEASED, False, lambda b, q, v: v[coordinate], roundoff)
    else:
        yield Margin(index, RELEASED, False, lambda b, q, v: -v[coordinate], roundoff)


class Released(NamedTuple):
    """The contacts that give way at an event, each with the direction of its release.

    Attributes
    ----------
    now : mapping of int to int
        Those whose force was located at its limit. If it is that of several, some may hold.
    before : mapping of int to int
        Those of an event before at the same time, which have not moved yet. They do not hold again.
    """

    now: dict[int, int]
    before: dict[int, int]


def consistent_modes(
    mechanism: MultiContactMechanism,
    t: float,
    q: Sequence[float],
    v: Sequence[float],
    released: Released,
) -> Modes:
    """Return the modes that are consistent with a state; most contacts hold in them.

    Where several combinations are solutions, quasi-static stick is kept: all combinations with one
    more contact that holds are tried, also those in which the acceleration of a contact at its
    limit is roundoff, before any with one fewer.

    Parameters
    ----------
    mechanism : MultiContactMechanism
    t : float, s
    q, v : (n,)
        Zeros of velocities and gaps are exact.
    released : Released
    """
    u, (now, before) = mechanism.drive(t), released
    located = {**before, **now}
    possible = [_possible(mechanism, i, q, v) for i in range(len(mechanism.contacts))]
    by_holding = sorted(product(*possible), key=lambda modes: -_holding(modes))
    some = [modes for modes in by_holding if not now or _give_way(modes, now, any)]
    # The acceleration of what was located at its limit may be roundoff, of the wrong sign.
    attempts = [
        (forgiven, [m for m in some if _holding(m) == holding and _give_way(m, forgiven, all)])
        for holding in range(len(mechanism.contacts), -1, -1)
        for forgiven in (before, located)
    ]
    for forgiven, combinations in (*attempts, ({}, by_holding)):
        for modes in combinations:
            if _is_consistent(mechanism, u, q, v, modes, forgiven):
                return modes
    raise SolverError(
        f"at t = {t:.9g} s no combination of sticking, sliding and slack satisfies the equations of"
        f" {mechanism.subject}: the friction is too large for them; check the coefficients of"
        " friction and the radius of the shaft"
    )


def _holding(modes: Modes) -> int:
    """Return how many contacts hold."""
    return sum(mode in HOLDING for mode in modes)


def _give_way(
    modes: Modes, released: Mapping[int, int], which: Callable[[Iterator[bool]], bool]
) -> bool:
    """Return whether any or all of the contacts that are released give way, in their directions."""
    return which(_direction(modes[i]) == direction for i, direction in released.items())


def _direction(mode: int) -> int:
    """Return the direction in which a contact gives way in a mode; 0 if it holds."""
    return {SLACK: RELEASED, TAUT: STICK}.get(mode, mode)


def _possible(
    mechanism: MultiContactMechanism, index: int, q: Sequence[float], v: Sequence[float]
) -> Modes:
    """Return the modes of a contact that its slip or gap allows, the one that holds first."""
    contact = mechanism.contacts[index]
    rate = v[contact.coordinate]
    if isinstance(contact, FrictionContact):
        if rate != 0.0:
            return (FORWARD if rate > 0.0 else BACKWARD,)
        return STICK, FORWARD, BACKWARD
    return (SLACK,) if q[contact.coordinate] > 0.0 or rate > 0.0 else (TAUT, SLACK)


def _is_consistent(
    mechanism: MultiContactMechanism,
    u: float,
    q: Sequence[float],
    v: Sequence[float],
    modes: Modes,
    forgiven: Mapping[int, int],
) -> bool:
    """Return whether forces are within their limits, and contacts that give way move that way.

    Those that are forgiven give way in their direction whatever their acceleration is.
    """
    balance = mechanism.balance(u, q, v, modes)
    if any(
        margin.of_force and margin.value(balance, q, v) < -margin.roundoff(u, balance)
        for margin in margins_of(mechanism, modes)
    ):
        return False
    for index, (contact, mode) in enumerate(zip(mechanism.contacts, modes, strict=True)):
        c = contact.coordinate
        if mode in HOLDING or v[c] != 0.0 or (mode == SLACK and q[c] > 0.0):
            continue
        direction = _direction(mode)
        if index not in forgiven and not direction * balance.acceleration[c] > 0.0:
            return False
    return True
