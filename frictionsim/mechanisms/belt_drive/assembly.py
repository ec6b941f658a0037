"""From a scenario to the arrays that the kernels step: the belt at rest, and what acts on it."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import ScenarioError
from frictionsim.mechanisms.belt_drive.equilibrium import Equilibrium, NoEquilibrium, equilibrium
from frictionsim.mechanisms.belt_drive.kernels.chain import (
    ROOM_ROWS,
    AxialDamping,
    Bending,
    Chain,
    Weight,
)
from frictionsim.mechanisms.belt_drive.kernels.contact import (
    PULLEY_RADIUS,
    ROWS,
    VECTOR,
    Contact,
    ContactDamping,
    Creep,
    ExactStick,
    Friction,
    Pulleys,
    Regularised,
    Slots,
)
from frictionsim.mechanisms.belt_drive.kernels.equations import LEDGER, Laws, Loads, Speeds, Torques
from frictionsim.mechanisms.belt_drive.kernels.signals import (
    linear_pieces,
    pieces_in_time,
    pieces_of,
    sines_of,
)
from frictionsim.mechanisms.belt_drive.stability_limits import (
    contact_stiffness,
    fastest,
    fastest_bending,
)
from frictionsim.scenario.signal_tables import SpeedTable

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

    Array = npt.NDArray[np.float64]
    Indices = npt.NDArray[np.int64]


# s: a body that sticks has lost its slip after the time in which a wave gets from body to body, so
# before anything else can have happened; and the results do not depend on it below this.
LONGEST_CAPTURE = 1e-5


class Assembly(NamedTuple):
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

    laws: Laws
    torques: Torques | None
    loads: Loads | None
    speeds: Speeds | None
    room: "Array"
    slots: Slots
    pulleys: Pulleys
    friction: Friction | None
    hysteresis: bool | None
    rest: Equilibrium
    state: "Array"
    sizes: "Array"

    @property
    def fastest(self) -> tuple[float, float]:
        """The highest angular frequency and decay rate of the belt, rad/s and 1/s."""
        return fastest(self.laws, self.rest)

    @property
    def fastest_bending(self) -> float:
        """The highest angular frequency of waves in which the belt bends, rad/s."""
        return fastest_bending(self.laws, self.rest)

    def memory(self) -> dict[str, Any]:
        """Return what the contacts remember between steps, by name."""
        return {
            "slots_first": self.slots.first,
            "slots_body": self.slots.body,
            "slots": self.slots.table,
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
            self.room,
            self.slots,
            self.pulleys,
        )


def share_of_reference(scenario: "BeltDriveScenario") -> float:
    """Return by how much the contact of a body differs from the one that the scenario gives."""
    reference = scenario.effects.contact.reference_bodies
    return 1.0 if reference is None else reference / scenario.mechanism.belt.bodies


def rest_of(scenario: "BeltDriveScenario") -> Equilibrium:
    """Return the belt at rest, without friction.

    Raises
    ------
    ScenarioError
    """
    belt, effects = scenario.mechanism.belt, scenario.effects
    share = share_of_reference(scenario)
    try:
        return equilibrium(
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


def assemble(scenario: "BeltDriveScenario") -> Assembly:
    """Find the belt's rest position and compose its equations of the effects of the scenario."""
    rest = rest_of(scenario)
    laws, pulleys = laws_of(scenario, rest.body_length), _pulleys(scenario)
    friction = _coefficients(scenario, rest.body_length)
    differ = friction is not None and not np.array_equal(friction.static, friction.kinetic)
    bodies = scenario.mechanism.belt.bodies
    return Assembly(
        laws,
        _torques(scenario),
        _loads(scenario),
        _speeds(scenario),
        aligned(ROOM_ROWS, width_of(bodies)),
        _slots(bodies, pulleys.table.shape[1]),
        pulleys,
        friction,
        True if differ and laws.exact is not None else None,
        rest,
        start_of(rest, pulleys),
        sizes_of(rest, laws, pulleys),
    )


