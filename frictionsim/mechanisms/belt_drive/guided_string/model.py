"""From a scenario to the arrays of a guided string at rest."""

from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.mechanisms.belt_drive.composition import (
    BeltModel,
    compose,
    distinct_static_friction,
    error_scales,
    offsets_fault,
)
from frictionsim.mechanisms.belt_drive.equilibrium import Equilibrium
from frictionsim.mechanisms.belt_drive.kernels.contacts import RUN_ROWS
from frictionsim.mechanisms.belt_drive.kernels.layout import (
    INERTIA,
    POSITION,
    PULLEY_RADIUS,
    RADIUS,
    SIMD_WIDTH,
    VELOCITY,
    kinematics_of,
    zero_state,
)
from frictionsim.mechanisms.belt_drive.kernels.system import PitchLine, System
from frictionsim.mechanisms.belt_drive.stability_limits import (
    FRICTION_MARGIN,
    damping_rates,
    friction_rate,
    max_decay_rate,
    oscillator_eigenvalues,
)
from frictionsim.solvers.state_values import Expected, Values

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.geometry import Path
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

    Array = npt.NDArray[np.float64]
    ComplexArray = npt.NDArray[np.complex128]
    Indices = npt.NDArray[np.int64]


def run_values(line: PitchLine, system: System) -> dict[str, Expected]:
    """Return the valid values of the arrays of the runs, by name."""
    capacity = max(len(system.contacts.body), system.layout.bodies)
    return {
        "runs": Values(0.0, capacity, whole=True),
        "run_count": Values(0.0, line.runs.shape[1], whole=True),
    }


def run_fault(line: PitchLine, system: System) -> str:
    """Return the array that does not go with the others; empty if all do.

    A run lists candidates of one pulley and points that follow each other; each candidate that is
    near a pulley is in one run.
    """
    if fault := offsets_fault(system):
        return fault
    contacts, radii = system.contacts, system.pulleys.table[PULLEY_RADIUS]
    points, candidates, counts, pulleys = line.runs[:, : int(line.run_count[0])]
    if np.any(counts < 1) or np.any(pulleys >= len(radii)):
        return "runs"
    low, high = contacts.offsets[pulleys], contacts.offsets[pulleys + 1]
    inside = (candidates >= low) & (candidates + counts <= high)
    if not np.all(inside & (points + counts <= system.layout.bodies)):
        return "runs"
    near = np.flatnonzero(contacts.table[RADIUS, : contacts.offsets[-1]] > 0.0)
    if np.sum(counts) != len(near):
        return "runs"
    listed = _counted_from(candidates, counts)
    if not np.array_equal(listed, near):
        return "runs"
    if not np.array_equal(contacts.body[listed].astype(np.int64), _counted_from(points, counts)):
        return "contact_bodies"
    radius = contacts.table[RADIUS, listed]
    return "" if np.array_equal(radius, np.repeat(radii[pulleys], counts)) else "contacts"


def _counted_from(starts: "Indices", counts: "Indices") -> "Indices":
    """Return start, start + 1, ... of each run, one behind the other."""
    before = np.cumsum(counts) - counts
    numbers: Indices = np.repeat(starts - before, counts) + np.arange(int(np.sum(counts)))
    return numbers


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

    def kinetic_energy(self, kinematics: "Array", speeds: "Array") -> float:
        """Return the kinetic energy of points, with the kinematics (2, n), and pulleys, J."""
        inertia = self.system.pulleys.table[INERTIA]
        linear = self.system.chain.mass * np.sum(kinematics[VELOCITY] ** 2)
        return float(0.5 * (linear + np.sum(inertia * speeds**2)))

    def potential_energy(self, kinematics: "Array") -> float:
        """Return the energy of the springs along the belt, J, for the kinematics (2, n)."""
        assert self.system.line is not None
        position, chain = kinematics[POSITION], self.system.chain
        stretch = np.diff(position, prepend=position[-1] - self.system.line.length) - chain.length
        stiffness = self.system.effects.axial_damping.stiffness
        return float(0.5 * stiffness * np.sum(stretch**2))

    def contact_state(self) -> dict[str, Any]:
        """Return the state of the contacts between steps, by name."""
        line = self.system.line
        assert line is not None
        return {**super().contact_state(), "runs": line.runs, "run_count": line.run_count}

    def contact_values(self) -> "dict[str, Expected]":
        """Return the valid values of the arrays of `contact_state`, by name."""
        assert self.system.line is not None
        return {**super().contact_values(), **run_values(self.system.line, self.system)}

    def contact_fault(self) -> str:
        """Return the array of `contact_state` that does not go with the others; empty if all do."""
        assert self.system.line is not None
        return run_fault(self.system.line, self.system)


def assemble_string(scenario: "BeltDriveScenario") -> StringModel:
    """Compose the equations of a guided string of the effects of the scenario."""
    equilibrium, path = string_at_rest(scenario), scenario.mechanism.path()
    line = pitch_line(path, scenario.mechanism.belt.bodies)
    system = compose(scenario, equilibrium.body_length, line)
    state = zero_state(system.layout)
    kinematics = kinematics_of(state, system.layout)
    kinematics[POSITION, : system.layout.bodies] = initial_positions(path, system.layout.bodies)
    return StringModel(
        system,
        distinct_static_friction(system),
        equilibrium,
        state,
        error_scales(equilibrium, system),
    )


def pitch_line(path: "Path", points: int) -> PitchLine:
    """Return a line as the kernels see it."""
    count = len(path.arcs)
    # The arc of the first pulley is the last one.
    starts: Array = np.roll(path.breakpoints[1:-1:2], 1)
    ends: Array = np.roll(path.breakpoints[2::2], 1)
    return PitchLine(
        path.length,
        starts,
        ends - starts,
        np.sign([arc.wrap_angle for arc in path.arcs]),
        np.zeros((RUN_ROWS, (points + SIMD_WIDTH) * count), dtype=np.int64),
        np.zeros(1, dtype=np.int64),
    )


def initial_positions(path: "Path", points: int) -> "Array":
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


def arc_shares(line: PitchLine, points: int, spacing: float) -> "Array":
    """Return the length of each point's part of the belt on each arc, (pulleys, n), m, at rest."""
    along = np.arange(points + 1) * spacing - line.starts[:, None]
    shares: Array = np.diff(np.minimum(np.maximum(along, 0.0), line.arcs[:, None]), axis=1)
    return shares
