"""A belt drive at rest, ready to be stepped, in the plane or guided on its pitch line."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive import limits
from frictionsim.mechanisms.belt_drive.belt import Belt, belt_of, initial_positions
from frictionsim.mechanisms.belt_drive.composition import (
    compose,
)
from frictionsim.mechanisms.belt_drive.energy import (
    Chain,
    chain_of,
    energies,
    energy_on_line,
    kinetic_energy,
    shape_of,
)
from frictionsim.mechanisms.belt_drive.equilibrium import Rest, at_rest
from frictionsim.mechanisms.belt_drive.kernels.system import (
    INERTIA,
    POSITION,
    VX,
    Array,
    System,
    kinematics_of,
    zero_state,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

    ComplexArray = npt.NDArray[np.complex128]


class BeltModel(NamedTuple):
    """A belt drive ready to be stepped, whose bodies move in the plane.

    Attributes
    ----------
    system : System
    equilibrium : Rest
    state : (size,)
        At the start: at rest, no friction yet.
    chain : Chain
    belt : Belt
    """

    system: System
    equilibrium: Rest
    state: Array
    chain: Chain
    belt: Belt

    @property
    def distinct_static_friction(self) -> bool:
        """Whether static and kinetic friction differ and the law tells them apart."""
        law, friction = self.system.effects.belt_friction, self.system.friction
        if friction is None or law.set_valued is None:
            return False
        return not np.array_equal(friction.static, friction.kinetic)

    def kinetic_energy(self, kinematics: Array, speeds: Array) -> float:
        """Return the kinetic energy of bodies and pulleys, J.

        Of the `kinematics` of the bodies, (6, n), or of points on a line, (2, n), and the speeds of
        all pulleys, (pulleys,), rad/s.
        """
        velocities = kinematics[len(kinematics) // 2 :]
        inertias = self.system.pulleys.table[INERTIA]
        return float(kinetic_energy(self.chain, velocities, inertias, speeds))

    def potential_energy(self, kinematics: Array) -> float:
        """Return the energy of all effects that store one, J, for the kinematics (6, n)."""
        x, y, angle = kinematics[:VX]
        return float(np.sum(energies(self.chain, shape_of(self.chain, x, y, angle))))

    @property
    def max_frequency(self) -> float:
        """The highest angular frequency of the belt, rad/s."""
        return limits.max_frequency(self.belt, self.equilibrium)

    @property
    def eigenvalues(self) -> limits.ComplexArray:
        """The eigenvalues of its waves and of its friction, (m,), 1/s."""
        return limits.wave_eigenvalues(self.belt, self.equilibrium)

    @property
    def contact_stiffness(self) -> float:
        """dN/dp of a contact that is pressed deeper than any is at rest, N/m."""
        return limits.deepest_contact_stiffness(self.belt, self.equilibrium)

    @property
    def error_scales(self) -> Array:
        """The scale of the error of each state, (size,); infinite for energies."""
        return limits.error_scales(self.belt, self.equilibrium)

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


class StringModel(BeltModel):
    """A guided string ready to be stepped."""

    def potential_energy(self, kinematics: Array) -> float:
        """Return the energy of the springs along the belt, J, for the kinematics (2, n)."""
        length = self.system.kinematics.length
        return float(energy_on_line(self.chain, length, kinematics[POSITION]))

    def contact_state(self) -> dict[str, Any]:
        """Return the state of the contacts between steps, by name."""
        line = self.system.kinematics
        return {**super().contact_state(), "runs": line.runs, "run_count": line.run_count}


def assemble(scenario: "BeltDriveScenario") -> BeltModel:
    """Find the belt's equilibrium and compose its equations of the effects of the scenario."""
    equilibrium = at_rest(scenario)
    system = compose(scenario, equilibrium.body_length)
    chain = chain_of(scenario, equilibrium.body_length)
    belt = belt_of(scenario, equilibrium.body_length)
    state, bodies = zero_state(system.layout), system.layout.bodies
    kinematics = kinematics_of(state, system.layout)
    if scenario.guided:
        kinematics[POSITION, :bodies] = initial_positions(scenario.mechanism.path().length, bodies)
        return StringModel(system, equilibrium, state, chain, belt)
    kinematics[:3, :bodies] = equilibrium.x, equilibrium.y, equilibrium.angle
    return BeltModel(system, equilibrium, state, chain, belt)
