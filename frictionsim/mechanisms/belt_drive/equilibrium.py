"""The belt at rest round its pulleys, without friction.

At rest the energy of `energy.py` is least. Newton's method finds it; the Hessian couples each body
with its two neighbours, so that bodies three apart share one complex step of the gradient, and
SciPy's sparse LU factorises it. A belt without friction slides round its pulleys until the corners
of its polygon lie best; a layout that is a mirror image of itself may be a saddle on that way as
well as a minimum, so that two of them are tried before a belt is left to slide.

Where the pretension T is given, the length l of the bodies is sought as well. With m and EI/l
held, E + n T l is least in l too, where the joints pull with the mean T along the bodies; an outer
loop corrects m, EI/l and the T of this sum.

A belt that is guided on its line has one tension throughout.
"""

from contextlib import suppress
from functools import lru_cache
from sys import float_info
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import ScenarioError
from frictionsim.mechanisms.belt_drive.belt import initial_positions
from frictionsim.mechanisms.belt_drive.energy import (
    Array,
    Chain,
    Indices,
    Shape,
    chain_of,
    contact_stiffness,
    depth_under,
    energies,
    gradient,
    length_gradient,
    normal_forces,
    shape_of,
    tensions,
)
from frictionsim.mechanisms.belt_drive.geometry import Path, PathError, belt_path

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

# The largest unbalanced force over the tension: sought, well enough for the correction of the
# tension to end, accepted, and near enough to a rest position to tell a saddle from a minimum.
TARGET_RESIDUAL, RESIDUAL, ACCEPTABLE_RESIDUAL, SADDLE_RESIDUAL = 1e-10, 1e-9, 1e-7, 1e-5
# What rounded coordinates leave of the force on a body, in its stiffness times a unit in the last
# place: half a unit of its own and of its neighbours, and a little for the arithmetic.
ROUNDING = 1.25
TENSION_TOLERANCE = 1e-9  # of the mean, relative
# A saddle is told from rounding by a negative stiffness of this part of c.
NEGATIVE_CURVATURE = 1e-11
MAX_SHIFT = 1e3  # of the Hessian, over c: larger ones make the step negligible
# The largest step: of the smallest radius, in rad, and of the length of a body.
STEP_IN_RADII, STEP_IN_ANGLE, STEP_IN_LENGTH = 0.2, 0.3, 0.2
MAX_NEWTON_STEPS, MAX_TENSIONS = 300, 40
# No valid belt changes its body length, from that of the path, by more than this factor.
MAX_LENGTH_RATIO = 5.0
# Bodies from the middle of the first arc to a centre: mirror images of themselves, and not.
SYMMETRIC_PHASES, ASYMMETRIC_PHASE = (0.0, 0.5), 0.25
MIN_STRAIN_GUESS = 1e-4  # of a belt of given length
TINY = 1e-30  # complex step over a length: nothing of it reaches the real part


class Rest(NamedTuple):
    """A belt at rest.

    Attributes
    ----------
    body_length : float, m
        Unstretched.
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
        Largest unbalanced force on a body: at most 1e-7 of the tension or, where that is more,
        what rounding leaves: some 2 EA/l + c2 times a unit in the last place of a coordinate.
    """

    body_length: float
    x: Array
    y: Array
    angle: Array
    tension: Array
    normal_force: Array
    pulley: Indices
    residual: float


class Held(NamedTuple):
    """What stays fixed while the energy is minimised.

    Attributes
    ----------
    chain : Chain
        Mass and bending of the joints are those of its length, also where the length is sought.
    pull : float or None, N
        The force on the length of the bodies; None: they keep it.
    """

    chain: Chain
    pull: float | None


class NoEquilibrium(ValueError):
    """The belt does not rest on its pulleys, or its rest position was not found."""


def at_rest(scenario: "BeltDriveScenario") -> Rest:
    """Return the belt at rest, without friction.

    Raises
    ------
    ScenarioError
        A slack belt, a pulley that no body touches, no minimum of the energy found.
    """
    if scenario.guided:
        return _string_at_rest(scenario)
    search = Search(scenario)
    try:
        search.check_length()
        for phase in SYMMETRIC_PHASES:
            with suppress(NoEquilibrium):
                return search.rest(phase, leave_saddles=False)
        return search.rest(ASYMMETRIC_PHASE, leave_saddles=True)
    except NoEquilibrium as error:
        raise ScenarioError([f"mechanism.belt: {error}"]) from None


