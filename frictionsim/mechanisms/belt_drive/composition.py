"""From a scenario to the arrays that the kernels step, in the plane or guided on a line."""

from collections import namedtuple
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive import stability_limits
from frictionsim.mechanisms.belt_drive.effects import EFFECTS, in_order
from frictionsim.mechanisms.belt_drive.effects.base import Belt, BeltEffect, Chain, Shape
from frictionsim.mechanisms.belt_drive.effects.contact import stiffness_under
from frictionsim.mechanisms.belt_drive.effects.patch import patch_bodies
from frictionsim.mechanisms.belt_drive.equilibrium import (
    Equilibrium,
)
from frictionsim.mechanisms.belt_drive.kernels.layout import (
    ANGLE,
    BACKWARD,
    CENTRE_X,
    CENTRE_Y,
    CONTACT_ROWS,
    FORWARD,
    INERTIA,
    KINEMATIC_ROWS,
    KINETIC,
    MODE,
    PULLEY_RADIUS,
    PULLEY_ROWS,
    PULLEY_X,
    PULLEY_Y,
    RADIUS,
    SIMD_WIDTH,
    SPIN,
    STATIC,
    STICKING,
    STRING_ROWS,
    STRING_WORKSPACE_ROWS,
    VX,
    VY,
    WORKSPACE_ROWS,
    StateLayout,
    X,
    Y,
    aligned_zeros,
    kinematics_of,
    state_layout,
)
from frictionsim.mechanisms.belt_drive.kernels.signals import (
    SPEED_OVER_TIME,
    TORQUE_OVER_SPEED,
    TORQUE_OVER_TIME,
    Signals,
    stack_signals,
)
from frictionsim.mechanisms.belt_drive.kernels.system import (
    Contacts,
    FrictionCoefficients,
    PitchLine,
    Pulleys,
    System,
)
from frictionsim.mechanisms.belt_drive.kernels.wrap import wrap_factors
from frictionsim.scenario.signal_tables import SpeedTable, signal_from
from frictionsim.scenario.signals import PiecewiseLinear, Signal
from frictionsim.solvers.state_values import (
    DIRECTION,
    FLAG,
    NON_NEGATIVE,
    Expected,
    FixedRows,
    Rows,
    Values,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

    Array = npt.NDArray[np.float64]
    ComplexArray = npt.NDArray[np.complex128]
    Indices = npt.NDArray[np.int64]


# The parameters of each effect, by its name.
EffectParameters: Any = namedtuple("EffectParameters", [e.key for e in EFFECTS])  # type: ignore[misc]


class BeltModel(NamedTuple):
    """A belt drive ready to be stepped.

    Attributes
    ----------
    system : System
    distinct_static_friction : bool
        Static and kinetic friction differ and the law tells them apart.
    equilibrium : Equilibrium
    state : (size,)
        At the start: at rest, no friction yet.
    error_scales : (size,)
        What an error in each state is measured by; infinite for energies.
    """

    system: System
    distinct_static_friction: bool
    equilibrium: Equilibrium
    state: "Array"
    error_scales: "Array"

    @property
    def present_effects(self) -> list[tuple[BeltEffect, Any]]:
        """The effects that the scenario has, in the order of their forces, with parameters."""
        found = ((effect, getattr(self.system.effects, effect.key)) for effect in in_order())
        return [(effect, parameters) for effect, parameters in found if parameters is not None]

    def kinetic_energy(self, kinematics: "Array", speeds: "Array") -> float:
        """Return the kinetic energy of bodies and pulleys, J.

        Of the `kinematics` of the bodies, (6, n), and the speeds of all pulleys, (pulleys,), rad/s.
        """
        chain, inertia = self.system.chain, self.system.pulleys.table[INERTIA]
        linear = chain.mass * np.sum(kinematics[VX] ** 2 + kinematics[VY] ** 2)
        turning = chain.inertia * np.sum(kinematics[SPIN] ** 2) + np.sum(inertia * speeds**2)
        return float(0.5 * (linear + turning))

    def potential_energy(self, kinematics: "Array") -> float:
        """Return the energy of all effects that store one, J, for the kinematics (6, n)."""
        pulley = self.system.pulleys.table
        shape = Shape(
            self.system.chain,
            kinematics[[X, Y]].T,
            kinematics[ANGLE],
            pulley[[PULLEY_X, PULLEY_Y]].T,
            pulley[PULLEY_RADIUS],
        )
        return float(sum(np.sum(e.energies(found, shape)) for e, found in self.present_effects))

    @property
    def max_frequency_and_decay(self) -> tuple[float, float]:
        """The highest angular frequency and decay rate of the belt, rad/s and 1/s."""
        return stability_limits.max_frequency_and_decay(self.system, self.equilibrium)

    @property
    def eigenvalues(self) -> "ComplexArray":
        """The eigenvalues of its waves and of its friction, (m,), 1/s."""
        return stability_limits.eigenvalues(self.system, self.equilibrium)

    @property
    def contact_stiffness(self) -> float:
        """dN/dp of a contact that is pressed deeper than any is at rest, N/m."""
        return contact_stiffness(self.system.effects, self.equilibrium)

    def contact_state(self) -> dict[str, Any]:
        """Return the state of the contacts between steps, by name."""
        contacts, pulleys = self.system.contacts, self.system.pulleys
        return {
            "contact_offsets": contacts.offsets,
            "contact_bodies": contacts.body,
            "contacts": contacts.table,
            "release": contacts.release,
            "pulleys": pulleys.table,
        }

    def contact_values(self) -> dict[str, Expected]:
        """Return the valid values of the arrays of `contact_state`, by name."""
        return contact_values(self.system)

    def contact_fault(self) -> str:
        """Return the array of `contact_state` that does not go with the others; empty if all do."""
        return block_fault(self.system)


def compose(
    scenario: "BeltDriveScenario", body_length: float, line: PitchLine | None = None
) -> System:
    """Return the system of a belt drive with bodies of a length, m, in the plane or on a line."""
    chain, pulleys = chain_of(scenario, body_length), _pulleys(scenario)
    count = pulleys.table.shape[1]
    kinematic_rows = KINEMATIC_ROWS if line is None else STRING_ROWS
    workspace_rows = WORKSPACE_ROWS if line is None else STRING_WORKSPACE_ROWS
    layout = state_layout(chain.bodies, count, len(pulleys.free), kinematic_rows)
    corrected = line is None and scenario.mechanism.belt.wrap == "corrected"
    return System(
        layout,
        chain,
        effect_parameters(scenario, chain),
        _friction_coefficients(scenario, chain),
        _signals(scenario),
        aligned_zeros(workspace_rows, layout.width),
        _contacts(layout, count, corrected),
        pulleys,
        line,
    )


def distinct_static_friction(system: System) -> bool:
    """Return whether static and kinetic friction differ and the law tells them apart."""
    law, friction = system.effects.belt_friction, system.friction
    if friction is None or law.set_valued is None:
        return False
    return not np.array_equal(friction.static, friction.kinetic)


def chain_of(scenario: "BeltDriveScenario", body_length: float) -> Chain:
    """Return the common data of bodies of this length, m."""
    belt = scenario.mechanism.belt
    mass = belt.mass_per_length * body_length
    inertia = mass * body_length**2 / 12.0
    return Chain(belt.bodies, body_length, mass, inertia, scenario.mechanism.path().total_turning)


def effect_parameters(scenario: "BeltDriveScenario", chain: Chain) -> Any:
    """Return the parameters of each effect, None for those that the scenario lacks."""
    belt = Belt(chain, scenario.mechanism.belt.axial_rigidity, scenario.mechanism.names)
    tables = (getattr(scenario.effects, effect.key) for effect in EFFECTS)
    return EffectParameters(
        *(effect.parameters(table, belt) for effect, table in zip(EFFECTS, tables, strict=True))
    )


def _pulleys(scenario: "BeltDriveScenario") -> Pulleys:
    pulleys = scenario.mechanism.pulleys
    prescribed = {name for name, drive in scenario.drive.items() if drive.speed is not None}
    table = np.zeros((PULLEY_ROWS, len(pulleys)))
    for j, p in enumerate(pulleys):
        table[:4, j] = *p.center, p.radius, p.inertia
    given = np.array([p.name in prescribed for p in pulleys])
    return Pulleys(np.flatnonzero(~given), np.flatnonzero(given), table)


def _contacts(layout: StateLayout, pulleys: int, corrected: bool) -> Contacts:
    """Return room for as many candidates as there could ever be: all bodies."""
    size = layout.width * pulleys + SIMD_WIDTH
    return Contacts(
        np.zeros(pulleys + 1, dtype=np.int64),
        np.zeros(size, dtype=np.uint64),  # an index that is never negative needs no check
        aligned_zeros(CONTACT_ROWS, size),
        np.zeros((2, layout.width)),
        np.zeros(1),
        wrap_factors(size) if corrected else None,
    )


def _friction_coefficients(
    scenario: "BeltDriveScenario", chain: Chain
) -> FrictionCoefficients | None:
    """Return the coefficients of every body at every pulley; a patch goes over the pulley's."""
    law, patch = scenario.effects.belt_friction, scenario.effects.patch
    if law is None:
        return None
    static = np.empty((len(scenario.mechanism.pulleys), chain.bodies))
    kinetic = np.empty_like(static)
    for j, name in enumerate(scenario.mechanism.names):
        own = law.pulleys.get(name, law)
        static[j], kinetic[j] = own.mu_s, own.mu_k
    if patch is not None:
        inside = patch_bodies(patch, chain)
        static[:, inside], kinetic[:, inside] = patch.mu_s, patch.mu_k
    return FrictionCoefficients(static, kinetic)


def _signals(scenario: "BeltDriveScenario") -> Signals:
    """Return the signals that drive the pulleys, a row for each term of a sum."""
    rows: list[tuple[int, int, Signal]] = []
    for j, name in enumerate(scenario.mechanism.names):
        drive = scenario.drive.get(name)
        over_time = TORQUE_OVER_TIME if drive is None or drive.speed is None else SPEED_OVER_TIME
        for term in drive.terms if drive is not None else ():
            if isinstance(term, SpeedTable):
                rows.append((j, TORQUE_OVER_SPEED, PiecewiseLinear(term.speed, term.value)))
            else:
                rows.append((j, over_time, signal_from(term)))
    return stack_signals(rows)


def contact_stiffness(effects: Any, equilibrium: Equilibrium) -> float:
    """Return dN/dp of a contact that is pressed deeper than any is at rest, N/m."""
    force = stability_limits.max_normal_force(equilibrium)
    return stiffness_under(effects.contact, force)


# The error of a body's rotation counts a tenth of that of its place over its length: the ends that
# it moves across a joint change the joint's length, and so its tension, in second order only.
ROTATION_TOLERANCE = 10.0


def error_scales(equilibrium: Equilibrium, system: System) -> "Array":
    """Return the size of each state that its error is measured by, (size,)."""
    layout, mass = system.layout, system.chain.mass
    stiffness = system.effects.axial_damping.stiffness
    radius = float(np.min(system.pulleys.table[PULLEY_RADIUS]))
    stretch = float(np.mean(equilibrium.tension)) / stiffness
    speed = stretch * float(np.sqrt(stiffness / mass))
    sizes: tuple[float, ...] = (stretch, speed)
    if system.line is None:
        # What is the smaller of the two decides how exactly positions have to be known.
        contact = contact_stiffness(system.effects, equilibrium)
        depth = float(np.max(equilibrium.normal_force, initial=0.0)) / contact
        stretch, speed = min(stretch, depth), min(speed, depth * float(np.sqrt(contact / mass)))
        turning = ROTATION_TOLERANCE / system.chain.length
        sizes = (stretch, stretch, turning * stretch, speed, speed, turning * speed)
    scales = np.full(layout.size, np.inf)
    kinematics_of(scales, layout)[:] = np.array([sizes]).T
    scales[layout.angles : layout.speeds] = stretch / radius
    scales[layout.speeds : layout.energies] = speed / radius
    return scales


# --- what the contacts may hold in a checkpoint, before a kernel takes it for indices -----------


def contact_values(system: "System") -> dict[str, Expected]:
    """Return the valid values of the arrays of `BeltModel.contact_state`, by name."""
    capacity, width = len(system.contacts.body), system.layout.width
    largest = float(np.max(system.pulleys.table[PULLEY_RADIUS]))
    coefficients = dict.fromkeys((STATIC, KINETIC, FORWARD, BACKWARD), NON_NEGATIVE)
    candidates = {RADIUS: Values(0.0, largest), MODE: DIRECTION, STICKING: FLAG}
    return {
        "contact_offsets": Values(0.0, capacity, whole=True, ascending=True),
        "contact_bodies": Values(0.0, width - SIMD_WIDTH - 1, whole=True),
        "contacts": Rows({**candidates, **coefficients}),
        "release": NON_NEGATIVE,
        "pulleys": FixedRows(system.pulleys.table[: INERTIA + 1].copy()),
    }


def offsets_fault(system: "System") -> str:
    """Return the array that cannot divide candidates by their pulleys, in full vectors."""
    offsets = system.contacts.offsets
    return "contact_offsets" if offsets[0] != 0 or np.any(offsets % SIMD_WIDTH) else ""


def block_fault(system: "System") -> str:
    """Return the array that does not go with the others, of bodies that move in the plane.

    The candidates of a pulley are blocks of neighbours, each at most once, and some of each block
    are near the pulley: their radius is that of it.
    """
    if fault := offsets_fault(system):
        return fault
    contacts, pulleys, bodies = system.contacts, system.pulleys.table, system.layout.bodies
    count = int(contacts.offsets[-1])
    pulley = np.repeat(np.arange(pulleys.shape[1]), np.diff(contacts.offsets))
    blocks = contacts.body[:count].astype(np.int64).reshape(-1, SIMD_WIDTH)
    first = blocks[:, 0]
    neighbours = np.array_equal(blocks, first[:, None] + np.arange(SIMD_WIDTH))
    again = (np.diff(first) <= 0) & (np.diff(pulley[::SIMD_WIDTH]) == 0)
    if not neighbours or np.any(first % SIMD_WIDTH) or np.any(first >= bodies) or again.any():
        return "contact_bodies"
    table = contacts.table[:, :count]
    near = table[RADIUS] > 0.0
    of_pulley = (
        (table[RADIUS] == pulleys[PULLEY_RADIUS, pulley])
        & (table[CENTRE_X] == pulleys[PULLEY_X, pulley])
        & (table[CENTRE_Y] == pulleys[PULLEY_Y, pulley])
        & (blocks.ravel() < bodies)
    )
    some = near.reshape(-1, SIMD_WIDTH).any(axis=1)
    return "" if np.all(of_pulley[near]) and some.all() else "contacts"