def laws_of(scenario: "BeltDriveScenario", body_length: float) -> Laws:
    """Return what acts in a scenario whose bodies are so long."""
    table, effects = scenario.mechanism.belt, scenario.effects
    mass = table.mass_per_length * body_length
    stiffness = table.axial_rigidity / body_length
    damping, bending, law = effects.axial_damping, effects.bending, effects.belt_friction
    share, contact = share_of_reference(scenario), effects.contact
    exact = law is not None and law.law == "set-valued"
    return Laws(
        chain=Chain(
            table.bodies,
            body_length,
            mass,
            mass * body_length**2 / 12.0,
            stiffness,
            scenario.mechanism.path().turn,
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
        exact=ExactStick(min(float(np.sqrt(mass / stiffness)), LONGEST_CAPTURE)) if exact else None,
        regularised=Regularised(law.transition_speed) if law and law.transition_speed else None,
        creep=Creep(law.maximum_creep) if law and law.maximum_creep else None,
    )


def _pulleys(scenario: "BeltDriveScenario") -> Pulleys:
    pulleys = scenario.mechanism.pulleys
    prescribed = {name for name, drive in scenario.drive.items() if drive.speed is not None}
    table = np.zeros((8, len(pulleys)))
    for j, p in enumerate(pulleys):
        table[:4, j] = *p.center, p.radius, p.inertia
    free = [j for j, p in enumerate(pulleys) if p.name not in prescribed]
    return Pulleys(np.array(free, dtype=np.int64), table)


def _slots(bodies: int, pulleys: int) -> Slots:
    """Return slots for as many bodies as could ever be near a pulley: all of them."""
    slots = (bodies + VECTOR) * pulleys // VECTOR * VECTOR
    return Slots(
        np.zeros(pulleys + 1, dtype=np.int64),
        np.zeros(slots, dtype=np.uint64),  # an index that is never negative needs no look
        aligned(ROWS, slots),
        np.zeros((2, bodies)),
    )


def width_of(bodies: int) -> int:
    """Return the length of a row over the joints, with the copy of the first, in full vectors."""
    return -(-(bodies + 1) // VECTOR) * VECTOR


def aligned(rows: int, width: int) -> "Array":
    """Return zeros that begin where the widest vector is loaded fastest."""
    spare = np.zeros(rows * width + VECTOR)
    offset = -spare.ctypes.data // spare.itemsize % VECTOR
    return spare[offset : offset + rows * width].reshape(rows, width)


def _coefficients(scenario: "BeltDriveScenario", body_length: float) -> Friction | None:
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
    return Friction(static, kinetic)


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


def _torques(scenario: "BeltDriveScenario") -> Torques | None:
    which, tables = _driven(scenario, "torque", of_speed=False)
    if not tables:
        return None
    return Torques(which, pieces_of([pieces_in_time(t) for t in tables]), sines_of(tables))


def _loads(scenario: "BeltDriveScenario") -> Loads | None:
    which, tables = _driven(scenario, "torque", of_speed=True)
    if not tables:
        return None
    return Loads(which, pieces_of([linear_pieces(t.speed, t.value) for t in tables]))


def _speeds(scenario: "BeltDriveScenario") -> Speeds | None:
    which, tables = _driven(scenario, "speed", of_speed=False)
    if not tables:
        return None
    return Speeds(which, pieces_of([pieces_in_time(t) for t in tables]), sines_of(tables))


def start_of(rest: Equilibrium, pulleys: Pulleys) -> "Array":
    """Return the state at the start: the belt at rest, free pulleys at rest."""
    n, width = len(rest.x), width_of(len(rest.x))
    state = new_state(n, pulleys)
    state[0:n], state[width : width + n], state[2 * width : 2 * width + n] = (
        rest.x,
        rest.y,
        rest.angle,
    )
    return state


def new_state(bodies: int, pulleys: Pulleys) -> "Array":
    """Return a state vector of zeros, or a rate, for so many bodies."""
    size = 6 * width_of(bodies) + pulleys.table.shape[1] + len(pulleys.free) + LEDGER
    return aligned(1, size + -size % VECTOR)[0]


def sizes_of(rest: Equilibrium, laws: Laws, pulleys: Pulleys) -> "Array":
    """Return the size of each state that its error is measured by."""
    width, m, free = width_of(len(rest.x)), pulleys.table.shape[1], len(pulleys.free)
    length, stiffness, mass = laws.chain.length, laws.chain.stiffness, laws.chain.mass
    radius = float(np.min(pulleys.table[PULLEY_RADIUS]))
    contact = contact_stiffness(laws, rest)
    depth = float(np.max(rest.normal_force, initial=0.0)) / contact
    # What is the smaller of the two decides how exactly positions have to be known.
    stretch = float(np.mean(rest.tension)) / stiffness
    speed = min(stretch * np.sqrt(stiffness / mass), depth * np.sqrt(contact / mass))
    stretch = min(stretch, depth)
    parts = [
        (2 * width, stretch),
        (width, stretch / length),
        (2 * width, speed),
        (width, speed / length),
        (m, stretch / radius),
        (free, speed / radius),
    ]
    sizes = np.full(len(new_state(len(rest.x), pulleys)), np.inf)
    sizes[: 6 * width + m + free] = np.concatenate([np.full(c, size) for c, size in parts])
    return sizes