class Search:
    """The search for the rest position of a belt in the plane.

    Its unknowns, m, are x of all bodies, y, their angles times the spacing on the path and, where
    the pretension is given, the length of the bodies.
    """

    def __init__(self, scenario: "BeltDriveScenario") -> None:
        self._scenario, self._table = scenario, scenario.mechanism.belt
        self._path, self._circles = scenario.mechanism.path(), scenario.mechanism.circles
        self._bodies, self._rigidity = self._table.bodies, self._table.axial_rigidity
        self._spacing = self._path.length / self._bodies
        length = self._table.length or self._path.length
        self._guess_chain = chain_of(scenario, length / self._bodies)
        self._radii = self._guess_chain.radii

    # --- the guess ------------------------------------------------------------------------------

    def check_length(self) -> None:
        """Refuse a belt that is slack round its pulleys as a polygon of bodies."""
        length = self._table.length
        if length is not None and length >= (taut := self._bodies * self._laid(0.0)[1]):
            raise NoEquilibrium(
                f"the belt is slack: it is {length:.6g} m long unstretched, its path "
                f"{self._path.length:.6g} m, and {taut:.6g} m as a polygon of {self._bodies} "
                "bodies. Shorten it or move the pulleys apart"
            )

    def _laid(self, tension: float) -> tuple[Path, float, Array]:
        """Return how bodies lie on the pulleys at a tension, N, as tangents on smaller circles.

        The path round the circles that their centres are pressed to, their spacing, m, and the
        breakpoints of the path in lengths of bodies laid, m.
        """
        spacing = self._spacing
        for _ in range(10):
            force = tension * 2.0 * np.sin(np.arctan(0.5 * spacing / self._radii))
            depth = depth_under(self._guess_chain, force)
            path = self._compressed(tension, depth)
            # A body takes less of an arc than its own length.
            half = 0.5 * spacing / (self._radii - depth)
            lengths = np.diff(path.breakpoints)
            lengths[1::2] *= np.roll(half / np.arctan(half), -1)
            breakpoints = np.concatenate([[0.0], np.cumsum(lengths)])
            spacing = float(breakpoints[-1]) / self._bodies
        return path, spacing, breakpoints

    def _compressed(self, tension: float, depth: Array) -> Path:
        """Return the path round circles that are smaller by the depth of the contact."""
        deepest = int(np.argmax(depth / self._radii))
        if depth[deepest] >= self._radii[deepest]:
            raise NoEquilibrium(
                f"a tension of {tension:.6g} N presses the belt {depth[deepest]:.4g} m deep into "
                f"pulley {self._circles[deepest].name}, more than its radius of "
                f"{self._radii[deepest]:.6g} m: raise the stiffness of the contact"
            )
        smaller = [
            circle._replace(radius=circle.radius - float(p))
            for circle, p in zip(self._circles, depth, strict=True)
        ]
        # A pulley that the belt barely touches may be lost so, though not in the end.
        with suppress(PathError):
            return belt_path(smaller)
        return self._path

    def _guess(self, tension: float, phase: float) -> Array:
        """Return the unknowns at a tension, N, with the length.

        `phase` is from the middle of the first arc to a centre, in bodies.
        """
        path, spacing, breakpoints = self._laid(tension)
        middle = 0.5 * (breakpoints[-2] + breakpoints[-1])
        places = (middle + phase * spacing) % spacing + spacing * np.arange(self._bodies)
        line = path.at(np.interp(places, breakpoints, path.breakpoints))
        length = spacing / (1.0 + tension / self._rigidity)
        return np.concatenate([*line.position.T, line.angle * self._spacing, [length]])

    # --- energy and derivatives -----------------------------------------------------------------

    def _at(self, held: Held, v: Array, pulley: Indices | None = None) -> tuple[Chain, Shape]:
        """Return bodies and shape of the unknowns; `pulley`: the nearest of each body if known."""
        n, chain = self._bodies, held.chain
        if held.pull is not None:
            length: Any = v[..., -1:]
            chain = chain._replace(length=length, stiffness=self._rigidity / length)
        x, y, angle = v[..., :n], v[..., n : 2 * n], v[..., 2 * n : 3 * n] / self._spacing
        return chain, shape_of(chain, x, y, angle, pulley)

    def _energies(self, held: Held, v: Array) -> Array:
        """Return the energies to be least, with that of a force on the length of the bodies."""
        return energies(*self._at(held, v)) + (held.pull or 0.0) * v[-1]

    def _slope(self, held: Held, v: Array, pulley: Indices | None = None) -> Array:
        """Return the derivatives of their sum by the unknowns, N."""
        chain, shape = self._at(held, v, pulley)
        slope = gradient(chain, shape)
        slope[..., 2, :] /= self._spacing
        slope = slope.reshape(*v.shape[:-1], -1)
        if held.pull is None:
            return slope
        by_length = self._bodies * held.pull + length_gradient(chain, shape)
        return np.append(slope, by_length[..., None], axis=-1)

    def _hessian(self, held: Held, v: Array) -> Any:
        """Return the second derivatives, a sparse matrix."""
        from scipy.sparse import csc_matrix

        ring, step = ring_of(self._bodies), TINY * self._spacing
        directions = np.zeros((3 * ring.colours + (held.pull is not None), len(v)))
        directions[ring.direction, ring.unknown] = step
        if held.pull is not None:
            directions[-1, -1] = step
        nearest = self._at(held, v)[1].pulley
        columns = self._slope(held, v + 1j * directions, nearest).imag / step
        values = [columns[ring.direction[..., None], ring.rows[:, None]].ravel()]
        rows = [np.broadcast_to(ring.rows[:, None], (*ring.unknown.shape, 9)).ravel()]
        of = [np.repeat(ring.unknown.ravel(), 9)]
        if held.pull is not None:  # the length borders the bodies
            border, last = np.arange(len(v) - 1), np.full(len(v) - 1, len(v) - 1)
            values += [columns[-1, :-1], columns[-1]]
            rows += [last, np.arange(len(v))]
            of += [border, np.full(len(v), len(v) - 1)]
        places = ring.place[np.concatenate(rows)], ring.place[np.concatenate(of)]
        return csc_matrix((np.concatenate(values), places), (len(v), len(v)))

    def _solved(self, factors: Any, right: Array) -> Array:
        """Solve a factorised system for a right-hand side by the unknowns."""
        order = ring_of(self._bodies).order[: len(right)]
        solution = np.empty_like(right)
        solution[order] = factors.solve(right[order])
        return solution

    # --- Newton's method ------------------------------------------------------------------------

    def _lower(self, held: Held, v: Array, slope: Array, of: Any, shift: float) -> Array | None:
        """Return unknowns of less energy; None where this shift of the Hessian gives none."""
        factors = factorised(of, shift)
        if factors is None:
            return None
        here = self._energies(held, v)
        rounding = float_info.epsilon * float(np.sum(np.abs(here)))
        step = self._solved(factors, -slope)
        # The bodies turn on a curve: what the straight step has left is of second order, and a
        # second step with the same matrix takes it away.
        for again in (True, False):
            trial = self._moved(held, v, step)
            if float(np.sum(self._energies(held, trial) - here)) <= rounding:
                return trial
            if again:
                step = step - self._solved(factors, self._slope(held, trial) + shift * step)
        return None

    def _moved(self, held: Held, v: Array, step: Array) -> Array:
        """Return the unknowns after a step, or after as much of it as is safe."""
        n, far = self._bodies, np.abs(step)
        excess = [
            np.max(far[: 2 * n]) / (STEP_IN_RADII * np.min(self._radii)),
            np.max(far[2 * n : 3 * n]) / (STEP_IN_ANGLE * self._spacing),
        ]
        if held.pull is not None:
            excess.append(far[-1] / (STEP_IN_LENGTH * v[-1]))
        return v + step / max(1.0, *excess)

    def _residual(self, held: Held, slope: Array) -> float:
        """Return the largest force on a body, N; that on the length is one on all bodies."""
        forces = np.abs(slope)
        if held.pull is not None:
            forces[-1] /= self._bodies
        return float(np.max(forces))

    def _tolerance(self, held: Held, v: Array, tension: float) -> float:
        """Return the residual force that is sought: or what rounding of coordinates leaves."""
        pressed = float(np.max(normal_forces(*self._at(held, v))))
        stiffness = 2.0 * held.chain.stiffness + contact_stiffness(held.chain, pressed)
        unit = float(np.spacing(np.max(np.abs(v[: 2 * self._bodies]))))
        return max(TARGET_RESIDUAL * tension, ROUNDING * stiffness * unit)

    def _minimum(self, held: Held, v: Array, tension: float, leave_saddles: bool) -> Array:
        """Minimise the energy; leave a saddle, or give up at one."""
        lowest, shift = NEGATIVE_CURVATURE * held.chain.stiffness, 0.0
        for _ in range(MAX_NEWTON_STEPS):
            slope = self._slope(held, v)
            residual = self._residual(held, slope)
            if residual <= self._tolerance(held, v, tension):
                break
            of = self._hessian(held, v)
            if not leave_saddles and residual <= SADDLE_RESIDUAL * tension:
                self._check_minimum(held, of)
            lower = self._lower(held, v, slope, of, shift)
            while lower is None and shift <= MAX_SHIFT * held.chain.stiffness:
                shift = max(4.0 * shift, lowest)
                lower = self._lower(held, v, slope, of, shift)
            if lower is None:
                break
            v, shift = lower, 0.1 * shift if shift > lowest else 0.0
            if held.pull is not None:
                self._check_size(v[-1])
        residual = self._residual(held, self._slope(held, v))
        if residual > max(ACCEPTABLE_RESIDUAL * tension, self._tolerance(held, v, tension)):
            raise NoEquilibrium(
                f"no rest position of the belt was found: a force of {residual:.3g} N on a body "
                f"stays unbalanced at a tension of {tension:.6g} N. Raise the pretension or the "
                "number of bodies"
            )
        return v

    def _check_minimum(self, held: Held, of: Any) -> None:
        if factorised(of, NEGATIVE_CURVATURE * held.chain.stiffness) is None:
            raise NoEquilibrium("the equilibrium is a saddle point: the belt is unstable")

    # --- the length -----------------------------------------------------------------------------

    def rest(self, phase: float, leave_saddles: bool) -> Rest:
        """Return the minimum that is found from one guess."""
        if self._table.pretension is not None:
            held, v = self._of_pretension(self._table.pretension, phase, leave_saddles)
        else:
            held, v = self._of_length(phase, leave_saddles)
        if not leave_saddles:
            self._check_minimum(held, self._hessian(held, v))
        return self._result(held.chain, v[: 3 * self._bodies])

    def _of_length(self, phase: float, leave_saddles: bool) -> tuple[Held, Array]:
        """Find the rest position of a belt of given length."""
        size = self._guess_chain.length
        strain = self._laid(0.0)[1] / size - 1.0
        tension = self._rigidity * max(strain, MIN_STRAIN_GUESS)
        held, guess = Held(self._guess_chain, None), self._guess(tension, phase)[:-1]
        return held, self._minimum(held, guess, tension, leave_saddles)

    def _of_pretension(
        self, wanted: float, phase: float, leave_saddles: bool
    ) -> tuple[Held, Array]:
        """Find the rest position, and the length, of a belt with this mean tension, N."""
        v, pull = self._guess(wanted, phase), wanted * (1.0 + 0.5 * wanted / self._rigidity)
        held = Held(chain_of(self._scenario, float(v[-1])), pull)
        for _ in range(MAX_TENSIONS):
            v = self._minimum(held, v, wanted, leave_saddles)
            free = Held(chain_of(self._scenario, float(v[-1])), None)
            tension = float(np.mean(tensions(*self._at(free, v))))
            residual = self._residual(free, self._slope(free, v[:-1]))
            allowed = self._tolerance(free, v, wanted)
            near = abs(tension - wanted) <= max(TENSION_TOLERANCE * wanted, allowed)
            if near and residual <= max(RESIDUAL * wanted, allowed):
                return Held(free.chain, pull), v
            pull *= wanted / tension
            held = Held(free.chain, pull)
        raise NoEquilibrium(
            f"no rest position of the belt was found: its mean tension stays "
            f"{tension - wanted:.3g} N off {wanted:.6g} N, with a force of {residual:.3g} N "
            "unbalanced. Raise the pretension"
        )

    def _check_size(self, size: float) -> None:
        """Refuse a belt that has contracted off its pulleys, or sags without limit."""
        if size < self._spacing / MAX_LENGTH_RATIO:
            shortest = float(np.min(self._radii * [abs(a.wrap_angle) for a in self._path.arcs]))
            raise NoEquilibrium(
                f"the belt slips off its pulleys: bodies of {self._spacing:.4g} m are too long for "
                f"its arcs, of which the shortest has {shortest:.4g} m, or the contact is too soft."
                " Take more bodies or raise its stiffness"
            )
        if size > self._spacing * MAX_LENGTH_RATIO:
            raise NoEquilibrium(
                "the belt sags without limit: its weight or its bending exceeds what the "
                "pretension can carry. Raise the pretension"
            )

    # --- the result -----------------------------------------------------------------------------

    def _result(self, chain: Chain, v: Array) -> Rest:
        held, n = Held(chain, None), self._bodies
        shape, slope = self._at(held, v)[1], self._slope(held, v)
        pulley = np.where(shape.depth > 0.0, shape.pulley, -1)
        sense = shape.sin * shape.normal_x - shape.cos * shape.normal_y
        for j, arc in enumerate(self._path.arcs):
            # A pulley may lie between two bodies, or the belt have jumped over it.
            if not np.any((pulley == j) & (sense * arc.wrap_angle > 0.0)):
                raise NoEquilibrium(
                    f"no body of the belt rests on pulley {self._circles[j].name}: bodies of "
                    f"{self._spacing:.4g} m are too long for its arc of "
                    f"{self._radii[j] * abs(arc.wrap_angle):.4g} m, or the belt leaves it. Take "
                    "more bodies or raise the pretension"
                )
        return Rest(
            chain.length,
            v[:n].copy(),
            v[n : 2 * n].copy(),
            v[2 * n :] / self._spacing,
            tensions(chain, shape),
            normal_forces(chain, shape),
            pulley,
            float(np.max(np.hypot(slope[:n], slope[n : 2 * n]))),
        )


