"""The belt at rest round its pulleys, without friction: where its energy, of `energy.py`, is least.

Newton's method finds it. The Hessian couples each body with its two neighbours, so that bodies
three apart share one complex step of the gradient, and SciPy's sparse LU factorises it. A belt
without friction slides round its pulleys until the corners of its polygon lie best; a layout that
is a mirror image of itself may be a saddle on that way as well as a minimum, so that two of them
are tried before a belt is left to slide. Where the pretension is given, secants find the length.

A belt that is guided on its line has one tension throughout. The quantities of a belt at rest tell
what friction could hold there as well.
"""

from collections.abc import Iterator
from contextlib import suppress
from math import exp, log, sin, tanh
from sys import float_info
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import ScenarioError
from frictionsim.mechanisms.belt_drive.belt import (
    LINEAR,
    QUADRATIC,
    RADIUS,
    Belt,
    belt_of,
    initial_positions,
    patch_of_bodies,
)
from frictionsim.mechanisms.belt_drive.energy import (
    Array,
    contact_stiffness,
    energies,
    gradient,
    normal_forces,
    shape_of,
    tensions,
)
from frictionsim.mechanisms.belt_drive.geometry import PathError, belt_path
from frictionsim.results import Quantities, Quantity
from frictionsim.scenario.signal_tables import held_value

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

# The largest unbalanced force over the tension: sought, and accepted.
TARGET_RESIDUAL, ACCEPTABLE_RESIDUAL, STRAIGHT_RESIDUAL = 1e-12, 1e-7, 1e-5
# What rounded coordinates leave of the force on a body, in its stiffness times a unit in the last
# place: half a unit of its own and of its neighbours, and a little for the arithmetic.
ROUNDING = 1.25
TENSION_TOLERANCE = 1e-10  # of the mean, relative
# Of c: a negative stiffness beyond the first part is that of a saddle, no rounding; shifts of the
# Hessian by more than the second make a step negligible.
LOWEST, MAX_SHIFT = 1e-11, 1e3
# The largest step: of the smallest radius, in rad, and of the length of a body.
STEP_IN_RADII, STEP_IN_ANGLE, STEP_IN_LENGTH = 0.2, 0.3, 0.2
GUESSES, MAX_NEWTON_STEPS, MAX_LENGTHS = 5, 300, 40
# Bodies from the middle of the first arc to a centre: two mirror images of themselves, and not.
PHASES = (0.0, 0.5, 0.25)
MAX_EXPONENT = log(float_info.max)
TINY = 1e-30  # a tension, N; a complex step over a length: nothing of it reaches the real part


class Rest(NamedTuple):
    """A belt at rest; arrays are (n,)."""

    body_length: float  # m, unstretched
    x: Array  # m, of the bodies' centres, in the order in which the belt leaves the first pulley
    y: Array
    angle: Array  # rad, continuous along the belt
    tension: Array  # N, of joint k, between the bodies k - 1 and k
    normal_force: Array  # N
    pulley: Any  # the index of the pulley that a body touches, -1 where none
    # N, the largest unbalanced force on a body: at most 1e-7 of the tension or, where that is more,
    # what rounding leaves: some 2 EA/l + c2 times a unit in the last place of a coordinate.
    residual: float


class NoEquilibrium(ValueError):
    """The belt does not rest on its pulleys, or its rest position was not found."""


def at_rest(scenario: "BeltDriveScenario") -> Rest:
    """Return the belt at rest, without friction.

    Raises
    ------
    ScenarioError
        A pulley that no body touches, no minimum of the energy found.
    """
    if scenario.guided:
        return _string_at_rest(scenario)
    try:
        for phase in PHASES[:-1]:
            with suppress(NoEquilibrium):
                return _rest(scenario, phase)
        return _rest(scenario, PHASES[-1])
    except NoEquilibrium as error:
        raise ScenarioError([f"mechanism.belt: {error}"]) from None


