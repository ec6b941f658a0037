"""The registry of friction laws and integration methods, and of the pairs that are supported.

A scenario names the law in its friction effect (`effects.<friction>.law`) and the method as
`solver.backend`. A kind of mechanism has one of the tables of pairs below (`Scenario.PAIRS`).
"""

from collections.abc import Mapping
from typing import NamedTuple

SET_VALUED, REGULARISED, PUBLISHED, CREEP = "set-valued", "regularised", "published", "creep"

LAWS = {
    SET_VALUED: "exact sticking; the kinetic limit while sliding",
    REGULARISED: "smoothed over transition_speed; creeps instead of sticking",
    PUBLISHED: "eq 30 of the paper on shafts, with its switch of abs and sign",
    CREEP: "the creep law of a belt of Kubas 2014",
}


class Method(NamedTuple):
    """Properties of an integration method."""

    scipy_class: str = ""  # in scipy.integrate; empty for our own integrators
    implicit: bool = False  # so that stiffness does not limit its steps
    fixed_steps: bool = False  # of one length, which no tolerance chooses
    locates_events: bool = False  # within steps, to the roundoff of the time

    @property
    def resumable(self) -> bool:
        """Whether a run can be resumed; the state of SciPy's integrators is private."""
        return not self.scipy_class

    @property
    def counts_rejected(self) -> bool:
        """Whether rejected steps are counted; SciPy's implicit methods do not report them."""
        return not self.implicit


METHODS = {
    "events": Method(locates_events=True),
    "rkf45": Method(),
    "moreau": Method(fixed_steps=True),
    "bdf": Method("BDF", implicit=True),
    "radau": Method("Radau", implicit=True),
    "lsoda": Method("LSODA", implicit=True),
    "rk45": Method("RK45"),
    "dop853": Method("DOP853"),
}
SCIPY = tuple(name for name, method in METHODS.items() if method.scipy_class)


class Pair(NamedTuple):
    """The implementation of a friction law with an integration method."""

    fixed_step: bool = False  # it accepts a fixed step size, `solver.step`


Pairs = Mapping[tuple[str, str], Pair]
"""Pairs by (law, method), in the order of recommendation."""

SINGLE_DOF: Pairs = {
    (SET_VALUED, "events"): Pair(),
    (SET_VALUED, "rkf45"): Pair(),
    (PUBLISHED, "rkf45"): Pair(fixed_step=True),
    # Near rest a smoothed law is stiff, the more the lower its transition speed: it limits the
    # steps of explicit methods whatever their tolerances.
    **{(REGULARISED, name): Pair() for name in (*SCIPY, "rkf45")},
}

# Of several contacts: their changes of mode are located events.
EVENTS_ONLY: Pairs = {(SET_VALUED, "events"): Pair()}

BELT: Pairs = {
    (SET_VALUED, "rkf45"): Pair(),
    (SET_VALUED, "moreau"): Pair(fixed_step=True),
    (REGULARISED, "rkf45"): Pair(),
    (CREEP, "rkf45"): Pair(),
}


def methods_of(pairs: Pairs, law: str = "") -> tuple[str, ...]:
    """Return the methods that support a law; all methods without friction (law "")."""
    return tuple(dict.fromkeys(m for of, m in pairs if law in ("", of)))


def laws_of(pairs: Pairs) -> tuple[str, ...]:
    """Return the friction laws in a table of pairs."""
    return tuple(dict.fromkeys(law for law, _ in pairs))
