"""The equilibrium of a belt of rigid bodies round its pulleys, without friction.

Body k has the centre P_k and the direction u_k = (cos phi_k, sin phi_k); a spring of no length
joins the right end of body k - 1 and the left end of body k. At rest the energy

    E = sum c/2 |d_k|^2 + EI/(2 l) (phi_k - phi_{k-1})^2 + c1 p_k^3/3 + c2 p_k^2/2 - m g . P_k
    d_k = P_k - (l/2) u_k - P_{k-1} - (l/2) u_{k-1},   c = EA/l,   m = rho l,   p = R - |P - C| > 0

is least; further effects add their own. A belt without friction slides round its pulleys until the
corners of its polygon lie best; a layout that is a mirror image of itself may be a saddle on that
way as well as a minimum, so that two of them are tried before a belt is left to slide.

Where the pretension T is given, the length l of the bodies is sought as well. With m and EI/l
held, E + n T l is least in l too, where the joints pull with the mean T along the bodies; an outer
loop corrects m, EI/l and the T of this sum.

Newton's method for the equilibrium of a belt, with a banded Hessian.

The exact Hessian is a ring of 3 x 3 blocks, which folded flat (bodies 0, n - 1, 1, n - 2, ...) is a
band of 8 subdiagonals; the length borders it. Where it is not positive definite it
is shifted until a step lowers the energy.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import lru_cache
from sys import float_info
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from frictionsim.mechanisms.belt_drive.effects.contact import (
    depth_under,
    normal_forces,
    radial_stiffness,
)
from frictionsim.mechanisms.belt_drive.equilibrium_energy import (
    Configuration,
    EquilibriumProblem,
    Evaluation,
    HeldParameters,
    evaluate,
    gradient,
    held_parameters,
    second_derivatives,
)
from frictionsim.mechanisms.belt_drive.geometry import (
    MAX_STRAIN,
    MIN_BODIES,
    Path,
    PathError,
    PulleyCircle,
    belt_path,
)
from frictionsim.mechanisms.belt_drive.kernels.system import Array, Chain

IndexArray = NDArray[np.intp]

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

    order: IndexArray
    own: IndexArray
    coupling: IndexArray


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


def hessian(belt: EquilibriumProblem, held: HeldParameters, at: Evaluation) -> Hessian:
    """Return the second derivatives of the energy in the band."""
    layout = band_layout(belt.bodies)
    derivatives = second_derivatives(belt, held, at)
    band = np.zeros((BAND + 1, 3 * belt.bodies))
    band.flat[layout.own] = derivatives.own[:, LOWER[0], LOWER[1]].ravel()
    band.flat[layout.coupling] = derivatives.coupling.ravel()
    border = None if derivatives.border is None else derivatives.border[layout.order].ravel()
    return Hessian(layout, band, border, derivatives.corner)


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
    solution = cho_solve_banded((factors.band, True), folded, check_finite=False)
    length = 0.0
    if factors.border is not None:
        length = (right[-1] - float(factors.border @ solution)) / factors.corner
        solution -= length * factors.eliminated
    step = np.empty((len(order), 3))
    step[order] = solution.reshape(-1, 3)
    return np.append(step, length)


def damped_newton_step(
    belt: EquilibriumProblem,
    held: HeldParameters,
    at: Evaluation,
    of: Hessian,
    slope: Array,
    shift: float,
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
    belt: EquilibriumProblem,
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


def _apply_step(belt: EquilibriumProblem, at: Configuration, step: Array) -> Configuration:
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


class NoEquilibrium(ValueError):
    """The belt does not rest on its pulleys, or its rest position was not found."""


class DiscreteLayout(NamedTuple):
    """Bodies as tangents on the circles that their centres are pressed to."""

    path: Path
    pitch: float
    breakpoints: Array  # of the path, in lengths of bodies laid


def discrete_layout(belt: EquilibriumProblem, tension: float) -> DiscreteLayout:
    """Return how bodies lie on the pulleys at a tension, N, and how far apart they are."""
    pitch = belt.scale
    for _ in range(10):
        normal = tension * 2.0 * np.sin(np.arctan(0.5 * pitch / belt.radii))
        depth = depth_under(belt.contact, normal)
        radii = belt.radii - depth
        path = _compressed_path(belt, tension, depth)
        # A body takes less of an arc than its own length.
        half = 0.5 * pitch / radii
        lengths = np.diff(path.breakpoints)
        lengths[1::2] *= np.roll(half / np.arctan(half), -1)
        breakpoints = np.concatenate([[0.0], np.cumsum(lengths)])
        pitch = float(breakpoints[-1]) / belt.bodies
    return DiscreteLayout(path, pitch, breakpoints)


def _compressed_path(belt: EquilibriumProblem, tension: float, depth: Array) -> Path:
    """Return the path round circles that are smaller by the depth of the contact."""
    deepest = int(np.argmax(depth / belt.radii))
    if depth[deepest] >= belt.radii[deepest]:
        raise NoEquilibrium(
            f"a tension of {tension:.6g} N presses the belt {depth[deepest]:.4g} m deep into "
            f"pulley {belt.pulleys[deepest].name}, more than its radius of "
            f"{belt.radii[deepest]:.6g} m: raise the stiffness of the contact"
        )
    smaller = [
        pulley._replace(radius=pulley.radius - float(p))
        for pulley, p in zip(belt.pulleys, depth, strict=True)
    ]
    # A pulley that the belt barely touches may be lost so, though not in the end.
    with suppress(PathError):
        return belt_path(smaller)
    return belt.path


def initial_guess(belt: EquilibriumProblem, tension: float, phase: float) -> Configuration:
    """Return bodies at a tension, N; `phase` is from the middle of the first arc to a centre."""
    path, pitch, breakpoints = discrete_layout(belt, tension)
    middle = 0.5 * (breakpoints[-2] + breakpoints[-1])
    places = (middle + phase * pitch) % pitch + pitch * np.arange(belt.bodies)
    line = path.at(np.interp(places, breakpoints, path.breakpoints))
    return Configuration(line.position, line.angle, pitch / (1.0 + tension / belt.axial_rigidity))


__all__ = ["Equilibrium", "NoEquilibrium", "find_equilibrium"]

# The largest unbalanced force over the tension: sought, well enough for the correction of the
# tension to end, accepted, and near enough to a rest position to tell a saddle from a minimum.
TARGET_RESIDUAL, RESIDUAL, ACCEPTABLE_RESIDUAL, SADDLE_RESIDUAL = 1e-10, 1e-9, 1e-7, 1e-5
# What rounded coordinates leave of the force on a body, in its stiffness times a unit in the last
# place: half a unit of its own and of its neighbours, and a little for the arithmetic.
ROUNDING = 1.25
TENSION_TOLERANCE = 1e-9  # of the mean, relative

MAX_NEWTON_STEPS = 300
MAX_TENSION_ITERATIONS = 40

# No valid belt changes its body length, from that of the path, by more than this factor.
MAX_LENGTH_RATIO = 5.0

# Bodies from the middle of the first arc to a centre: mirror images of themselves, and not.
SYMMETRIC_PHASES, ASYMMETRIC_PHASE = (0.0, 0.5), 0.25

# Least first guess of the tension in a belt of given length, over EA.
MIN_STRAIN_GUESS = 1e-4
MAX_LENGTH_ITERATIONS = 8


class Equilibrium(NamedTuple):
    """A belt at rest.

    Attributes
    ----------
    body_length : float, m
    x, y : array (n,), m
        Centres of the bodies; body 0 is laid first after the belt has left the first pulley.
    angle : array (n,), rad
        Continuous along the belt.
    tension : array (n,), N
        Of joint k, between the bodies k - 1 and k.
    normal_force : array (n,), N
    pulley : array (n,)
        Index of the pulley that a body touches, -1 where none.
    residual : float, N
        Largest unbalanced force on a body.
    """

    body_length: float
    x: Array
    y: Array
    angle: Array
    tension: Array
    normal_force: Array
    pulley: IndexArray
    residual: float


def find_equilibrium(
    path: Path,
    pulleys: Sequence[PulleyCircle],
    axial_rigidity: float,
    chain_of: Callable[[float], Chain],
    parameters_of: Callable[[Chain], Any],
    *,
    pretension: float | None = None,
    length: float | None = None,
) -> Equilibrium:
    """Find the equilibrium of a belt without friction, a minimum of its energy.

    Parameters
    ----------
    path : Path, m
        What `belt_path` gives for the pulleys.
    pulleys : sequence of PulleyCircle, m
    axial_rigidity : float, N
        EA.
    chain_of : callable
        Returns what bodies of a length, m, have in common; there are at least 4.
    parameters_of : callable
        Returns the parameters of the effects on them, as `EffectParameters`.
    pretension : float, N
        Mean tension of the joints, above zero. Either this or `length` is given.
    length : float, m
        Of the unstretched belt, n l.

    Returns
    -------
    Equilibrium
        With an unbalanced force of at most 1e-7 of the tension or, where that is more, what
        rounding leaves: some 2 EA/l + c2 times a unit in the last place of a coordinate.

    Raises
    ------
    NoEquilibrium
        A strain above 0.5, a slack belt, a pulley that no body touches, no minimum found.
    ValueError
        Pretension and length both given, or neither.
    """
    if (pretension is None) == (length is None):
        raise ValueError("give either the pretension or the length of the belt")
    bodies = chain_of(1.0).bodies
    if bodies < MIN_BODIES:
        raise NoEquilibrium(f"a belt needs at least {MIN_BODIES} bodies, not {bodies}")
    scale = path.length / bodies
    belt = EquilibriumProblem(
        path,
        pulleys,
        np.array([pulley.center for pulley in pulleys]),
        np.array([pulley.radius for pulley in pulleys]),
        bodies,
        axial_rigidity,
        parameters_of(chain_of(scale)).contact,
        chain_of,
        parameters_of,
        scale,
    )
    _check_strain(belt, pretension, length)
    for phase in SYMMETRIC_PHASES:
        with suppress(NoEquilibrium):
            return _result(belt, _solve(belt, phase, pretension, length))
    return _result(belt, _solve(belt, ASYMMETRIC_PHASE, pretension, length))


def _check_strain(belt: EquilibriumProblem, pretension: float | None, length: float | None) -> None:
    if pretension is not None:
        strain = pretension / belt.axial_rigidity
        if strain > MAX_STRAIN:
            raise NoEquilibrium(
                f"the pretension of {pretension:.6g} N strains the belt by {strain:.4g}, more "
                f"than {MAX_STRAIN}: its axial rigidity is {belt.axial_rigidity:.6g} N"
            )
    if length is not None:
        strain = belt.path.length / length - 1.0
        if strain > MAX_STRAIN:
            raise NoEquilibrium(
                f"the belt is too short for its path: {length:.6g} m unstretched on "
                f"{belt.path.length:.6g} m, a strain of {strain:.4g}, more than {MAX_STRAIN}"
            )
        taut = belt.bodies * discrete_layout(belt, 0.0).pitch
        if length >= taut:
            raise NoEquilibrium(
                f"the belt is slack: it is {length:.6g} m long unstretched, its path "
                f"{belt.path.length:.6g} m, and {taut:.6g} m as a polygon of {belt.bodies} "
                "bodies. Shorten it or move the pulleys apart"
            )


def _solve(
    belt: EquilibriumProblem, phase: float, pretension: float | None, length: float | None
) -> Evaluation:
    """Return the minimum that is found from one guess."""
    leave_saddles = phase == ASYMMETRIC_PHASE
    if pretension is not None:
        guess = initial_guess(belt, pretension, phase)
        return _solve_for_tension(belt, guess, pretension, leave_saddles)
    assert length is not None
    # First near the length by way of the tension, which keeps the belt taut throughout.
    size = length / belt.bodies
    strain = discrete_layout(belt, 0.0).pitch / size - 1.0
    tension = belt.axial_rigidity * max(strain, MIN_STRAIN_GUESS)
    at = initial_guess(belt, tension, phase)
    for _ in range(MAX_LENGTH_ITERATIONS):
        at = _solve_for_tension(belt, at, tension, leave_saddles).configuration
        if abs(at.length - size) <= 0.01 * (tension / belt.axial_rigidity) * size:
            break
        stretched = (belt.axial_rigidity + tension) * at.length
        tension = max(stretched / size - belt.axial_rigidity, 0.1 * tension)
    at = at._replace(length=size)
    return _minimum(belt, held_parameters(belt, size, None), at, tension, leave_saddles)


def _solve_for_tension(
    belt: EquilibriumProblem, at: Configuration, tension: float, leave_saddles: bool
) -> Evaluation:
    """Find the minimum at a mean tension."""
    pull = tension * (1.0 + 0.5 * tension / belt.axial_rigidity)
    for _ in range(MAX_TENSION_ITERATIONS):
        held = held_parameters(belt, at.length, pull)
        minimum = _minimum(belt, held, at, tension, leave_saddles)
        at = minimum.configuration
        mean = float(np.mean(minimum.tensions))
        residual = _residual(gradient(belt, held_parameters(belt, at.length, None), minimum))
        allowed = _force_tolerance(belt, minimum, tension)
        if abs(mean - tension) <= max(TENSION_TOLERANCE * tension, allowed) and residual <= max(
            RESIDUAL * tension, allowed
        ):
            return minimum
        pull *= tension / mean
    raise NoEquilibrium(
        f"no rest position of the belt was found: its mean tension stays {mean - tension:.3g} N "
        f"off {tension:.6g} N, with a force of {residual:.3g} N unbalanced. Raise the pretension"
    )


def _minimum(
    belt: EquilibriumProblem,
    held: HeldParameters,
    start: Configuration,
    tension: float,
    leave_saddles: bool,
) -> Evaluation:
    """Minimise the energy; leave a saddle, or give up at one."""
    tolerance, shift = NEGATIVE_CURVATURE_TOL * belt.axial_rigidity / start.length, 0.0
    at = evaluate(belt, held, start)
    for _ in range(MAX_NEWTON_STEPS):
        slope = gradient(belt, held, at)
        residual = _residual(slope)
        if residual <= _force_tolerance(belt, at, tension):
            break
        of = hessian(belt, held, at)
        if not leave_saddles and residual <= SADDLE_RESIDUAL * tension:
            _check_minimum(of, tolerance)
        lower, shift = damped_newton_step(belt, held, at, of, slope, shift)
        if lower is None:
            break
        at = lower
        _check_length(belt, at.configuration.length)
        shift = 0.1 * shift if shift > tolerance else 0.0
    residual = _residual(gradient(belt, held, at))
    if residual > max(ACCEPTABLE_RESIDUAL * tension, _force_tolerance(belt, at, tension)):
        raise NoEquilibrium(
            f"no rest position of the belt was found: a force of {residual:.3g} N on a body stays "
            f"unbalanced at a tension of {tension:.6g} N. Raise the pretension or the number of "
            "bodies"
        )
    if not leave_saddles:
        _check_minimum(hessian(belt, held, at), tolerance)
    return at


def _check_length(belt: EquilibriumProblem, length: float) -> None:
    """Refuse a belt that has contracted off its pulleys, or sags without limit."""
    if length < belt.scale / MAX_LENGTH_RATIO:
        shortest = float(np.min(belt.radii * [abs(arc.wrap_angle) for arc in belt.path.arcs]))
        raise NoEquilibrium(
            f"the belt slips off its pulleys: bodies of {belt.scale:.4g} m are too long for its "
            f"arcs, of which the shortest has {shortest:.4g} m, or the contact is too soft. Take "
            "more bodies or raise its stiffness"
        )
    if length > belt.scale * MAX_LENGTH_RATIO:
        raise NoEquilibrium(
            "the belt sags without limit: its weight or its bending exceeds what the pretension "
            "can carry. Raise the pretension"
        )


def _check_minimum(of: Hessian, tolerance: float) -> None:
    if factorise(of, tolerance) is None:
        raise NoEquilibrium("the equilibrium is a saddle point: the belt is unstable")


def _residual(slope: Array) -> float:
    """Return the largest force; that on the length is one on all bodies."""
    return max(float(np.max(np.abs(slope[:-1]))), 3.0 * abs(float(slope[-1])) / slope.size)


def _force_tolerance(belt: EquilibriumProblem, at: Evaluation, tension: float) -> float:
    """Return the allowed residual force: the target, or the rounding error of coordinates."""
    unit = float(np.spacing(np.max(np.abs(at.configuration.position))))
    stiffness = 2.0 * belt.axial_rigidity / at.configuration.length
    stiffness += float(np.max(radial_stiffness(belt.contact, at.shape)))
    return max(TARGET_RESIDUAL * tension, ROUNDING * stiffness * unit)


def _result(belt: EquilibriumProblem, at: Evaluation) -> Equilibrium:
    (position, angle, length), rim = at.configuration, at.shape.rim
    pulley = np.where(rim.depth > 0.0, rim.pulley, -1)
    _check_all_pulleys_touched(belt, at, pulley)
    left = gradient(belt, held_parameters(belt, length, None), at)[:-1].reshape(-1, 3)
    return Equilibrium(
        body_length=length,
        x=position[:, 0].copy(),
        y=position[:, 1].copy(),
        angle=angle,
        tension=at.tensions,
        normal_force=normal_forces(belt.contact, at.shape),
        pulley=pulley,
        residual=float(np.max(np.hypot(left[:, 0], left[:, 1]))),
    )


def _check_all_pulleys_touched(
    belt: EquilibriumProblem, at: Evaluation, pulley: IndexArray
) -> None:
    """Refuse a pulley that lies between two bodies, or that the belt has jumped over."""
    normal, along = at.shape.rim.normal, at.shape.along
    sense = along[:, 1] * normal[:, 0] - along[:, 0] * normal[:, 1]
    for i, arc in enumerate(belt.path.arcs):
        if not np.any((pulley == i) & (sense * arc.wrap_angle > 0.0)):
            raise NoEquilibrium(
                f"no body of the belt rests on pulley {belt.pulleys[i].name}: bodies of "
                f"{belt.scale:.4g} m are too long for its arc of "
                f"{belt.radii[i] * abs(arc.wrap_angle):.4g} m, or the belt leaves it. Take more"
                " bodies or raise the pretension"
            )