def _rest(scenario: "BeltDriveScenario", phase: float) -> Rest:
    """Return the rest position, and the length, that is found from one guess."""
    table, path_length = scenario.mechanism.belt, scenario.mechanism.path().length
    rigidity, given = table.axial_rigidity, table.length
    tension = table.pretension or rigidity * (path_length / (given or path_length) - 1.0)
    guess, u = _guess(scenario, tension, phase)
    length = given / table.bodies if given else guess
    last: tuple[float, float] | None = None
    straight = 0.0 if phase == PHASES[-1] else STRAIGHT_RESIDUAL * tension
    for _ in range(MAX_LENGTHS):
        belt = belt_of(scenario, length)
        u = _minimum(belt, u, tension, straight)
        found = float(np.mean(tensions(belt, shape_of(belt, u))))
        allowed = max(TENSION_TOLERANCE * tension, _tolerance(belt, u, tension))
        if given or abs(found - tension) <= allowed:
            if straight and _factors(_hessian(belt, u), LOWEST * belt.stiffness) is None:
                raise NoEquilibrium("the equilibrium is a saddle point: the belt is unstable")
            return _result(scenario, belt, u)
        # Secants of the logarithm: where a belt sags, its tension is about a power of its sag.
        off = log(max(found, TINY) / tension)
        slope = -(rigidity / max(found, tension) + 1.0) / length
        if last is not None:
            slope = min((last[1] - off) / (last[0] - length), -1.0 / length)
        last, largest = (length, off), STEP_IN_LENGTH * length
        length -= min(max(off / slope, -largest), largest)
    raise NoEquilibrium(
        f"no rest position of the belt was found: its mean tension stays {found - tension:.3g} N"
        f" off {tension:.6g} N. Raise the pretension"
    )


def _guess(scenario: "BeltDriveScenario", tension: float, phase: float) -> tuple[float, Array]:
    """Return the length of bodies, m, and where they are, (3, n), tangents on smaller circles.

    The circles are those that their centres are pressed to by a tension, N. `phase` is from the
    middle of the first arc to a centre, in bodies.
    """
    table, circles = scenario.mechanism.belt, scenario.mechanism.circles
    path = scenario.mechanism.path()
    spacing = path.length / table.bodies
    c1, c2, radii = belt_of(scenario, spacing).pul[[QUADRATIC, LINEAR, RADIUS]]
    for _ in range(GUESSES):
        force = 2.0 * tension * np.sin(np.arctan(0.5 * spacing / radii))
        depth = 2.0 * force / (c2 + np.sqrt(c2**2 + 4.0 * c1 * force))
        deepest = int(np.argmax(depth / radii))
        if depth[deepest] >= radii[deepest]:
            raise NoEquilibrium(
                f"a tension of {tension:.6g} N presses the belt {depth[deepest]:.4g} m deep into "
                f"pulley {circles[deepest].name}, more than its radius of {radii[deepest]:.6g} m: "
                "raise the stiffness of the contact"
            )
        smaller = zip(circles, radii - depth, strict=True)
        # A pulley that the belt barely touches may be lost so, though not in the end.
        with suppress(PathError):
            path = belt_path([circle._replace(radius=float(radius)) for circle, radius in smaller])
        # A body takes less of an arc than its own length.
        half = 0.5 * spacing / (radii - depth)
        lengths = np.diff(path.breakpoints)
        lengths[1::2] *= np.roll(half / np.arctan(half), -1)
        breakpoints = np.concatenate([[0.0], np.cumsum(lengths)])
        spacing = float(breakpoints[-1]) / table.bodies
    middle = 0.5 * (breakpoints[-2] + breakpoints[-1])
    places = (middle + phase * spacing) % spacing + spacing * np.arange(table.bodies)
    line = path.at(np.interp(places, breakpoints, path.breakpoints))
    length = spacing / (1.0 + tension / table.axial_rigidity)
    return length, np.vstack([line.position.T, line.angle])


# --- Newton's method ----------------------------------------------------------------------------


def _slope(belt: Belt, u: Array) -> Array:
    """Return the derivatives of the energy by x, y and l phi, (..., 3, n), N."""
    slope = gradient(belt, shape_of(belt, u))
    slope[..., 2, :] /= belt.length
    return slope


def _tolerance(belt: Belt, u: Array, tension: float) -> float:
    """Return the residual force that is sought, N: or what rounding of coordinates leaves."""
    pressed = float(np.max(normal_forces(belt, shape_of(belt, u))))
    stiffness = 2.0 * belt.stiffness + contact_stiffness(belt, pressed)
    unit = float(np.spacing(np.max(np.abs(u[:2]))))
    return max(TARGET_RESIDUAL * tension, ROUNDING * stiffness * unit)


