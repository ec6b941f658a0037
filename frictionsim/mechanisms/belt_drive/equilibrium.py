"""The rest position of a belt of rigid bodies round its pulleys, without friction.

Body k has the centre P_k and the direction u_k = (cos phi_k, sin phi_k); a spring of no length
joins the right end of body k - 1 and the left end of body k. At rest the energy

    E = sum c/2 |d_k|^2 + EI/(2 l) (phi_k - phi_{k-1})^2 + c1 p_k^3/3 + c2 p_k^2/2 - m g . P_k
    d_k = P_k - (l/2) u_k - P_{k-1} - (l/2) u_{k-1},   c = EA/l,   m = rho l,   p = R - |P - C| > 0

is least. A belt without friction slides round its pulleys until the corners of its polygon lie
best; a layout that is a mirror image of itself may be a saddle on that way as well as a minimum,
so that two of them are tried before a belt is left to slide.

Where the pretension T is given, the length l of the bodies is sought as well. With m and EI/l
held, E + n T l is least in l too, where the joints pull with the mean T along the bodies; an outer
loop corrects m, EI/l and the T of this sum.

Newton's method has the exact Hessian: a ring of 3 x 3 blocks, which folded flat (bodies 0, n - 1,
1, n - 2, ...) is a band of 8 diagonals beside the main one; the length borders it.
"""

from collections.abc import Sequence
from contextlib import suppress
from sys import float_info
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from frictionsim.mechanisms.belt_drive.geometry import Path, PathError, Pulley, belt_path

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

MAX_STRAIN = 0.5
MIN_BODIES = 4

# The largest unbalanced force over the tension: sought, well enough for the correction of the
# tension to end, accepted, and near enough to a rest position to tell a saddle from a minimum.
TARGET_RESIDUAL, RESIDUAL, ACCEPTABLE_RESIDUAL, NEAR_RESIDUAL = 1e-10, 1e-9, 1e-7, 1e-5
# What rounded coordinates leave of the force on a body, in its stiffness times a unit in the last
# place: half a unit of its own and of its neighbours, and a little for the arithmetic.
ROUNDING = 1.25
# The mean tension, relative.
TENSION_TOLERANCE = 1e-9

MAX_NEWTON_STEPS = 300
MAX_TENSION_ITERATIONS = 40

# A saddle is told from rounding by a negative stiffness of this part of c.
NEGATIVE_CURVATURE_TOL = 1e-11
# A stiffness above this part of c moves no body any more.
MAX_SHIFT = 1e3
# The largest step: of the smallest radius, in rad, and of the length of a body.
STEP_IN_RADII, STEP_IN_ANGLE, STEP_IN_LENGTH = 0.2, 0.3, 0.2

# Of the length of a body from that of the path: no belt that stays on its pulleys gets so far.
MAX_LENGTH_RATIO = 5.0

BAND = 8
LOWER = np.array([[0, 1, 1, 2, 2, 2], [0, 0, 1, 0, 1, 2]])

# Bodies from the middle of the first arc to a centre: mirror images of themselves, and not.
SYMMETRIC_PHASES, ASYMMETRIC_PHASE = (0.0, 0.5), 0.25

# What a first guess of the tension in a belt of given length is at least, over EA.
MIN_STRAIN_GUESS = 1e-4
MAX_LENGTH_ITERATIONS = 8


