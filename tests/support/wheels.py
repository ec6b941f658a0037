"""Mechanisms of one coordinate made by hand, for the solvers, and signals for their drives."""

from collections.abc import Callable
from typing import Any

import frictionsim as fs
from frictionsim.mechanisms.extension import signal_from
from frictionsim.solvers.common import SampleBuffer, SampleTimes
from frictionsim.solvers.mechanism import DryFriction, Mechanism
from tests.support.scenarios import pulley

Torque = Callable[[float, float, float], float]


def signal(table: Any) -> Any:
    """Return the signal of a number, or of a table as in a scenario."""
    return signal_from(fs.load(pulley(drive__force=table)).drive.force)


def settings(**changes: Any) -> Any:
    """Return settings of a solver with some changed; of those, no scenario may have a few."""
    return fs.load("pulley").solver.model_copy(update=changes)


def buffer_to(end: float) -> SampleBuffer:
    """Return a buffer for the samples at the start and the end of a run to a time, s."""
    return SampleBuffer(SampleTimes(end, end))


def wheel(
    drive: Any,
    torque: Torque,
    static: Callable[[float], float] | None = None,
    kinetic: Callable[[float], float] | None = None,
    inertia: float = 1.0,
    surfaces: tuple[Any, ...] = (),
) -> Mechanism:
    """Return a wheel under a torque(u, q, v), with friction whose limits are functions of u."""
    contact = None
    if static is not None:
        moving = kinetic or static
        contact = DryFriction(
            "hub",
            static_limit=lambda u, q: static(u),
            kinetic_limit=lambda u, q, v, s: moving(u),
            roundoff=lambda u, q: 1e-14,
        )
    return Mechanism(
        drive=drive,
        inertia=inertia,
        applied_torque=torque,
        contact=contact,
        power_flows={"energy_input": lambda u, q, v: torque(u, q, v) * v},
        stored_energies={"energy_kinetic": lambda q, v: 0.5 * inertia * v * v},
        channels=lambda trajectory: {},
        channel_info={},
        quantities=lambda trajectory: {},
        effects=(),
        switching_surfaces=surfaces,
    )
