"""A belt drive at rest, ready to be stepped, in the plane or guided on its pitch line."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive import stability_limits
from frictionsim.mechanisms.belt_drive.composition import (
    compose,
)
from frictionsim.mechanisms.belt_drive.effects import ordered_effects
from frictionsim.mechanisms.belt_drive.effects.base import BeltEffect
from frictionsim.mechanisms.belt_drive.effects.contact import stiffness_under
from frictionsim.mechanisms.belt_drive.energy import (
    Chain,
    chain_of,
    energies,
    energy_on_line,
    kinetic_energy,
    shape_of,
)
from frictionsim.mechanisms.belt_drive.equilibrium import Rest, at_rest, initial_positions
from frictionsim.mechanisms.belt_drive.kernels.system import (
    INERTIA,
    POSITION,
    PULLEY_RADIUS,
    VX,
    Array,
    System,
    kinematics_of,
    zero_state,
)
from frictionsim.mechanisms.belt_drive.stability_limits import (
    FRICTION_MARGIN,
    damping_rates,
    friction_rate,
    max_decay_rate,
    oscillator_eigenvalues,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

    ComplexArray = npt.NDArray[np.complex128]


# The error of a body's rotation counts a tenth of that of its place over its length: the ends that
# it moves across a joint change the joint's length, and so its tension, in second order only.
ROTATION_TOLERANCE = 10.0


class BeltModel(NamedTuple):
    """A belt drive ready to be stepped, whose bodies move in the plane.

    Attributes
    ----------
    system : System
    equilibrium : Rest
    state : (size,)
        At the start: at rest, no friction yet.
    chain : Chain
    """

    system: System
    equilibrium: Rest
    state: Array
    chain: Chain

    @property
    def distinct_static_friction(self) -> bool:
        """Whether static and kinetic friction differ and the law tells them apart."""
        law, friction = self.system.effects.belt_friction, self.system.friction
        if friction is None or law.set_valued is None:
            return False
        return not np.array_equal(friction.static, friction.kinetic)

    @property
    def present_effects(self) -> list[tuple[BeltEffect, Any]]:
        """The effects that the scenario has, in the order of their forces, with parameters."""
        effects = (
            (effect, getattr(self.system.effects, effect.key)) for effect in ordered_effects()
        )
        return [(effect, parameters) for effect, parameters in effects if parameters is not None]

    def kinetic_energy(self, kinematics: Array, speeds: Array) -> float:
        """Return the kinetic energy of bodies and pulleys, J.

        Of the `kinematics` of the bodies, (6, n), or of points on a line, (2, n), and the speeds of
        all pulleys, (pulleys,), rad/s.
        """
        velocities = kinematics[len(kinematics) // 2 :]
        return kinetic_energy(self.chain, velocities, self.system.pulleys.table[INERTIA], speeds)

    def potential_energy(self, kinematics: Array) -> float:
        """Return the energy of all effects that store one, J, for the kinematics (6, n)."""
        x, y, angle = kinematics[:VX]
        return float(np.sum(energies(self.chain, shape_of(self.chain, x, y, angle))))

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
        force = stability_limits.max_normal_force(self.equilibrium)
        return stiffness_under(self.system.effects.contact, force)

    @property
    def error_scales(self) -> Array:
        """The scale of the error of each state, (size,); infinite for energies."""
        # The smaller of stretch and depth decides how exactly positions have to be known.
        stretch, speed = self._stretch_and_speed
        stiffness = self.contact_stiffness
        depth = float(np.max(self.equilibrium.normal_force, initial=0.0)) / stiffness
        contact_speed = depth * float(np.sqrt(stiffness / self.system.chain.mass))
        stretch, speed = min(stretch, depth), min(speed, contact_speed)
        turning = ROTATION_TOLERANCE / self.system.chain.length
        return self._scales(stretch, stretch, turning * stretch, speed, speed, turning * speed)

    @property
    def _stretch_and_speed(self) -> tuple[float, float]:
        """The stretch of a joint under the pretension, m, and the speed at which it swings, m/s."""
        stiffness = self.system.effects.axial_damping.stiffness
        stretch = float(np.mean(self.equilibrium.tension)) / stiffness
        return stretch, stretch * float(np.sqrt(stiffness / self.system.chain.mass))

    def _scales(self, *rows: float) -> Array:
        """Return the scales of a state from those of the rows of its kinematics, x and vx first."""
        layout, radius = self.system.layout, self.system.pulleys.table[PULLEY_RADIUS]
        scales = np.full(layout.size, np.inf)
        kinematics_of(scales, layout)[:] = np.array([rows]).T
        stretch, speed = rows[0], rows[len(rows) // 2]
        scales[layout.angles : layout.speeds] = stretch / float(np.min(radius))
        scales[layout.speeds : layout.energies] = speed / float(np.min(radius))
        return scales

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

    @property
    def max_frequency_and_decay(self) -> tuple[float, float]:
        """The highest angular frequency and decay rate of the belt, rad/s and 1/s.

        The shortest waves along it have 2 sqrt(c/m).
        """
        stiffness = self.system.effects.axial_damping.stiffness
        frequency = 2.0 * float(np.sqrt(stiffness / self.system.chain.mass))
        return frequency, max_decay_rate(self.system)

    @property
    def eigenvalues(self) -> "ComplexArray":
        """The eigenvalues of the shortest waves along the belt and of its friction, (m,), 1/s."""
        system = self.system
        frequency, _ = self.max_frequency_and_decay
        waves = oscillator_eigenvalues(frequency**2, damping_rates(system).moving)
        return np.append(waves, -FRICTION_MARGIN * friction_rate(system))

    def potential_energy(self, kinematics: Array) -> float:
        """Return the energy of the springs along the belt, J, for the kinematics (2, n)."""
        return energy_on_line(self.chain, self.system.kinematics.length, kinematics[POSITION])

    @property
    def error_scales(self) -> Array:
        """The scale of the error of each state, (size,); infinite for energies."""
        return self._scales(*self._stretch_and_speed)

    def contact_state(self) -> dict[str, Any]:
        """Return the state of the contacts between steps, by name."""
        line = self.system.kinematics
        return {**super().contact_state(), "runs": line.runs, "run_count": line.run_count}


def assemble(scenario: "BeltDriveScenario") -> BeltModel:
    """Find the belt's equilibrium and compose its equations of the effects of the scenario."""
    equilibrium = at_rest(scenario)
    system = compose(scenario, equilibrium.body_length)
    chain = chain_of(scenario, equilibrium.body_length)
    state, bodies = zero_state(system.layout), system.layout.bodies
    kinematics = kinematics_of(state, system.layout)
    if scenario.guided:
        kinematics[POSITION, :bodies] = initial_positions(scenario.mechanism.path(), bodies)
        return StringModel(system, equilibrium, state, chain)
    kinematics[:3, :bodies] = equilibrium.x, equilibrium.y, equilibrium.angle
    return BeltModel(system, equilibrium, state, chain)