class NoEquilibrium(ValueError):
    """The belt does not rest on its pulleys, or its rest position was not found."""


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
    residual_moment : float, N m
    """

    body_length: float
    x: Array
    y: Array
    angle: Array
    tension: Array
    normal_force: Array
    pulley: Indices
    residual: float
    residual_moment: float


class _BandLayout(NamedTuple):
    """Where the bodies stand in the folded numbering, and their blocks in the band."""

    order: Indices
    own: Indices
    coupling: Indices


class _Belt(NamedTuple):
    """What stays the same while the rest position is sought."""

    path: Path
    pulleys: Sequence[Pulley]
    centers: Array
    radii: Array
    bodies: int
    axial_rigidity: float
    mass_per_length: float
    bending_rigidity: float
    c1: float
    c2: float
    gravity: Array
    scale: float  # m, makes a length of an angle
    layout: _BandLayout


class _HeldParameters(NamedTuple):
    """What is held while the energy is minimised; pull None: the bodies keep their length."""

    bending: float
    weight: Array
    pull: float | None


class _State(NamedTuple):
    position: Array  # (n, 2)
    angle: Array
    length: float


class _Contact(NamedTuple):
    pulley: Indices  # the nearest
    normal: Array  # (n, 2), outward
    distance: Array
    depth: Array  # zero where there is no contact
    force: Array


class _Evaluation(NamedTuple):
    """A state, and what energy, gradient and Hessian have in common."""

    state: _State
    along: Array  # u_k
    transverse_frequencies: Array  # z x u_k
    force: Array  # of joint k on body k - 1
    add_bending: Array  # of joint k
    contact: _Contact
    energies: Array


class _Hessian(NamedTuple):
    """The second derivatives: of the bodies, of bodies and length, of the length."""

    band: Array
    border: Array | None
    corner: float


class _Factors(NamedTuple):
    """A factorised Hessian, and what it makes of its border."""

    band: Array
    border: Array | None
    eliminated: Array | None
    corner: float


def find_equilibrium(
    path: Path,
    pulleys: Sequence[Pulley],
    bodies: int,
    *,
    axial_rigidity: float,
    mass_per_length: float,
    c1: float,
    c2: float,
    pretension: float | None = None,
    length: float | None = None,
    bending_rigidity: float = 0.0,
    gravity: tuple[float, float] = (0.0, 0.0),
) -> Equilibrium:
    """Find the rest position of a belt without friction, a minimum of its energy.

    Parameters
    ----------
    path : Path, m
        What `route` gives for the pulleys.
    pulleys : sequence of Pulley, m
    bodies : int
        n, at least 4.
    axial_rigidity : float, N
        EA.
    mass_per_length : float, kg/m
        rho, of the unstretched belt.
    c1, c2 : float, N/m^2, N/m
        Of the contact of one body, N = c1 p^2 + c2 p; not both zero.
    pretension : float, N
        Mean tension of the joints, above zero. Either this or `length` is given.
    length : float, m
        Of the unstretched belt, n l.
    bending_rigidity : float, N m^2
        EI.
    gravity : (float, float), m/s^2

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
    if bodies < MIN_BODIES:
        raise NoEquilibrium(f"a belt needs at least {MIN_BODIES} bodies, not {bodies}")
    belt = _Belt(
        path,
        pulleys,
        np.array([pulley.center for pulley in pulleys]),
        np.array([pulley.radius for pulley in pulleys]),
        bodies,
        axial_rigidity,
        mass_per_length,
        bending_rigidity,
        c1,
        c2,
        np.array(gravity),
        path.length / bodies,
        _band_layout(bodies),
    )
    _check_strain(belt, pretension, length)
    for phase in SYMMETRIC_PHASES:
        with suppress(NoEquilibrium):
            return _result(belt, _solve(belt, phase, pretension, length))
    return _result(belt, _solve(belt, ASYMMETRIC_PHASE, pretension, length))


def _check_strain(belt: _Belt, pretension: float | None, length: float | None) -> None:
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
        taut = belt.bodies * _discrete_layout(belt, 0.0).pitch
        if length >= taut:
            raise NoEquilibrium(
                f"the belt is slack: it is {length:.6g} m long unstretched, its path "
                f"{belt.path.length:.6g} m, and {taut:.6g} m as a polygon of {belt.bodies} "
                "bodies. Shorten it or move the pulleys apart"
            )


def _solve(
    belt: _Belt, phase: float, pretension: float | None, length: float | None
) -> _Evaluation:
    leave_saddles = phase == ASYMMETRIC_PHASE
    if pretension is not None:
        return _solve_for_tension(
            belt, _initial_guess(belt, pretension, phase), pretension, leave_saddles
        )
    assert length is not None
    # First near the length by way of the tension, which keeps the belt taut throughout.
    size = length / belt.bodies
    tension = belt.axial_rigidity * max(
        _discrete_layout(belt, 0.0).pitch / size - 1.0, MIN_STRAIN_GUESS
    )
    state = _initial_guess(belt, tension, phase)
    for _ in range(MAX_LENGTH_ITERATIONS):
        state = _solve_for_tension(belt, state, tension, leave_saddles).state
        if abs(state.length - size) <= 0.01 * (tension / belt.axial_rigidity) * size:
            break
        stretched = (belt.axial_rigidity + tension) * state.length
        tension = max(stretched / size - belt.axial_rigidity, 0.1 * tension)
    state = state._replace(length=size)
    return _minimum(belt, _held_parameters(belt, size, None), state, tension, leave_saddles)