def _minimum(belt: Belt, u: Array, tension: float, straight: float) -> Array:
    """Minimise the energy, from x, y and phi of the bodies.

    From a residual of `straight`, N, on the way leads to the nearest rest position, be it a saddle:
    rounding alone would decide on which side a belt slides off it.
    """
    lowest, shift = LOWEST * belt.stiffness, 0.0
    for _ in range(MAX_NEWTON_STEPS):
        slope = _slope(belt, u)
        residual = float(np.max(np.abs(slope)))
        if residual <= _tolerance(belt, u, tension):
            return u
        hessian = _hessian(belt, u)
        if residual <= straight and (factors := _factors(hessian, 0.0, True)) is not None:
            u = _moved(belt, u, factors.solve(-slope.ravel()).reshape(u.shape))
            continue
        lower = _lower(belt, u, slope, hessian, shift)
        while lower is None and shift <= MAX_SHIFT * belt.stiffness:
            shift = max(4.0 * shift, lowest)
            lower = _lower(belt, u, slope, hessian, shift)
        if lower is None:
            break
        u, shift = lower, 0.1 * shift if shift > lowest else 0.0
    if residual > max(ACCEPTABLE_RESIDUAL * tension, _tolerance(belt, u, tension)):
        raise NoEquilibrium(
            f"no rest position of the belt was found: a force of {residual:.3g} N on a body "
            f"stays unbalanced at a tension of {tension:.6g} N. Raise the pretension or the "
            "number of bodies"
        )
    return u


def _lower(belt: Belt, u: Array, slope: Array, hessian: Any, shift: float) -> Array | None:
    """Return bodies of less energy; None where this shift of the Hessian gives none."""
    factors = _factors(hessian, shift)
    if factors is None:
        return None
    here = energies(belt, shape_of(belt, u))
    rounding = float_info.epsilon * float(np.sum(np.abs(here)))
    step = factors.solve(-slope.ravel()).reshape(u.shape)
    trial = _moved(belt, u, step)
    gained = float(np.sum(energies(belt, shape_of(belt, trial)) - here))
    return trial if gained <= rounding else None


def _moved(belt: Belt, u: Array, step: Array) -> Array:
    """Return the bodies after a step, m, or after as much of it as is safe."""
    move = step / [[1.0], [1.0], [belt.length]]
    far = np.abs(move)
    excess = np.max(far[:2]) / (STEP_IN_RADII * np.min(belt.pul[RADIUS]))
    moved: Array = u + move / max(1.0, excess, np.max(far[2]) / STEP_IN_ANGLE)
    return moved


def _hessian(belt: Belt, u: Array) -> Any:
    """Return the second derivatives of the energy by x, y and l phi, a sparse matrix, N/m."""
    from scipy.sparse import csc_matrix

    n = u.shape[-1]
    body, coordinate = np.arange(n), np.arange(3)
    colour = body % 3
    colour[n - n % 3 :] = 3 + np.arange(n % 3)  # where the ring closes
    scale, step = np.array([1.0, 1.0, 1.0 / belt.length]), TINY * belt.length
    directions = np.zeros((colour.max() + 1, 3, 3, n))
    directions[colour[:, None], coordinate, coordinate, body[:, None]] = step * scale
    columns = _slope(belt, u + 1j * directions).imag / step
    # Of each body, each of its coordinates, and each coordinate of it and of its neighbours.
    near = (body[:, None, None, None] + [-1, 0, 1]) % n
    of, by = coordinate[:, None, None], coordinate[:, None]
    values = columns[colour[:, None, None, None], of, by, near]
    rows, of = np.broadcast_arrays(n * by + near, n * of + body[:, None, None, None])
    return csc_matrix((values.ravel(), (rows.ravel(), of.ravel())), (3 * n, 3 * n))


