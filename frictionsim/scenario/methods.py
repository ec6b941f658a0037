"""Friction laws, integration methods, and which of them go together: the registry of both.

A scenario names the law in its friction effect (`effects.<friction>.law`) and the method as
`solver.backend`. A kind of mechanism has one of the tables of pairs below (`Scenario.PAIRS`).
Modules are named, not imported: only the one that a scenario needs is loaded.

A method for mechanisms of one coordinate is a module with make_solver(mechanism, settings,
buffer), which returns a `Solver`; a method for belts is a module with a class
`BeltStepper`.
"""

from collections.abc import Mapping
from typing import NamedTuple

SET_VALUED, REGULARISED, PUBLISHED, CREEP = "set-valued", "regularised", "published", "creep"

LAWS = {
    SET_VALUED: "exact stick; at slip the kinetic limit",
    REGULARISED: "smoothed over transition_speed: it creeps where it should stick",
    PUBLISHED: "eq 30 of the paper on shafts, with its switch of abs and sign",
    CREEP: "the creep of a belt as Kubas 2014 has it",
}


class Method(NamedTuple):
    """What is particular to an integration method.

    Attributes
    ----------
    scipy_class : str
        The class of scipy.integrate that steps it; empty for our own integrators.
    implicit : bool
        Stiffness does not shorten its steps.
    """

    scipy_class: str = ""
    implicit: bool = False

    @property
    def resumable(self) -> bool:
        """Whether a run can go on from a checkpoint; SciPy keeps its state to itself."""
        return not self.scipy_class

    @property
    def tells_rejected(self) -> bool:
        """Whether its rejected steps are known; SciPy's implicit methods do not tell."""
        return not self.implicit


METHODS = {
    "events": Method(),
    "rkf45": Method(),
    "moreau": Method(),
    "rk45": Method("RK45"),
    "dop853": Method("DOP853"),
    "radau": Method("Radau", implicit=True),
    "bdf": Method("BDF", implicit=True),
    "lsoda": Method("LSODA", implicit=True),
}
SCIPY = tuple(name for name, method in METHODS.items() if method.scipy_class)


class Pair(NamedTuple):
    """A law and a method that go together.

    Attributes
    ----------
    module : str
        What integrates this law by this method.
    fixed_step : bool
        It takes steps of a given length, `solver.step`.
    """

    module: str
    fixed_step: bool = False


Pairs = Mapping[tuple[str, str], Pair]
"""(law, method) to what integrates them, in the order in which they are recommended"""

_SOLVERS = "frictionsim.solvers."
_STEPPERS = "frictionsim.mechanisms.belt_drive.steppers."

SINGLE_DOF: Pairs = {
    (SET_VALUED, "events"): Pair(_SOLVERS + "event_driven"),
    (SET_VALUED, "rkf45"): Pair(_SOLVERS + "set_valued"),
    (PUBLISHED, "rkf45"): Pair(_SOLVERS + "published_law", fixed_step=True),
    (REGULARISED, "rkf45"): Pair(_SOLVERS + "regularised"),
    **{(REGULARISED, name): Pair(_SOLVERS + "regularised") for name in SCIPY},
}

BELT: Pairs = {
    (SET_VALUED, "rkf45"): Pair(_STEPPERS + "rkf45"),
    (SET_VALUED, "moreau"): Pair(_STEPPERS + "moreau", fixed_step=True),
    **{(SET_VALUED, name): Pair(_STEPPERS + "scipy") for name in SCIPY},
    **{
        (law, name): Pair(_STEPPERS + ("rkf45" if name == "rkf45" else "scipy"))
        for law in (REGULARISED, CREEP)
        for name in ("rkf45", *SCIPY)
    },
}


def methods_of(pairs: Pairs, law: str = "") -> tuple[str, ...]:
    """Return the methods that go with a law, or with any where there is no friction."""
    return tuple(dict.fromkeys(m for of, m in pairs if law in ("", of)))


def laws_of(pairs: Pairs) -> tuple[str, ...]:
    """Return the laws that a table of pairs has."""
    return tuple(dict.fromkeys(law for law, _ in pairs))


def pair_of(pairs: Pairs, law: str, method: str) -> Pair:
    """Return what integrates a law by a method.

    Without friction (law "") it is the first that does, with fixed steps if any has these.
    """
    found = [pair for (of, m), pair in pairs.items() if m == method and law in ("", of)]
    return found[0]._replace(fixed_step=any(pair.fixed_step for pair in found))