def _solve_for_tension(
    belt: _Belt, state: _State, tension: float, leave_saddles: bool
) -> _Evaluation:
    """Find the minimum at a mean tension."""
    pull = tension * (1.0 + 0.5 * tension / belt.axial_rigidity)
    for _ in range(MAX_TENSION_ITERATIONS):
        evaluation = _minimum(
            belt, _held_parameters(belt, state.length, pull), state, tension, leave_saddles
        )
        state = evaluation.state
        mean = float(np.mean(_norms(evaluation.force)))
        residual = _residual(
            _gradient(belt, _held_parameters(belt, state.length, None), evaluation)
        )
        goal = _force_tolerance(belt, evaluation, tension)
        if abs(mean - tension) <= max(TENSION_TOLERANCE * tension, goal) and residual <= max(
            RESIDUAL * tension, goal
        ):
            return evaluation
        pull *= tension / mean
    raise NoEquilibrium(
        f"no rest position of the belt was found: its mean tension stays {mean - tension:.3g} N "
        f"off {tension:.6g} N, with a force of {residual:.3g} N unbalanced. Raise the pretension"
    )


def _held_parameters(belt: _Belt, length: float, pull: float | None) -> _HeldParameters:
    return _HeldParameters(
        belt.bending_rigidity / length, belt.mass_per_length * length * belt.gravity, pull
    )


class _DiscreteLayout(NamedTuple):
    """Bodies as tangents on the circles that their centres are pressed to."""

    path: Path
    pitch: float
    breakpoints: Array  # of the path, in lengths of bodies laid


def _discrete_layout(belt: _Belt, tension: float) -> _DiscreteLayout:
    pitch = belt.scale
    for _ in range(10):
        normal = tension * 2.0 * np.sin(np.arctan(0.5 * pitch / belt.radii))
        depth = 2.0 * normal / (belt.c2 + np.sqrt(belt.c2**2 + 4.0 * belt.c1 * normal))
        radii = belt.radii - depth
        path = _compressed_path(belt, tension, depth)
        # A body takes less of an arc than its own length.
        half = 0.5 * pitch / radii
        lengths = np.diff(path.breakpoints)
        lengths[1::2] *= np.roll(half / np.arctan(half), -1)
        breakpoints = np.concatenate([[0.0], np.cumsum(lengths)])
        pitch = float(breakpoints[-1]) / belt.bodies
    return _DiscreteLayout(path, pitch, breakpoints)


def _compressed_path(belt: _Belt, tension: float, depth: Array) -> Path:
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


def _initial_guess(belt: _Belt, tension: float, phase: float) -> _State:
    path, pitch, breakpoints = _discrete_layout(belt, tension)
    middle = 0.5 * (breakpoints[-2] + breakpoints[-1])
    places = (middle + phase * pitch) % pitch + pitch * np.arange(belt.bodies)
    line = path.at(np.interp(places, breakpoints, path.breakpoints))
    return _State(line.position, line.angle, pitch / (1.0 + tension / belt.axial_rigidity))


def _minimum(
    belt: _Belt, laws: _HeldParameters, state: _State, tension: float, leave_saddles: bool
) -> _Evaluation:
    """Minimise the energy; `settle`: leave a saddle rather than give up at one."""
    tolerance, shift = NEGATIVE_CURVATURE_TOL * belt.axial_rigidity / state.length, 0.0
    evaluation = _evaluate(belt, laws, state)
    for _ in range(MAX_NEWTON_STEPS):
        gradient = _gradient(belt, laws, evaluation)
        residual = _residual(gradient)
        if residual <= _force_tolerance(belt, evaluation, tension):
            break
        hessian = _hessian(belt, laws, evaluation)
        if not leave_saddles and residual <= NEAR_RESIDUAL * tension:
            _check_minimum(belt, hessian, tolerance)
        lower, shift = _damped_newton_step(belt, laws, evaluation, hessian, gradient, shift)
        if lower is None:
            break
        evaluation = lower
        _check_length(belt, evaluation.state.length)
        shift = 0.1 * shift if shift > tolerance else 0.0
    residual = _residual(_gradient(belt, laws, evaluation))
    if residual > max(ACCEPTABLE_RESIDUAL * tension, _force_tolerance(belt, evaluation, tension)):
        raise NoEquilibrium(
            f"no rest position of the belt was found: a force of {residual:.3g} N on a body stays "
            f"unbalanced at a tension of {tension:.6g} N. Raise the pretension or the number of "
            "bodies"
        )
    if not leave_saddles:
        _check_minimum(belt, _hessian(belt, laws, evaluation), tolerance)
    return evaluation