class Ring(NamedTuple):
    """Which unknowns of a ring of n bodies share a step, and where their forces are.

    Attributes
    ----------
    colours : int
        No body has one of its neighbours, or a neighbour of these, of its own colour.
    direction, unknown : (n, 3)
        For x, y and angle of each body the number of the step, and that of the unknown.
    rows : (n, 9)
        The unknowns of the body and of both neighbours.
    order, place : (3 n + 1,)
        The unknowns in the order of the Hessian, and the place of each in it: body by body, those
        of a ring folded flat, 0, n - 1, 1, n - 2, ..., so that the Hessian is a narrow band; last
        the length.
    """

    colours: int
    direction: Indices
    unknown: Indices
    rows: Indices
    order: Indices
    place: Indices


@lru_cache(maxsize=4)
def ring_of(n: int) -> Ring:
    """Return the ring of n bodies, at least 4."""
    body, coordinate = np.arange(n)[:, None], np.arange(3)
    colour = np.arange(n) % 3
    colour[n - n % 3 :] = 3 + np.arange(n % 3)  # where the ring closes
    near = (body + np.array([-1, 0, 1])) % n
    rows = (near[:, :, None] + n * coordinate).reshape(n, 9)
    folded = np.argsort(np.minimum(2 * np.arange(n), 2 * (n - np.arange(n)) - 1))
    order = np.append(folded[:, None] + n * coordinate, 3 * n)
    direction, unknown = 3 * colour[:, None] + coordinate, body + n * coordinate
    return Ring(int(colour.max()) + 1, direction, unknown, rows, order, np.argsort(order))


