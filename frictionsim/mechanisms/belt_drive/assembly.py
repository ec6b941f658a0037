"""From a scenario to the arrays that the kernels step: the belt at rest, and what acts on it."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import ScenarioError
from frictionsim.mechanisms.belt_drive.equilibrium import (
    Equilibrium,
    NoEquilibrium,
    find_equilibrium,
)
from frictionsim.mechanisms.belt_drive.kernels.chain import (
    WORKSPACE_ROWS,
    AxialDamping,
    Bending,
    Chain,
    Weight,
)
from frictionsim.mechanisms.belt_drive.kernels.contact import (
    PULLEY_RADIUS,
    ROWS,
    SIMD_WIDTH,
    Contact,
    ContactDamping,
    Contacts,
    CreepFriction,
    FrictionCoefficients,
    Pulleys,
    RegularisedFriction,
    SetValuedFriction,
)
from frictionsim.mechanisms.belt_drive.kernels.equations import (
    N_ENERGIES,
    ForceLaws,
    PrescribedSpeeds,
    SpeedTorques,
    TimeTorques,
)
from frictionsim.mechanisms.belt_drive.kernels.signals import (
    linear_pieces,
    pieces_in_time,
    sines_of,
    stack_pieces,
)
from frictionsim.mechanisms.belt_drive.stability_limits import (
    contact_stiffness,
    max_bending_frequency,
    max_frequency_and_decay,
)
from frictionsim.scenario.signal_tables import SpeedTable

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

    Array = npt.NDArray[np.float64]
    Indices = npt.NDArray[np.int64]


# s: a body that sticks has lost its slip after the time in which a wave gets from body to body, so
# before anything else can have happened; and the results do not depend on it below this.
MAX_RELAXATION_TIME = 1e-5


class BeltModel(NamedTuple):
    """A belt drive ready to be stepped.

    Attributes
    ----------
    laws : Laws
    torques, loads, speeds : Torques, Loads, Speeds or None
    room : (12, width)
        For the kernels of the chain to work in.
    slots : Slots
    pulleys : Pulleys
    friction : Friction or None
    hysteresis : bool or None
        True if static and kinetic friction differ and the law tells them apart, else None.
    rest : Equilibrium
    state : (n,)
        At the start: at rest, no friction yet.
    sizes : (n,)
        What an error in each state is measured by; infinite for energies.
    """

    laws: ForceLaws
    torques: TimeTorques | None
    loads: SpeedTorques | None
    speeds: PrescribedSpeeds | None
    workspace: "Array"
    contacts: Contacts
    pulleys: Pulleys
    friction: FrictionCoefficients | None
    distinct_static_friction: bool | None
    equilibrium: Equilibrium
    state: "Array"
    error_scales: "Array"

    @property
    def max_frequency_and_decay(self) -> tuple[float, float]:
        """The highest angular frequency and decay rate of the belt, rad/s and 1/s."""
        return max_frequency_and_decay(self.laws, self.equilibrium)

    @property
    def max_bending_frequency(self) -> float:
        """The highest angular frequency of waves in which the belt bends, rad/s."""
        return max_bending_frequency(self.laws, self.equilibrium)

    def contact_state(self) -> dict[str, Any]:
        """Return what the contacts remember between steps, by name."""
        return {
            "slots_first": self.contacts.offsets,
            "slots_body": self.contacts.body,
            "slots": self.contacts.table,
            "pulleys": self.pulleys.table,
        }

    @property
    def parts(self) -> tuple[Any, ...]:
        """What the kernels that evaluate the equations take, in their order."""
        return (
            self.laws,
            self.torques,
            self.loads,
            self.speeds,
            self.workspace,
            self.contacts,
            self.pulleys,
        )


def mesh_scale(scenario: "BeltDriveScenario") -> float:
    """Return by how much the contact of a body differs from the one that the scenario gives."""
    reference = scenario.effects.contact.reference_bodies
    return 1.0 if reference is None else reference / scenario.mechanism.belt.bodies


def solve_equilibrium(scenario: "BeltDriveScenario") -> Equilibrium:
    """Return the belt at rest, without friction.

    Raises
    ------
    ScenarioError
    """
    belt, effects = scenario.mechanism.belt, scenario.effects
    share = mesh_scale(scenario)
    try:
        return find_equilibrium(
            scenario.mechanism.path(),
            scenario.mechanism.circles,
            belt.bodies,
            axial_rigidity=belt.axial_rigidity,
            mass_per_length=belt.mass_per_length,
            c1=effects.contact.c1 * share,
            c2=effects.contact.c2 * share,
            pretension=belt.pretension,
            length=belt.length,
            bending_rigidity=effects.bending.rigidity if effects.bending else 0.0,
            gravity=(0.0, -effects.gravity.g) if effects.gravity else (0.0, 0.0),
        )
    except NoEquilibrium as error:
        raise ScenarioError([f"mechanism.belt: {error}"]) from None


def assemble(scenario: "BeltDriveScenario") -> BeltModel:
    """Find the belt's rest position and compose its equations of the effects of the scenario."""
    equilibrium = solve_equilibrium(scenario)
    laws, pulleys = force_laws(scenario, equilibrium.body_length), _pulleys(scenario)
    friction = _coefficients(scenario, equilibrium.body_length)
    differ = friction is not None and not np.array_equal(friction.static, friction.kinetic)
    bodies = scenario.mechanism.belt.bodies
    return BeltModel(
        laws,
        _torques(scenario),
        _loads(scenario),
        _speeds(scenario),
        aligned_zeros(WORKSPACE_ROWS, padded_width(bodies)),
        _slots(bodies, pulleys.table.shape[1]),
        pulleys,
        friction,
        True if differ and laws.set_valued is not None else None,
        equilibrium,
        initial_state(equilibrium, pulleys),
        error_scales_of(equilibrium, laws, pulleys),
    )