def _check_length(belt: _Belt, length: float) -> None:
    """Refuse a belt that has contracted off its pulleys, or hangs through without end."""
    if length < belt.scale / MAX_LENGTH_RATIO:
        shortest = float(np.min(belt.radii * [abs(arc.wrap_angle) for arc in belt.path.arcs]))
        raise NoEquilibrium(
            f"the belt slips off its pulleys: bodies of {belt.scale:.4g} m are too long for its "
            f"arcs, of which the shortest has {shortest:.4g} m, or the contact is too soft. Take "
            "more bodies or raise its stiffness"
        )
    if length > belt.scale * MAX_LENGTH_RATIO:
        raise NoEquilibrium(
            "the belt hangs through: its weight or its bending carries it further than the "
            "pretension can hold. Raise the pretension"
        )


def _check_minimum(belt: _Belt, hessian: _Hessian, tolerance: float) -> None:
    if _factors(belt, hessian, tolerance) is None:
        raise NoEquilibrium("the belt is at a saddle of its energy, and slides when touched")


def _damped_newton_step(
    belt: _Belt,
    laws: _HeldParameters,
    evaluation: _Evaluation,
    hessian: _Hessian,
    gradient: Array,
    shift: float,
) -> tuple[_Evaluation | None, float]:
    """Raise the shift of the Hessian until a step lowers the energy; None where none does."""
    stiffness = belt.axial_rigidity / evaluation.state.length
    while shift <= MAX_SHIFT * stiffness:
        lower = _step(belt, laws, evaluation, hessian, gradient, shift)
        if lower is not None:
            return lower, shift
        shift = max(4.0 * shift, NEGATIVE_CURVATURE_TOL * stiffness)
    return None, shift


def _step(
    belt: _Belt,
    laws: _HeldParameters,
    evaluation: _Evaluation,
    hessian: _Hessian,
    gradient: Array,
    shift: float,
) -> _Evaluation | None:
    """Make a step that lowers the energy; None where this shift of the Hessian gives none."""
    factors = _factors(belt, hessian, shift)
    if factors is None:
        return None
    step = _solve_banded(belt, factors, -gradient)
    trial = _evaluate(belt, laws, _apply_step(belt, evaluation.state, step))
    if _decreases(evaluation, trial):
        return trial
    # The bodies turn on a curve: what the straight step has left is of second order, and a second
    # step with the same matrix takes it away.
    left = _gradient(belt, laws, trial)
    left[:-1] += shift * step[:-1]
    trial = _evaluate(
        belt, laws, _apply_step(belt, evaluation.state, step - _solve_banded(belt, factors, left))
    )
    return trial if _decreases(evaluation, trial) else None


def _decreases(before: _Evaluation, after: _Evaluation) -> bool:
    change = float(np.sum(after.energies - before.energies))
    return change <= float_info.epsilon * float(np.sum(np.abs(before.energies)))


def _residual(gradient: Array) -> float:
    """Return the largest force; that on the length is one on all bodies."""
    return max(float(np.max(np.abs(gradient[:-1]))), 3.0 * abs(float(gradient[-1])) / gradient.size)


def _force_tolerance(belt: _Belt, evaluation: _Evaluation, tension: float) -> float:
    """Return the force to get below: what is sought, or what rounded coordinates leave."""
    unit = float(np.spacing(np.max(np.abs(evaluation.state.position))))
    stiffness = 2.0 * belt.axial_rigidity / evaluation.state.length
    stiffness += float(np.max(_radial_stiffness(belt, evaluation.contact)))
    return max(TARGET_RESIDUAL * tension, ROUNDING * stiffness * unit)


def _apply_step(belt: _Belt, state: _State, step: Array) -> _State:
    bodies, length = step[:-1].reshape(-1, 3), float(step[-1])
    excess = max(
        float(np.max(np.abs(bodies[:, :2]))) / (STEP_IN_RADII * float(np.min(belt.radii))),
        float(np.max(np.abs(bodies[:, 2]))) / (STEP_IN_ANGLE * belt.scale),
        abs(length) / (STEP_IN_LENGTH * state.length),
        1.0,
    )
    return _State(
        state.position + bodies[:, :2] / excess,
        state.angle + bodies[:, 2] / (excess * belt.scale),
        state.length + length / excess,
    )


def _norms(vectors: Array) -> Array:
    return np.hypot(vectors[:, 0], vectors[:, 1])


