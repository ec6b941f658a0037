"""Energies of a reference solution by quadrature."""

from typing import Any

import numpy as np

from tests.support.lift_reference import STICK, Solution

NODES, WEIGHTS = np.polynomial.legendre.leggauss(14)
PANELS = 12  # of a piece, which is not longer than a period of a sine


def energies(of: Solution) -> dict[str, float]:
    """Return the works and heats from the start to the end and the stores at the end, J."""
    lift = of.lift
    r, b, r_k = float(lift.r), float(lift.b), float(lift.r_k)
    found = dict.fromkeys(
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
        found["energy_input"] += over(torque * w - force * v2)
        found["energy_damping"] += over(b * w * w)
        if piece.modes.shaft != STICK:
            found["energy_friction"] += over(r_k * (t1 + t2) * np.abs(w))
        if piece.modes.cord != STICK:
            found["energy_cord_friction"] += over((t2 - t1) * (v1 - r * w))
    found["energy_impact"] = float(sum(loss for *_, loss, _ in of.impacts))
    found["energy_friction"] += float(sum(heat for *_, heat in of.impacts))
    last = of.pieces[-1]
    end = last.state(last.end - last.start)
    found["energy_kinetic"] = float(
        (lift.inertia * end.w**2 + lift.m1 * end.v1**2 + lift.m2 * end.v2**2) / 2
    )
    found["energy_potential"] = float(lift.m1 * lift.g * end.x1 + lift.m2 * lift.g * end.x2)
    return found


def nodes(length: float) -> tuple[Any, Any]:
    """Return times and weights of a quadrature over [0, length]."""
    panel = length / PANELS
    first = panel * np.arange(PANELS)[:, np.newaxis]
    return (first + panel * (NODES + 1) / 2).ravel(), np.tile(panel * WEIGHTS / 2, PANELS)