def factorised(hessian: Any, shift: float) -> Any:
    """Factorise the shifted Hessian; None where it is not positive definite."""
    from scipy.sparse import identity
    from scipy.sparse.linalg import splu

    shifted = (hessian + shift * identity(hessian.shape[0])).tocsc() if shift else hessian
    # Pivots on the diagonal make of LU the LDL^T of a symmetric matrix, with the signs of D in U.
    options = {"SymmetricMode": True}
    try:
        factors = splu(shifted, "NATURAL", diag_pivot_thresh=0.0, options=options)
    except RuntimeError:  # singular
        return None
    definite = np.all(factors.U.diagonal() > 0.0) and np.all(factors.perm_r == factors.perm_c)
    return factors if definite else None


# --- a belt that is guided on its line --------------------------------------------------------


def _string_at_rest(scenario: "BeltDriveScenario") -> Rest:
    belt, path = scenario.mechanism.belt, scenario.mechanism.path()
    spacing = path.length / belt.bodies
    tension, length = belt.pretension, belt.length
    if tension is None:
        assert length is not None  # one of them is given
        tension = belt.axial_rigidity * (path.length / length - 1.0)
    body_length = spacing / (1.0 + tension / belt.axial_rigidity)
    points = path.at(initial_positions(path.length, belt.bodies))
    # Each point's part of the belt on each arc; the arc of the first pulley is the last one.
    starts, ends = np.roll(path.breakpoints[1:-1:2], 1), np.roll(path.breakpoints[2::2], 1)
    along = np.arange(belt.bodies + 1) * spacing
    on_arc = np.diff(np.clip(along, starts[:, None], ends[:, None]), axis=1)
    curvature = np.array([1.0 / pulley.radius for pulley in scenario.mechanism.pulleys])
    return Rest(
        body_length if length is None else length / belt.bodies,
        points.position[:, 0],
        points.position[:, 1],
        points.angle,
        np.full(belt.bodies, tension),
        tension * (curvature @ on_arc),
        np.where(on_arc.any(axis=0), np.argmax(on_arc, axis=0), -1),
        0.0,
    )
