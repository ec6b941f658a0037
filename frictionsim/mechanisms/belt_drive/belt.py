"""A belt drive in SI units: parameters of its bodies and pulleys, and the rows that kernels write.

`Belt` is one flat tuple. What a scenario lacks is None in it: a kernel with such an argument is
compiled without that part.

Rows over bodies are `width` long: the bodies, a copy of the first one behind the last (it closes
the ring, so that no index wraps around), and what full vectors read beyond. Contacts have rows over
bodies as well, one for each pulley: a contact has the index of its body.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from frictionsim.mechanisms.belt_drive.slip import senses_of
from frictionsim.scenario.signal_tables import SpeedTable, signal_from
from frictionsim.scenario.signals import Signal, linear

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

BLOCK = 8  # numbers of double precision in the widest vector

# Rows of the kinematics in the plane, (6, width): m, rad, m/s, rad/s;
X, Y, PHI, VX, VY, SPIN = range(6)
# on a line, (2, width): the position along it, m, and the velocity, m/s.
POSITION, VELOCITY = range(2)

# Rows of `Belt.work`, (8, width). Of bodies: their directions. Of joints, joint k before body k:
# the force on body k - 1, N; the angle between its bodies, rad, and its rate, rad/s; the part of
# the force that is its damper's, N.
COS, SIN, FX, FY, BEND, RATE, DX, DY = range(8)
WORK_ROWS = 8
# On a line: the tension of joint k, N, and the middle between its bodies, m.
TENSION, MIDDLE = range(2)

# Rows of `Belt.con`, (17, pulleys, width), of each body at each pulley: the unit vector from the
# pulley's centre, the normal force, N, the slip, m/s, the bias g of the force that sticking needs,
# m (R x + g); the limits of T > 0 and T < 0, N or N s, T, and 1 where it is within its limits; the
# wrap factor kappa, and the mass that yields to T, m/kappa^2, kg;
NX, NY, NORMAL, SLIP, BIAS, FORWARD, BACKWARD, FRICTION, STICKING, KAPPA, YIELD = range(11)
# the mode, 0 where the static coefficient holds, else the direction of the slip, `NEW` where no
# body is near; the coefficients in force for T > 0 and T < 0; those at rest and in sliding;
MODE, MU_FORWARD, MU_BACKWARD, MU_S, MU_K = range(11, 16)
# by how much kappa v . t, m/s, grows from the middle of a fixed step to its end as t turns.
TURNED = 16
CONTACT_ROWS = 17
NEW = 2.0

# Rows of `Belt.pul`, (15, pulleys): centre and radius, m, moment of inertia, kg m^2; angular
# velocity, rad/s, and acceleration, rad/s^2; torque from outside, N m;
PX, PY, RADIUS, INERTIA, SPEED, ALPHA, TORQUE = range(7)
# its contact with a body: N/m^2, N/m, N s/m, 1/m; the sum of its friction on the belt, N or N s;
QUADRATIC, LINEAR, DAMPING, INV_FULL, PULL = range(7, 12)
# in fixed steps: the speed at the start of a step and at its end; 1 where it is given.
SPEED_OLD, SPEED_NEW, FIXED = range(12, 15)
PULLEY_ROWS = 15

# What a signal gives: a torque, N m, over time or over the speed of the pulley; a speed, rad/s.
TORQUE_OVER_TIME, TORQUE_OVER_SPEED, SPEED_OVER_TIME = range(3)

# Energies at the end of a state, J.
INPUT_ENERGY, FRICTION_HEAT, DAMPING_HEAT = range(3)
ENERGIES = 3

CLEAN = "clean"  # the name of the belt outside of patches

# Relaxation time of residual slip: in wave transits of a body, and at most, s. A tenth of it moved
# slip by 6e-4 and heat by 4e-4 at 150 bodies, slip by 2 % in overload, and by 8 % with pulleys of
# 7e-5 kg m^2: `moreau` has none.
RELAXATION_TRANSITS, MAX_RELAXATION_TIME = 1.5, 2e-5


class Line(NamedTuple):
    """The line that a guided string moves along."""

    length: float  # m
    # Of each pulley: where its arc begins, from where the belt leaves the first one, and the arc's
    # length, m; +1 where the belt passes it counter-clockwise, else -1.
    starts: Array
    arcs: Array
    senses: Array


class Belt(NamedTuple):
    """A belt drive as its kernels see it; None is what it lacks."""

    n: int  # bodies
    full: int  # the same up to full vectors
    width: int  # of a row
    # Where in a state the pulleys' angles, the speeds of the free ones, and the energies begin,
    # behind the kinematics; its length, up to full vectors, with the works of friction.
    angles: int
    speeds: int
    energies: int
    size: int
    mass: float  # kg, of a body
    inertia: float  # kg m^2
    half: float  # m, of the unstretched length of a body
    turning: float  # rad, of the belt in one round: 2 pi or -2 pi
    skin: float  # m; bodies so near to a rim or an arc are looked at until the next search
    stiffness: float  # N/m, of a joint along the belt
    damping: float | None  # N s/m
    # Up to which the damper of a joint acts in full, where fixed steps extrapolate velocities:
    # twice sin^2 of its angle with the mean direction of its bodies.
    obliquity: float | None
    bending: float | None  # 1/s^2, the stiffness of a joint over the inertia of a body
    bend_damping: float | None  # 1/s, likewise
    gravity: float | None  # m/s^2
    contact_damping: bool | None  # True where contacts have dampers
    wrap: bool | None  # True where slip is that of the material on the rim, not of the centre
    inv_tau: float | None  # 1/s; set-valued friction: the rate at which residual slip ends
    transition: float | None  # m/s; regularised: the slip at which it has its full size
    creep: float | None  # m, at which a contact at rest has its full friction
    creep_time: float | None  # s, in which it slips that; without it the length of the step
    work: Array  # rows of bodies and joints
    con: Array  # of contacts
    pul: Array  # of pulleys
    free: Indices  # pulleys that move freely
    prescribed: Indices  # those whose speed is given
    runs: Indices  # (runs, 3): pulley, first body and end of each run of bodies near a pulley
    n_runs: Indices  # (1,)
    # Signals, those of one pulley add: of each its pulley and kind; its pieces, sig_offset[k] to
    # sig_offset[k + 1] - 1, a knot and c0 to c3 of c0 + c1 (u - knot) + ... each; its amplitude,
    # angular frequency, rad/s, and phase.
    sig_pulley: Indices
    sig_kind: Indices
    sig_offset: Indices
    sig_piece: Array
    sig_wave: Array
    plane: bool | None  # True where bodies move in the plane
    line: Line | None  # where points are guided

    # What follows is for Python: kernels see the fields above.

    @property
    def length(self) -> float:
        """The unstretched length of a body, m."""
        return 2.0 * self.half

    @property
    def has_friction(self) -> bool:
        """Whether there is friction on the pulleys."""
        return self.inv_tau is not None or self.transition is not None

    @property
    def has_dampers(self) -> bool:
        """Whether anything but friction dissipates."""
        dampers = (self.damping, self.bend_damping, self.contact_damping)
        return any(damper is not None for damper in dampers)

    @property
    def distinct(self) -> bool:
        """Whether static and kinetic friction differ, and the law tells them apart."""
        return self.inv_tau is not None and not np.array_equal(self.con[MU_S], self.con[MU_K])

    @property
    def wear(self) -> bool | None:
        """True where states end with the works of friction, else None."""
        return True if self.size > _full(self.energies + ENERGIES) else None

    def works(self, state: Array) -> Array:
        """Return the work of friction of each body on each pulley, a view, (pulleys, width), J.

        Of no pulley without wear.
        """
        return state[_full(self.energies + ENERGIES) :].reshape(-1, self.width)

    def arrays(self) -> dict[str, Array | Indices]:
        """Return the rows that the next steps depend on, by name, for a checkpoint."""
        rows = {"contacts": self.con, "pulleys": self.pul}
        return {**rows, "runs": self.runs, "n_runs": self.n_runs}

    def kinematics(self, state: Array) -> Array:
        """Return the kinematics that a state, or its rate, begins with: a view, (rows, width)."""
        return state[: self.angles].reshape(-1, self.width)


def _full(count: int) -> int:
    """Return a count up to full vectors."""
    return -(-count // BLOCK) * BLOCK


def aligned(*shape: int) -> Array:
    """Return zeros that begin where the widest vector is loaded fastest."""
    size = int(np.prod(shape))
    spare = np.zeros(size + BLOCK)
    offset = -spare.ctypes.data // spare.itemsize % BLOCK
    return spare[offset : offset + size].reshape(shape)


def belt_of(scenario: "BeltDriveScenario", body_length: float) -> Belt:
    """Return the belt drive of a scenario with bodies of an unstretched length, m."""
    given, effects, guided = scenario.mechanism.belt, scenario.effects, scenario.guided
    pulleys, n = len(scenario.mechanism.pulleys), given.bodies
    full = _full(n)
    width = full + BLOCK
    mass = given.mass_per_length * body_length
    inertia = mass * body_length**2 / 12.0
    stiffness = given.axial_rigidity / body_length
    axial, bending, law = effects.axial_damping, effects.bending, effects.belt_friction
    damping = None
    if axial is not None:
        damping = axial.coefficient / (body_length if axial.basis == "section" else 1.0)
    prescribed = {name for name, drive in scenario.drive.items() if drive.speed is not None}
    is_given = np.array([name in prescribed for name in scenario.mechanism.names])
    free = np.flatnonzero(~is_given)
    pul, con = _pulleys(scenario), _contacts(scenario, body_length, width)
    pul[FIXED] = is_given
    angles = (2 if guided else 6) * width
    speeds = angles + pulleys
    energies = speeds + len(free)
    rows = _signals(scenario)
    pieces = [signal.pieces for *_, signal in rows]
    waves = [signal.harmonic or (0.0, 0.0, 0.0) for *_, signal in rows]
    set_valued = law is not None and law.law == "set-valued"
    transit = float(np.sqrt(mass / stiffness))
    return Belt(
        n=n,
        full=full,
        width=width,
        angles=angles,
        speeds=speeds,
        energies=energies,
        size=_full(energies + ENERGIES) + (0 if effects.wear is None else pulleys * width),
        mass=mass,
        inertia=inertia,
        half=0.5 * body_length,
        turning=scenario.mechanism.path().total_turning,
        skin=(2.0 if guided else 1.0) * body_length,
        stiffness=stiffness,
        damping=damping,
        obliquity=None,
        bending=None if bending is None else bending.rigidity / body_length / inertia,
        bend_damping=(bending.damping / body_length / inertia or None) if bending else None,
        gravity=None if effects.gravity is None else effects.gravity.g,
        contact_damping=True if pul[DAMPING].any() else None,
        wrap=True if given.wrap == "corrected" and not guided else None,
        inv_tau=1.0 / min(RELAXATION_TRANSITS * transit, MAX_RELAXATION_TIME)
        if set_valued
        else None,
        transition=None if law is None else law.transition_speed,
        creep=None if law is None else law.maximum_creep,
        creep_time=None if law is None else law.elementary_time,
        work=aligned(WORK_ROWS, width),
        con=con,
        pul=pul,
        free=free,
        prescribed=np.flatnonzero(is_given),
        runs=np.zeros((full // BLOCK * pulleys, 3), dtype=np.int64),
        n_runs=np.zeros(1, dtype=np.int64),
        sig_pulley=np.array([pulley for pulley, *_ in rows], dtype=np.int64),
        sig_kind=np.array([kind for _, kind, _ in rows], dtype=np.int64),
        sig_offset=np.cumsum([0, *map(len, pieces)], dtype=np.int64),
        sig_piece=np.array([piece for of in pieces for piece in of]).reshape(-1, 5),
        sig_wave=np.array(waves).reshape(-1, 3),
        plane=None if guided else True,
        line=_line(scenario) if guided else None,
    )


def _line(scenario: "BeltDriveScenario") -> Line:
    path = scenario.mechanism.path()
    starts, ends = path.arc_ends
    return Line(path.length, starts, ends - starts, senses_of(path))


def initial_state(belt: Belt, x: Array, y: Array, angle: Array) -> Array:
    """Return the state at the start, (size,): bodies at rest in these places, m and rad.

    Points on a line start half a distance behind where the belt leaves the first pulley.
    """
    state: Array = aligned(belt.size)
    kinematics = belt.kinematics(state)[:, : belt.n]
    if belt.line is None:
        kinematics[X], kinematics[Y], kinematics[PHI] = x, y, angle
    else:
        kinematics[POSITION] = initial_positions(belt.line.length, belt.n)
    return state


def initial_positions(length: float, points: int) -> Array:
    """Return where the points are at the start, m, on a line of a length."""
    positions: Array = (np.arange(points, dtype=np.float64) + 0.5) * (length / points)
    return positions


def _pulleys(scenario: "BeltDriveScenario") -> Array:
    """Return the pulleys' rows, with their contact with one body."""
    pulleys, contact = scenario.mechanism.pulleys, scenario.effects.contact
    pul = np.zeros((PULLEY_ROWS, len(pulleys)))
    for j, p in enumerate(pulleys):
        pul[[PX, PY, RADIUS, INERTIA], j] = *p.center, p.radius, p.inertia
        if contact is not None:
            bodies = scenario.mechanism.belt.bodies
            scale = (contact.reference_bodies or bodies) / bodies
            pul[QUADRATIC, j] = scale * contact.at(p.name, "c1")
            pul[LINEAR, j] = scale * contact.at(p.name, "c2")
            pul[DAMPING, j] = scale * contact.at(p.name, "damping")
            pul[INV_FULL, j] = 1.0 / contact.at(p.name, "p_max")
    return pul


