"""A belt drive at rest, ready to be stepped, in the plane or guided on its pitch line."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import ScenarioError
from frictionsim.mechanisms.belt_drive import stability_limits
from frictionsim.mechanisms.belt_drive.composition import (
    chain_of,
    compose,
    effect_parameters,
    pitch_line,
)
from frictionsim.mechanisms.belt_drive.effects import ordered_effects
from frictionsim.mechanisms.belt_drive.effects.base import BeltEffect, Shape
from frictionsim.mechanisms.belt_drive.effects.contact import stiffness_under
from frictionsim.mechanisms.belt_drive.equilibrium import (
    Equilibrium,
    NoEquilibrium,
    find_equilibrium,
)
from frictionsim.mechanisms.belt_drive.kernels.system import (
    ANGLE,
    INERTIA,
    POSITION,
    PULLEY_RADIUS,
    PULLEY_X,
    PULLEY_Y,
    SPIN,
    VELOCITY,
    VX,
    VY,
    Array,
    PitchLine,
    System,
    X,
    Y,
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

    from frictionsim.mechanisms.belt_drive.geometry import Path
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
    equilibrium : Equilibrium
    state : (size,)
        At the start: at rest, no friction yet.
    """

    system: System
    equilibrium: Equilibrium
    state: Array

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

        Of the `kinematics` of the bodies, (6, n), and the speeds of all pulleys, (pulleys,), rad/s.
        """
        chain, inertia = self.system.chain, self.system.pulleys.table[INERTIA]
        linear = chain.mass * np.sum(kinematics[VX] ** 2 + kinematics[VY] ** 2)
        turning = chain.inertia * np.sum(kinematics[SPIN] ** 2) + np.sum(inertia * speeds**2)
        return float(0.5 * (linear + turning))

    def potential_energy(self, kinematics: Array) -> float:
        """Return the energy of all effects that store one, J, for the kinematics (6, n)."""
        pulley = self.system.pulleys.table
        shape = Shape(
            self.system.chain,
            kinematics[[X, Y]].T,
            kinematics[ANGLE],
            pulley[[PULLEY_X, PULLEY_Y]].T,
            pulley[PULLEY_RADIUS],
        )
        energies = (effect.energies(own, shape) for effect, own in self.present_effects)
        return float(sum(np.sum(energy) for energy in energies))

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

    def kinetic_energy(self, kinematics: Array, speeds: Array) -> float:
        """Return the kinetic energy of points, with the kinematics (2, n), and pulleys, J."""
        inertia = self.system.pulleys.table[INERTIA]
        linear = self.system.chain.mass * np.sum(kinematics[VELOCITY] ** 2)
        return float(0.5 * (linear + np.sum(inertia * speeds**2)))

    def potential_energy(self, kinematics: Array) -> float:
        """Return the energy of the springs along the belt, J, for the kinematics (2, n)."""
        position, chain = kinematics[POSITION], self.system.chain
        behind = position[-1] - self.system.kinematics.length
        stretch = np.diff(position, prepend=behind) - chain.length
        stiffness = self.system.effects.axial_damping.stiffness
        return float(0.5 * stiffness * np.sum(stretch**2))

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
    equilibrium = solve_equilibrium(scenario)
    system = compose(scenario, equilibrium.body_length)
    state, bodies = zero_state(system.layout), system.layout.bodies
    kinematics = kinematics_of(state, system.layout)
    if scenario.guided:
        kinematics[POSITION, :bodies] = initial_positions(scenario.mechanism.path(), bodies)
        return StringModel(system, equilibrium, state)
    kinematics[:3, :bodies] = equilibrium.x, equilibrium.y, equilibrium.angle
    return BeltModel(system, equilibrium, state)


def solve_equilibrium(scenario: "BeltDriveScenario") -> Equilibrium:
    """Return the belt at rest, without friction."""
    if scenario.guided:
        return string_at_rest(scenario)
    belt = scenario.mechanism.belt
    try:
        return find_equilibrium(
            scenario.mechanism.path(),
            scenario.mechanism.circles,
            belt.axial_rigidity,
            lambda length: chain_of(scenario, length),
            lambda chain: effect_parameters(scenario, chain),
            pretension=belt.pretension,
            length=belt.length,
        )
    except NoEquilibrium as error:
        raise ScenarioError([f"mechanism.belt: {error}"]) from None


def initial_positions(path: "Path", points: int) -> Array:
    """Return where the points are at the start, m, from where the belt leaves the first pulley."""
    positions: Array = (np.arange(points, dtype=np.float64) + 0.5) * (path.length / points)
    return positions


def string_at_rest(scenario: "BeltDriveScenario") -> Equilibrium:
    """Return a guided string at rest without friction: one tension throughout."""
    belt, path = scenario.mechanism.belt, scenario.mechanism.path()
    spacing = path.length / belt.bodies
    if belt.length is not None:
        length = belt.length / belt.bodies
        tension = belt.axial_rigidity * (path.length / belt.length - 1.0)
    else:
        assert belt.pretension is not None
        tension = belt.pretension
        length = spacing / (1.0 + tension / belt.axial_rigidity)
    points = path.at(initial_positions(path, belt.bodies))
    on_arc = arc_shares(pitch_line(path, belt.bodies), belt.bodies, spacing)
    curvature = np.array([1.0 / pulley.radius for pulley in scenario.mechanism.pulleys])
    pulley = np.where(on_arc.any(axis=0), np.argmax(on_arc, axis=0), -1)
    return Equilibrium(
        length,
        points.position[:, 0],
        points.position[:, 1],
        points.angle,
        np.full(belt.bodies, tension),
        tension * (curvature @ on_arc),
        pulley,
        0.0,
    )


def arc_shares(line: PitchLine, points: int, spacing: float) -> Array:
    """Return the length of each point's part of the belt on each arc, (pulleys, n), m, at rest."""
    along = np.arange(points + 1) * spacing - line.starts[:, None]
    shares: Array = np.diff(np.minimum(np.maximum(along, 0.0), line.arcs[:, None]), axis=1)
    return shares