def _evaluate(belt: _Belt, laws: _HeldParameters, state: _State) -> _Evaluation:
    position, angle, length = state
    along = np.column_stack([np.cos(angle), np.sin(angle)])
    transverse_frequencies = np.column_stack([-along[:, 1], along[:, 0]])
    # The difference of neighbours is exact: only the rounding of the coordinates is left.
    gap = position - np.roll(position, 1, axis=0)
    gap -= 0.5 * length * (along + np.roll(along, 1, axis=0))
    add_bending = angle - np.roll(angle, 1)
    add_bending[0] += belt.path.total_turning
    contact = _contact(belt, position)
    # One for each body, so that a small change is not lost in the sum.
    energies = (
        0.5 * belt.axial_rigidity / length * np.sum(gap**2, axis=1)
        + 0.5 * laws.bending * add_bending**2
        + (belt.c1 * contact.depth / 3.0 + 0.5 * belt.c2) * contact.depth**2
        - position @ laws.weight
        + (laws.pull or 0.0) * length
    )
    force = belt.axial_rigidity / length * gap
    return _Evaluation(state, along, transverse_frequencies, force, add_bending, contact, energies)


def _contact(belt: _Belt, position: Array) -> _Contact:
    offsets = position[:, None, :] - belt.centers
    distances = np.hypot(offsets[..., 0], offsets[..., 1])
    pulley = np.argmax(belt.radii - distances, axis=1)
    row = np.arange(belt.bodies)
    distance = distances[row, pulley]
    depth = np.maximum(belt.radii[pulley] - distance, 0.0)
    normal = offsets[row, pulley] / distance[:, None]
    return _Contact(pulley, normal, distance, depth, (belt.c1 * depth + belt.c2) * depth)


def _gradient(belt: _Belt, laws: _HeldParameters, evaluation: _Evaluation) -> Array:
    """Return the derivatives by x, y and scale times angle of the bodies, last by the length."""
    force, moment = evaluation.force, laws.bending * evaluation.add_bending
    ahead = np.roll(force, -1, axis=0)
    bodies = np.empty((belt.bodies, 3))
    bodies[:, :2] = force - ahead - laws.weight
    bodies[:, :2] -= evaluation.contact.force[:, None] * evaluation.contact.normal
    bodies[:, 2] = moment - np.roll(moment, -1)
    bodies[:, 2] -= (
        0.5
        * evaluation.state.length
        * np.sum(evaluation.transverse_frequencies * (force + ahead), axis=1)
    )
    bodies[:, 2] /= belt.scale
    length = 0.0
    if laws.pull is not None:
        pulls = (_mean_direction(evaluation) + 0.5 / belt.axial_rigidity * force) * force
        length = belt.bodies * laws.pull - float(np.sum(pulls))
    return np.append(bodies, length)


def _mean_direction(evaluation: _Evaluation) -> Array:
    return 0.5 * (evaluation.along + np.roll(evaluation.along, 1, axis=0))


def _hessian(belt: _Belt, laws: _HeldParameters, evaluation: _Evaluation) -> _Hessian:
    n, c, h = belt.bodies, belt.axial_rigidity / evaluation.state.length, belt.scale
    arm, bending = 0.5 * evaluation.state.length / h, laws.bending / h**2
    forces = evaluation.force + np.roll(evaluation.force, -1, axis=0)
    own = np.zeros((n, 3, 3))
    own[:, :2, :2] = 2.0 * c * np.eye(2) + _contact_stiffness(belt, evaluation.contact)
    own[:, 2, 2] = arm / h * np.sum(evaluation.along * forces, axis=1)
    own[:, 2, 2] += 2.0 * (c * arm**2 + bending)
    before = np.roll(evaluation.transverse_frequencies, 1, axis=0)
    coupling = np.empty((n, 3, 3))  # of body k with body k - 1
    coupling[:, :2, :2] = -c * np.eye(2)
    coupling[:, :2, 2] = -c * arm * before
    coupling[:, 2, :2] = c * arm * evaluation.transverse_frequencies
    coupling[:, 2, 2] = (
        c * arm**2 * np.sum(evaluation.transverse_frequencies * before, axis=1) - bending
    )
    band = np.zeros((BAND + 1, 3 * n))
    band.flat[belt.layout.own] = own[:, LOWER[0], LOWER[1]].ravel()
    band.flat[belt.layout.coupling] = coupling.ravel()
    if laws.pull is None:
        return _Hessian(band, None, 0.0)
    change = -c * _mean_direction(evaluation) - evaluation.force / evaluation.state.length
    ahead = np.roll(change, -1, axis=0)
    border = np.empty((n, 3))
    border[:, :2] = change - ahead
    turning = forces + evaluation.state.length * (change + ahead)
    border[:, 2] = -0.5 / h * np.sum(evaluation.transverse_frequencies * turning, axis=1)
    return _Hessian(band, border[belt.layout.order].ravel(), float(np.sum(change**2)) / c)


