"""Mechanisms of one coordinate made by hand, for the solvers, and signals for their drives."""

from collections.abc import Callable
from typing import Any

import frictionsim as fs
from frictionsim.mechanisms.extension import INPUT, Friction, OneCoordinate, Term, signal_from
from frictionsim.solvers import solver_of
from frictionsim.solvers.recording import Recording
from frictionsim.solvers.rkf45 import Tolerances
from tests.support.scenarios import pulley

TIGHT = Tolerances(rtol=1e-12, atol=1e-14)


def signal(table: Any) -> Any:
    """Return the signal of a number, or of a table as in a scenario."""
    return signal_from(fs.load(pulley(drive__force=table)).drive.force)


def wheel(
    drive: Any,
    torque: Callable[[float, float, float], float],
    static: Callable[[float], float] | None = None,
    kinetic: Callable[[float], float] | None = None,
    inertia: float = 1.0,
    surfaces: tuple[Any, ...] = (),
) -> OneCoordinate:
    """Return a wheel under a torque(u, q, v), with friction whose limits are functions of u."""
    friction = None
    if static is not None:
        moving = kinetic or static
        friction = Friction(
            "hub",
            static=lambda u, q: static(u),
            kinetic=lambda u, q, v, s, applied: moving(u),
            roundoff=lambda u, q: 1e-14,
        )
    terms = (Term(torque, INPUT),)
    return OneCoordinate(drive, None, inertia, terms, friction, surfaces=surfaces)


def solved(system: Any, end: float, tolerances: Tolerances = TIGHT, backend: str = "events") -> Any:
    """Return a solver that has integrated a system to a time, s, with ten samples."""
    law = "set-valued" if system.contacts else ""
    solver = solver_of(law, backend, system, tolerances, Recording(system, end, 0.1 * end), end)
    solver.run(lambda t: None)
    return solver
