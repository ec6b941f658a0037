"""Energies of a reference solution by quadrature, and whether it obeys Newton and Coulomb."""

from collections.abc import Callable
from typing import Any

import numpy as np
from mpmath import mpf

from tests.support.lift_reference import STICK, Motion, Solution

NODES, WEIGHTS = np.polynomial.legendre.leggauss(14)
PANELS = 12  # of a piece, which is not longer than a period of a sine


def energies(of: Solution) -> dict[str, float]:
    """Return the works and heats from the start to the end and the stores at the end, J."""
    lift = of.lift
    r, b, r_k = float(lift.r), float(lift.b), float(lift.r_k)
    values = dict.fromkeys(
        ("energy_input", "energy_friction", "energy_damping", "energy_cord_friction"), 0.0
    )
    for piece in of.pieces:
        u, weight = nodes(float(piece.end - piece.start))

        def over(power: Any, w: Any = weight) -> float:
            return float(np.sum(power * w))

        w, v1, v2, t1, t2, force, torque = (
            getattr(piece, name).floats(u)
            for name in ("w", "v1", "v2", "t1", "t2", "force", "torque")
        )
        values["energy_input"] += over(torque * w - force * v2)
        values["energy_damping"] += over(b * w * w)
        if piece.modes.shaft != STICK:
            values["energy_friction"] += over(r_k * (t1 + t2) * np.abs(w))
        if piece.modes.cord != STICK:
            values["energy_cord_friction"] += over((t2 - t1) * (v1 - r * w))
    values["energy_impact"] = float(sum(loss for *_, loss, _ in of.impacts))
    values["energy_friction"] += float(sum(heat for *_, heat in of.impacts))
    last = of.pieces[-1]
    end = last.state(last.end - last.start)
    values["energy_kinetic"] = float(
        (lift.inertia * end.w**2 + lift.m1 * end.v1**2 + lift.m2 * end.v2**2) / 2
    )
    values["energy_potential"] = float(lift.m1 * lift.g * end.x1 + lift.m2 * lift.g * end.x2)
    return values


def nodes(length: float) -> tuple[Any, Any]:
    """Return times and weights of a quadrature over [0, length]."""
    panel = length / PANELS
    first = panel * np.arange(PANELS)[:, np.newaxis]
    return (first + panel * (NODES + 1) / 2).ravel(), np.tile(panel * WEIGHTS / 2, PANELS)


def largest_violation(of: Solution) -> dict[str, float]:
    """Return the largest violations of a solution's laws, relative to weights.

    Bodies and pulley one by one, friction and tension from the motion: not from how the solution
    was found.
    """
    lift = of.lift
    weight = (lift.m1 + lift.m2) * lift.g
    worst: dict[str, float] = {}

    def see(name: str, amount: Any) -> None:
        worst[name] = max(worst.get(name, 0.0), float(amount / weight))

    for piece in of.pieces:
        length = piece.end - piece.start
        for k in range(1, 12):
            _examine(of, piece, length * mpf(k) / 12, see)
    return worst


def _examine(of: Solution, piece: Motion, u: Any, see: Callable[[str, Any], None]) -> None:
    lift = of.lift
    r = lift.r
    t1, t2, force = piece.t1(u), piece.t2(u), piece.force(u)
    w, v1, v2 = piece.w(u), piece.v1(u), piece.v2(u)
    see("car", abs(lift.m1 * (piece.v1.slope()(u) + lift.g) - t1))
    see("counterweight", abs(lift.m2 * (piece.v2.slope()(u) + lift.g) + force - t2))
    friction = lift.inertia * piece.w.slope()(u) - (t2 - t1) * r - piece.torque(u) + lift.b * w
    reaction = t1 + t2
    if w == 0:
        see("shaft sticks", max(0, abs(friction) - lift.r_s * reaction) / r)
    else:
        sign = 1 if w > 0 else -1
        see("shaft slides", abs(friction + sign * lift.r_k * reaction) / r)
    see("a cord cannot push", max(0, -t1, -t2 if lift.m2 > 0 else 0))
    if lift.static_ratio == 0:
        rim = r * (piece.angle(u) - of.first_angle)
        for tension, gap in ((t1, piece.x1(u) - rim), (t2, piece.x2(u) + rim)):
            see("gap", max(0, -gap) * lift.g)
            see("tension across a gap", min(abs(tension), abs(gap) * lift.m1 * lift.g))
        return
    slip = v1 - r * w
    see("compensated", abs(v1 + v2))
    if piece.modes.cord == STICK:
        see("cord locked", abs(slip))
        excess = max(t2 - lift.static_ratio * t1, t1 - lift.static_ratio * t2)
        see("cord sticks", max(0, excess))
    else:
        ratio = lift.kinetic_ratio if slip > 0 else 1 / lift.kinetic_ratio
        see("cord slips", abs(t2 - ratio * t1))