def _radial_stiffness(belt: _Belt, contact: _Contact) -> Array:
    return np.where(contact.depth > 0.0, 2.0 * belt.c1 * contact.depth + belt.c2, 0.0)


def _contact_stiffness(belt: _Belt, contact: _Contact) -> Array:
    outward = contact.normal[:, :, None] * contact.normal[:, None, :]
    around = -contact.force / contact.distance
    radial = _radial_stiffness(belt, contact) - around
    return radial[:, None, None] * outward + around[:, None, None] * np.eye(2)


def _band_layout(n: int) -> _BandLayout:
    k = np.arange(n)
    place = np.minimum(2 * k, 2 * (n - k) - 1)
    start, inner = 3 * place, np.arange(3)
    own = (LOWER[0] - LOWER[1]) * 3 * n + start[:, None] + LOWER[1]
    row = (start[:, None] + inner)[:, :, None]
    column = (np.roll(start, 1)[:, None] + inner)[:, None, :]
    coupling = np.abs(row - column) * 3 * n + np.minimum(row, column)
    return _BandLayout(np.argsort(place), own.ravel(), coupling.ravel())


def _factors(belt: _Belt, hessian: _Hessian, shift: float) -> _Factors | None:
    """Factorise the shifted Hessian; None where it is not positive definite."""
    from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

    shifted = hessian.band.copy()
    shifted[0] += shift
    try:
        band = cholesky_banded(shifted, overwrite_ab=True, lower=True, check_finite=False)
    except LinAlgError:
        return None
    if hessian.border is None:
        return _Factors(band, None, None, 1.0)
    eliminated = cho_solve_banded((band, True), hessian.border, check_finite=False)
    corner = hessian.corner - float(hessian.border @ eliminated)
    return _Factors(band, hessian.border, eliminated, corner) if corner > 0.0 else None


def _solve_banded(belt: _Belt, factors: _Factors, right: Array) -> Array:
    from scipy.linalg import cho_solve_banded

    folded = right[:-1].reshape(-1, 3)[belt.layout.order].ravel()
    found = cho_solve_banded((factors.band, True), folded, check_finite=False)
    length = 0.0
    if factors.border is not None:
        length = (right[-1] - float(factors.border @ found)) / factors.corner
        found -= length * factors.eliminated
    step = np.empty((belt.bodies, 3))
    step[belt.layout.order] = found.reshape(-1, 3)
    return np.append(step, length)


def _result(belt: _Belt, evaluation: _Evaluation) -> Equilibrium:
    state, contact = evaluation.state, evaluation.contact
    pulley = np.where(contact.depth > 0.0, contact.pulley, -1)
    _check_all_pulleys_touched(belt, evaluation, pulley)
    rest = _gradient(belt, _held_parameters(belt, state.length, None), evaluation)[:-1].reshape(
        -1, 3
    )
    return Equilibrium(
        body_length=state.length,
        x=state.position[:, 0].copy(),
        y=state.position[:, 1].copy(),
        angle=state.angle,
        tension=_norms(evaluation.force),
        normal_force=contact.force,
        pulley=pulley,
        residual=float(np.max(_norms(rest[:, :2]))),
        residual_moment=float(np.max(np.abs(rest[:, 2]))) * belt.scale,
    )


def _check_all_pulleys_touched(belt: _Belt, evaluation: _Evaluation, pulley: Indices) -> None:
    """Refuse a pulley that lies between two bodies, or that the belt has jumped over."""
    normal, along = evaluation.contact.normal, evaluation.along
    sense = along[:, 1] * normal[:, 0] - along[:, 0] * normal[:, 1]
    for i, arc in enumerate(belt.path.arcs):
        if not np.any((pulley == i) & (sense * arc.wrap_angle > 0.0)):
            raise NoEquilibrium(
                f"no body of the belt rests on pulley {belt.pulleys[i].name}: bodies of "
                f"{belt.scale:.4g} m are too long for its arc of "
                f"{belt.radii[i] * abs(arc.wrap_angle):.4g} m, or the belt leaves it. Take more"
                " bodies or raise the pretension"
            )