def force_laws(scenario: "BeltDriveScenario", body_length: float) -> ForceLaws:
    """Return what acts in a scenario whose bodies are so long."""
    table, effects = scenario.mechanism.belt, scenario.effects
    mass = table.mass_per_length * body_length
    stiffness = table.axial_rigidity / body_length
    damping, bending, law = effects.axial_damping, effects.bending, effects.belt_friction
    share, contact = mesh_scale(scenario), effects.contact
    set_valued = law is not None and law.law == "set-valued"
    return ForceLaws(
        chain=Chain(
            table.bodies,
            body_length,
            mass,
            mass * body_length**2 / 12.0,
            stiffness,
            scenario.mechanism.path().total_turning,
        ),
        contact=Contact(contact.c1 * share, contact.c2 * share),
        axial_damping=AxialDamping(
            damping.coefficient / (body_length if damping.basis == "section" else 1.0)
        )
        if damping
        else None,
        bending=Bending(bending.rigidity / body_length, bending.damping / body_length)
        if bending
        else None,
        weight=Weight(0.0, -effects.gravity.g) if effects.gravity else None,
        contact_damping=ContactDamping(contact.damping * share, contact.p_max)
        if contact.damping
        else None,
        set_valued=SetValuedFriction(min(float(np.sqrt(mass / stiffness)), MAX_RELAXATION_TIME))
        if set_valued
        else None,
        regularised=RegularisedFriction(law.transition_speed)
        if law and law.transition_speed
        else None,
        creep=CreepFriction(law.maximum_creep) if law and law.maximum_creep else None,
    )


def _pulleys(scenario: "BeltDriveScenario") -> Pulleys:
    pulleys = scenario.mechanism.pulleys
    prescribed = {name for name, drive in scenario.drive.items() if drive.speed is not None}
    table = np.zeros((8, len(pulleys)))
    for j, p in enumerate(pulleys):
        table[:4, j] = *p.center, p.radius, p.inertia
    free = [j for j, p in enumerate(pulleys) if p.name not in prescribed]
    return Pulleys(np.array(free, dtype=np.int64), table)


def _slots(bodies: int, pulleys: int) -> Contacts:
    """Return slots for as many bodies as could ever be near a pulley: all of them."""
    contacts = (bodies + SIMD_WIDTH) * pulleys // SIMD_WIDTH * SIMD_WIDTH
    return Contacts(
        np.zeros(pulleys + 1, dtype=np.int64),
        np.zeros(contacts, dtype=np.uint64),  # an index that is never negative needs no look
        aligned_zeros(ROWS, contacts),
        np.zeros((2, bodies)),
    )