def _factors(hessian: Any, shift: float, indefinite: bool = False) -> Any:
    """Factorise the shifted Hessian; None where it is singular or, unless asked for, indefinite."""
    from scipy.sparse import identity
    from scipy.sparse.linalg import splu

    shifted = (hessian + shift * identity(hessian.shape[0])).tocsc() if shift else hessian
    # Pivots on the diagonal make of LU the LDL^T of a symmetric matrix, with the signs of D in U.
    options = {"SymmetricMode": True}
    try:
        factors = splu(shifted, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    except RuntimeError:  # singular
        return None
    definite = np.all(factors.U.diagonal() > 0.0) and np.all(factors.perm_r == factors.perm_c)
    return factors if definite or indefinite else None


def _result(scenario: "BeltDriveScenario", belt: Belt, u: Array) -> Rest:
    shape, slope, mechanism = shape_of(belt, u), _slope(belt, u), scenario.mechanism
    pulley = np.where(shape.depth > 0.0, shape.pulley, -1)
    sense = shape.sin * shape.normal_x - shape.cos * shape.normal_y
    path = mechanism.path()
    for j, arc in enumerate(path.arcs):
        # A pulley may lie between two bodies, or the belt have jumped over it.
        if not np.any((pulley == j) & (sense * arc.wrap_angle > 0.0)):
            raise NoEquilibrium(
                f"no body of the belt rests on pulley {mechanism.names[j]}: bodies of "
                f"{path.length / belt.n:.4g} m are too long for its arc of "
                f"{belt.pul[RADIUS, j] * abs(arc.wrap_angle):.4g} m, or the belt leaves it. Take "
                "more bodies or raise the pretension"
            )
    return Rest(
        belt.length,
        u[0],
        u[1],
        u[2],
        tensions(belt, shape),
        normal_forces(belt, shape),
        pulley,
        float(np.max(np.hypot(slope[0], slope[1]))),
    )


# --- a belt that is guided on its line ----------------------------------------------------------


def _string_at_rest(scenario: "BeltDriveScenario") -> Rest:
    table, path = scenario.mechanism.belt, scenario.mechanism.path()
    spacing = path.length / table.bodies
    length = None if table.length is None else table.length / table.bodies
    tension = table.pretension or table.axial_rigidity * (spacing / (length or spacing) - 1.0)
    points = path.at(initial_positions(path.length, table.bodies))
    starts, ends = path.arc_ends
    along = np.arange(table.bodies + 1) * spacing  # each point's part of the belt
    on_arc = np.diff(np.clip(along, starts[:, None], ends[:, None]), axis=1)
    curvature = np.array([1.0 / pulley.radius for pulley in scenario.mechanism.pulleys])
    return Rest(
        length or spacing / (1.0 + tension / table.axial_rigidity),
        points.position[:, 0],
        points.position[:, 1],
        points.angle,
        np.full(table.bodies, tension),
        tension * (curvature @ on_arc),
        np.where(on_arc.any(axis=0), np.argmax(on_arc, axis=0), -1),
        0.0,
    )


# --- quantities, and what friction could hold ----------------------------------------------------


def statics(scenario: "BeltDriveScenario") -> Quantities:
    """Return tension, lengths, wrap angles, loads and depths at rest, and what friction could hold.

    capstan_ratio is exp(mu_s wrap_angle), the largest ratio of the tensions on the two sides of a
    pulley, undefined beyond the largest number; torque_limit what it would transmit at the belt's
    pretension if its sides could share it freely: 2 T R (e - 1)/(e + 1) with e the ratio.
    """
    equilibrium, path = at_rest(scenario), scenario.mechanism.path()
    bodies = scenario.mechanism.belt.bodies
    tension = float(np.mean(equilibrium.tension))
    quantities = {
        "pretension": Quantity(tension, "N"),
        "tension_min": Quantity(float(np.min(equilibrium.tension)), "N"),
        "tension_max": Quantity(float(np.max(equilibrium.tension)), "N"),
        "path_length": Quantity(path.length, "m"),
        "belt_length": Quantity(equilibrium.body_length * bodies, "m"),
        "body_length": Quantity(equilibrium.body_length, "m"),
        "strain": Quantity(tension / scenario.mechanism.belt.axial_rigidity, "1"),
        "residual_force": Quantity(equilibrium.residual, "N"),
    }
    friction, loads = scenario.effects.belt_friction, _shaft_loads(scenario, equilibrium)
    for j, (pulley, arc) in enumerate(zip(scenario.mechanism.pulleys, path.arcs, strict=True)):
        name = pulley.name
        quantities[f"wrap_angle_{name}"] = Quantity(abs(arc.wrap_angle), "rad")
        quantities[f"shaft_load_{name}"] = Quantity(loads[j], "N")
        if not scenario.guided:
            on = equilibrium.pulley == j
            away = np.hypot(
                equilibrium.x[on] - pulley.center[0], equilibrium.y[on] - pulley.center[1]
            )
            depth = pulley.radius - float(np.mean(away))
            quantities[f"contact_depth_{name}"] = Quantity(depth, "m")
        if friction is not None:
            exponent = friction.pulleys.get(name, friction).mu_s * abs(arc.wrap_angle)
            ratio = exp(exponent) if exponent < MAX_EXPONENT else None
            quantities[f"capstan_ratio_{name}"] = Quantity(ratio, "1")
            limit = _torque_limit(tension, pulley.radius, exponent)
            quantities[f"torque_limit_{name}"] = Quantity(limit, "N m")
    return quantities


def _torque_limit(tension: float, radius: float, exponent: float) -> float:
    """Return 2 T R (e - 1)/(e + 1), N m, with e = exp(exponent)."""
    return 2.0 * tension * radius * tanh(0.5 * exponent)


def overloads(scenario: "BeltDriveScenario") -> Iterator[str]:
    """Say which torques, held up to the end of the run, no friction can balance.

    The limit is that of `statics`, which the pretension gives without an equilibrium. It holds for
    two pulleys, whose sides keep the sum of their tensions; several may share it otherwise.
    """
    if len(scenario.mechanism.pulleys) > 2:
        return
    friction, belt = scenario.effects.belt_friction, scenario.mechanism.belt
    path = scenario.mechanism.path()
    tension = belt.pretension or belt.axial_rigidity * (path.length / (belt.length or 1.0) - 1.0)
    for pulley, arc in zip(scenario.mechanism.pulleys, path.arcs, strict=True):
        drive = scenario.drive.get(pulley.name)
        torque = held_value(drive.torque, scenario.solver.duration) if drive else None
        if friction is None or torque is None:
            continue
        mu = friction.pulleys.get(pulley.name, friction).mu_s
        limit = _torque_limit(tension, pulley.radius, mu * abs(arc.wrap_angle))
        if abs(torque) > limit:
            yield (
                f"drive.{pulley.name}.torque = {torque:g} N m is beyond {limit:.4g} N m, what"
                f" friction balances at a pretension of {tension:.4g} N: no load keeps the speed"
                f" steady without slip of the whole belt on '{pulley.name}'; give less torque, or"
                " more pretension, friction or arc"
            )


def empty_patches(scenario: "BeltDriveScenario") -> Iterator[str]:
    """Say which patches no body of the belt has its middle in; of a belt that is not found none."""
    patches = scenario.effects.patches
    wide = 2.0 * scenario.mechanism.path().length / scenario.mechanism.belt.bodies
    if all(patch.end - patch.start > wide for patch in patches):
        return  # without the belt at rest, which takes time
    with suppress(ScenarioError):
        length = at_rest(scenario).body_length
        places = patch_of_bodies(scenario, length)
        for i in sorted({*range(len(patches))} - {*places}):
            yield (
                f"no body of the belt lies in effects.patch{f'.{i}' if len(patches) > 1 else ''},"
                f" {patches[i].start} to {patches[i].end} m: the patch changes nothing; make it"
                f" longer than a body, {length:.4g} m, on the belt's"
                f" {length * scenario.mechanism.belt.bodies:.4g} m"
            )


def _shaft_loads(scenario: "BeltDriveScenario", equilibrium: Rest) -> list[float]:
    """Return the force of the belt on each shaft, N."""
    arcs, loads = scenario.mechanism.path().arcs, []
    for j, (pulley, arc) in enumerate(zip(scenario.mechanism.pulleys, arcs, strict=True)):
        if scenario.guided:  # two pulls of one tension
            tension = float(equilibrium.tension[0])
            loads.append(2.0 * tension * abs(sin(0.5 * arc.wrap_angle)))
            continue
        on = equilibrium.pulley == j
        places = np.column_stack([equilibrium.x[on], equilibrium.y[on]]) - pulley.center
        normals = places / np.linalg.norm(places, axis=1, keepdims=True)
        loads.append(float(np.hypot(*(equilibrium.normal_force[on] @ normals))))
    return loads
