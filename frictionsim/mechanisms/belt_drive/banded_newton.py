"""Newton's method for the equilibrium of a belt, with a banded Hessian.

The exact Hessian is a ring of 3 x 3 blocks, which folded flat (bodies 0, n - 1, 1, n - 2, ...) is a
band of 8 diagonals beside the main one; the length borders it. Where it is not positive definite it
is shifted until a step lowers the energy.
"""

from functools import lru_cache
from sys import float_info
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from frictionsim.mechanisms.belt_drive.effects.base import Array
from frictionsim.mechanisms.belt_drive.energy import (
    Belt,
    Configuration,
    Evaluation,
    HeldParameters,
    evaluate,
    gradient,
    second_derivatives,
)

Indices = NDArray[np.intp]

BAND = 8
LOWER = np.array([[0, 1, 1, 2, 2, 2], [0, 0, 1, 0, 1, 2]])

# A saddle is told from rounding by a negative stiffness of this part of c.
NEGATIVE_CURVATURE_TOL = 1e-11
# Larger shifts, over c, make the step negligible.
MAX_SHIFT = 1e3
# The largest step: of the smallest radius, in rad, and of the length of a body.
STEP_IN_RADII, STEP_IN_ANGLE, STEP_IN_LENGTH = 0.2, 0.3, 0.2


class BandLayout(NamedTuple):
    """Where the bodies stand in the folded numbering, and their blocks in the band."""

    order: Indices
    own: Indices
    coupling: Indices


class Hessian(NamedTuple):
    """The second derivatives: of the bodies, of bodies and length, of the length."""

    layout: BandLayout
    band: Array
    border: Array | None
    corner: float


class Factors(NamedTuple):
    """A factorised Hessian, and what it makes of its border."""

    layout: BandLayout
    band: Array
    border: Array | None
    eliminated: Array | None
    corner: float


@lru_cache(maxsize=4)
def band_layout(n: int) -> BandLayout:
    """Return the layout of n bodies."""
    k = np.arange(n)
    place = np.minimum(2 * k, 2 * (n - k) - 1)
    start, inner = 3 * place, np.arange(3)
    own = (LOWER[0] - LOWER[1]) * 3 * n + start[:, None] + LOWER[1]
    row = (start[:, None] + inner)[:, :, None]
    column = (np.roll(start, 1)[:, None] + inner)[:, None, :]
    coupling = np.abs(row - column) * 3 * n + np.minimum(row, column)
    return BandLayout(np.argsort(place), own.ravel(), coupling.ravel())


def hessian(belt: Belt, held: HeldParameters, at: Evaluation) -> Hessian:
    """Return the second derivatives of the energy in the band."""
    layout = band_layout(belt.bodies)
    found = second_derivatives(belt, held, at)
    band = np.zeros((BAND + 1, 3 * belt.bodies))
    band.flat[layout.own] = found.own[:, LOWER[0], LOWER[1]].ravel()
    band.flat[layout.coupling] = found.coupling.ravel()
    border = None if found.border is None else found.border[layout.order].ravel()
    return Hessian(layout, band, border, found.corner)


def factorise(of: Hessian, shift: float) -> Factors | None:
    """Factorise the shifted Hessian; None where it is not positive definite."""
    from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

    shifted = of.band.copy()
    shifted[0] += shift
    try:
        band = cholesky_banded(shifted, overwrite_ab=True, lower=True, check_finite=False)
    except LinAlgError:
        return None
    if of.border is None:
        return Factors(of.layout, band, None, None, 1.0)
    eliminated = cho_solve_banded((band, True), of.border, check_finite=False)
    corner = of.corner - float(of.border @ eliminated)
    return Factors(of.layout, band, of.border, eliminated, corner) if corner > 0.0 else None


def solve(factors: Factors, right: Array) -> Array:
    """Solve the factorised system for a right-hand side, (3 n + 1,)."""
    from scipy.linalg import cho_solve_banded

    order = factors.layout.order
    folded = right[:-1].reshape(-1, 3)[order].ravel()
    found = cho_solve_banded((factors.band, True), folded, check_finite=False)
    length = 0.0
    if factors.border is not None:
        length = (right[-1] - float(factors.border @ found)) / factors.corner
        found -= length * factors.eliminated
    step = np.empty((len(order), 3))
    step[order] = found.reshape(-1, 3)
    return np.append(step, length)


def damped_newton_step(
    belt: Belt, held: HeldParameters, at: Evaluation, of: Hessian, slope: Array, shift: float
) -> tuple[Evaluation | None, float]:
    """Raise the shift of the Hessian until a step lowers the energy; None where none does."""
    stiffness = belt.axial_rigidity / at.configuration.length
    while shift <= MAX_SHIFT * stiffness:
        lower = _newton_step(belt, held, at, factorise(of, shift), slope, shift)
        if lower is not None:
            return lower, shift
        shift = max(4.0 * shift, NEGATIVE_CURVATURE_TOL * stiffness)
    return None, shift


def _newton_step(
    belt: Belt,
    held: HeldParameters,
    at: Evaluation,
    factors: Factors | None,
    slope: Array,
    shift: float,
) -> Evaluation | None:
    """Make a step that lowers the energy; None where this shift of the Hessian gives none."""
    if factors is None:
        return None
    step = solve(factors, -slope)
    trial = evaluate(belt, held, _apply_step(belt, at.configuration, step))
    if _decreases(at, trial):
        return trial
    # The bodies turn on a curve: what the straight step has left is of second order, and a second
    # step with the same matrix takes it away.
    left = gradient(belt, held, trial)
    left[:-1] += shift * step[:-1]
    corrected = step - solve(factors, left)
    trial = evaluate(belt, held, _apply_step(belt, at.configuration, corrected))
    return trial if _decreases(at, trial) else None


def _decreases(before: Evaluation, after: Evaluation) -> bool:
    change = float(np.sum(after.energies - before.energies))
    return change <= float_info.epsilon * float(np.sum(np.abs(before.energies)))


def _apply_step(belt: Belt, at: Configuration, step: Array) -> Configuration:
    bodies, length = step[:-1].reshape(-1, 3), float(step[-1])
    excess = max(
        float(np.max(np.abs(bodies[:, :2]))) / (STEP_IN_RADII * float(np.min(belt.radii))),
        float(np.max(np.abs(bodies[:, 2]))) / (STEP_IN_ANGLE * belt.scale),
        abs(length) / (STEP_IN_LENGTH * at.length),
        1.0,
    )
    return Configuration(
        at.position + bodies[:, :2] / excess,
        at.angle + bodies[:, 2] / (excess * belt.scale),
        at.length + length / excess,
    )