def _contacts(scenario: "BeltDriveScenario", body_length: float, width: int) -> Array:
    """Return the contacts' rows, with coefficients of friction; a patch goes over the pulley's."""
    n, law = scenario.mechanism.belt.bodies, scenario.effects.belt_friction
    con = aligned(CONTACT_ROWS, len(scenario.mechanism.pulleys), width)
    con[MODE] = NEW
    if law is None:
        return con
    for j, name in enumerate(scenario.mechanism.names):
        own = law.pulleys.get(name, law)
        con[MU_S, j, :n], con[MU_K, j, :n] = own.mu_s, own.mu_k
    places = patch_of_bodies(scenario, body_length)
    for i, patch in enumerate(scenario.effects.patches):
        con[MU_S, :, :n][:, places == i], con[MU_K, :, :n][:, places == i] = patch.mu_s, patch.mu_k
    return con


def patch_of_bodies(scenario: "BeltDriveScenario", body_length: float) -> Indices:
    """Return the number of the patch that each body is in, (n,); -1 where it is in none."""
    centres = (np.arange(scenario.mechanism.belt.bodies) + 0.5) * body_length
    places = np.full(len(centres), -1)
    for i, patch in enumerate(scenario.effects.patches):
        places[(centres >= patch.start) & (centres < patch.end)] = i
    return places


def zones_of(scenario: "BeltDriveScenario", body_length: float) -> dict[str, NDArray[np.bool_]]:
    """Return which bodies are outside of patches, and in those of each name, (n,) each, by name."""
    places, patches = patch_of_bodies(scenario, body_length), scenario.effects.patches
    names = [CLEAN, *(patch.name for patch in patches)]
    of_bodies = np.array(names)[places + 1]
    return {name: of_bodies == name for name in dict.fromkeys(names)}


def _signals(scenario: "BeltDriveScenario") -> list[tuple[int, int, Signal]]:
    """Return the signals that drive the pulleys: pulley, kind, signal; each term of a sum."""
    rows: list[tuple[int, int, Signal]] = []
    for j, name in enumerate(scenario.mechanism.names):
        drive = scenario.drive.get(name)
        over_time = TORQUE_OVER_TIME if drive is None or drive.speed is None else SPEED_OVER_TIME
        for term in drive.terms if drive is not None else ():
            if isinstance(term, SpeedTable):
                rows.append((j, TORQUE_OVER_SPEED, linear(term.speed, term.value)))
            else:
                rows.append((j, over_time, signal_from(term)))
    return rows