def padded_width(bodies: int) -> int:
    """Return the length of a row over the joints, with the copy of the first, in full vectors."""
    return -(-(bodies + 1) // SIMD_WIDTH) * SIMD_WIDTH


def aligned_zeros(rows: int, width: int) -> "Array":
    """Return zeros that begin where the widest vector is loaded fastest."""
    spare = np.zeros(rows * width + SIMD_WIDTH)
    offset = -spare.ctypes.data // spare.itemsize % SIMD_WIDTH
    return spare[offset : offset + rows * width].reshape(rows, width)


def _coefficients(scenario: "BeltDriveScenario", body_length: float) -> FrictionCoefficients | None:
    """Return the coefficients of every body at every pulley; a patch goes over the pulley's."""
    law, patch = scenario.effects.belt_friction, scenario.effects.patch
    if law is None:
        return None
    bodies = scenario.mechanism.belt.bodies
    static = np.empty((len(scenario.mechanism.pulleys), bodies))
    kinetic = np.empty_like(static)
    for j, name in enumerate(scenario.mechanism.names):
        own = law.pulleys.get(name, law)
        static[j], kinetic[j] = own.mu_s, own.mu_k
    if patch is not None:
        inside = patch_bodies(scenario, body_length)
        static[:, inside], kinetic[:, inside] = patch.mu_s, patch.mu_k
    return FrictionCoefficients(static, kinetic)


def patch_bodies(scenario: "BeltDriveScenario", body_length: float) -> "npt.NDArray[np.bool_]":
    """Return which bodies are in the patch, (n,); none without one."""
    patch = scenario.effects.patch
    centres = (np.arange(scenario.mechanism.belt.bodies) + 0.5) * body_length
    if patch is None:
        return np.zeros(len(centres), dtype=bool)
    return (centres >= patch.start) & (centres < patch.end)


def _driven(scenario: "BeltDriveScenario", key: str, of_speed: bool) -> tuple["Indices", list[Any]]:
    """Return the pulleys that have a signal of one sort, and the signals."""
    found = [
        (j, getattr(scenario.drive[name], key))
        for j, name in enumerate(scenario.mechanism.names)
        if name in scenario.drive and getattr(scenario.drive[name], key) is not None
    ]
    found = [(j, table) for j, table in found if isinstance(table, SpeedTable) == of_speed]
    return np.array([j for j, _ in found], dtype=np.int64), [table for _, table in found]


def _torques(scenario: "BeltDriveScenario") -> TimeTorques | None:
    targets, tables = _driven(scenario, "torque", of_speed=False)
    if not tables:
        return None
    return TimeTorques(targets, stack_pieces([pieces_in_time(t) for t in tables]), sines_of(tables))


def _loads(scenario: "BeltDriveScenario") -> SpeedTorques | None:
    targets, tables = _driven(scenario, "torque", of_speed=True)
    if not tables:
        return None
    return SpeedTorques(targets, stack_pieces([linear_pieces(t.speed, t.value) for t in tables]))


def _speeds(scenario: "BeltDriveScenario") -> PrescribedSpeeds | None:
    targets, tables = _driven(scenario, "speed", of_speed=False)
    if not tables:
        return None
    return PrescribedSpeeds(
        targets, stack_pieces([pieces_in_time(t) for t in tables]), sines_of(tables)
    )


def initial_state(equilibrium: Equilibrium, pulleys: Pulleys) -> "Array":
    """Return the state at the start: the belt at rest, free pulleys at rest."""
    n, width = len(equilibrium.x), padded_width(len(equilibrium.x))
    state = zero_state(n, pulleys)
    state[0:n], state[width : width + n], state[2 * width : 2 * width + n] = (
        equilibrium.x,
        equilibrium.y,
        equilibrium.angle,
    )
    return state


def zero_state(bodies: int, pulleys: Pulleys) -> "Array":
    """Return a state vector of zeros, or a rate, for so many bodies."""
    size = 6 * padded_width(bodies) + pulleys.table.shape[1] + len(pulleys.free) + N_ENERGIES
    return aligned_zeros(1, size + -size % SIMD_WIDTH)[0]


def error_scales_of(equilibrium: Equilibrium, laws: ForceLaws, pulleys: Pulleys) -> "Array":
    """Return the size of each state that its error is measured by."""
    width, m, free = padded_width(len(equilibrium.x)), pulleys.table.shape[1], len(pulleys.free)
    length, stiffness, mass = laws.chain.length, laws.chain.stiffness, laws.chain.mass
    radius = float(np.min(pulleys.table[PULLEY_RADIUS]))
    contact = contact_stiffness(laws, equilibrium)
    depth = float(np.max(equilibrium.normal_force, initial=0.0)) / contact
    # What is the smaller of the two decides how exactly positions have to be known.
    joint_forces = float(np.mean(equilibrium.tension)) / stiffness
    speed = min(joint_forces * np.sqrt(stiffness / mass), depth * np.sqrt(contact / mass))
    joint_forces = min(joint_forces, depth)
    parts = [
        (2 * width, joint_forces),
        (width, joint_forces / length),
        (2 * width, speed),
        (width, speed / length),
        (m, joint_forces / radius),
        (free, speed / radius),
    ]
    error_scales = np.full(len(zero_state(len(equilibrium.x), pulleys)), np.inf)
    error_scales[: 6 * width + m + free] = np.concatenate([np.full(c, size) for c, size in parts])
    return error_scales
