"""From a scenario to the arrays that the kernels step, in the plane or guided on a line."""

from collections import namedtuple
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive import contact_checkpoint, stability_limits
from frictionsim.mechanisms.belt_drive.effects import EFFECTS
from frictionsim.mechanisms.belt_drive.effects.base import Belt, Chain
from frictionsim.mechanisms.belt_drive.effects.contact import stiffness_under
from frictionsim.mechanisms.belt_drive.effects.patch import patch_bodies
from frictionsim.mechanisms.belt_drive.equilibrium import (
    Equilibrium,
)
from frictionsim.mechanisms.belt_drive.kernels.layout import (
    CONTACT_ROWS,
    KINEMATIC_ROWS,
    PULLEY_ROWS,
    SIMD_WIDTH,
    STRING_ROWS,
    STRING_WORKSPACE_ROWS,
    WORKSPACE_ROWS,
    StateLayout,
    aligned_zeros,
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

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario
    from frictionsim.solvers.state_values import Expected

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

    def contact_values(self) -> "dict[str, Expected]":
        """Return the valid values of the arrays of `contact_state`, by name."""
        return contact_checkpoint.contact_values(self.system)

    def contact_fault(self) -> str:
        """Return the array of `contact_state` that does not go with the others; empty if all do."""
        return contact_checkpoint.block_fault(self.system)


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
    force = stability_limits.max_normal_force(equilibrium)
    return stiffness_under(effects.contact, force)
