"""A belt drive ready to be stepped: at rest, with what acts on it."""

from typing import TYPE_CHECKING

import numpy as np

from frictionsim.errors import ScenarioError
from frictionsim.mechanisms.belt_drive.composition import (
    BeltModel,
    chain_of,
    compose,
    contact_stiffness,
    distinct_static_friction,
    effect_parameters,
)
from frictionsim.mechanisms.belt_drive.equilibrium import (
    Equilibrium,
    NoEquilibrium,
    find_equilibrium,
)
from frictionsim.mechanisms.belt_drive.guided_string.model import assemble_string, string_at_rest
from frictionsim.mechanisms.belt_drive.kernels.layout import (
    PULLEY_RADIUS,
    StateLayout,
    kinematics_of,
    zero_state,
)
from frictionsim.mechanisms.belt_drive.kernels.system import (
    System,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

    Array = npt.NDArray[np.float64]
    Indices = npt.NDArray[np.int64]


# The error of a body's rotation counts a tenth of that of its place over its length: the ends that
# it moves across a joint change the joint's length, and so its tension, in second order only.
ROTATION_TOLERANCE = 10.0


def assemble(scenario: "BeltDriveScenario") -> BeltModel:
    """Find the belt's equilibrium and compose its equations of the effects of the scenario."""
    if scenario.guided:
        return assemble_string(scenario)
    equilibrium = solve_equilibrium(scenario)
    system = compose(scenario, equilibrium.body_length)
    return BeltModel(
        system,
        distinct_static_friction(system),
        equilibrium,
        initial_state(equilibrium, system.layout),
        _error_scales(equilibrium, system),
    )


def solve_equilibrium(scenario: "BeltDriveScenario") -> Equilibrium:
    """Return the belt at rest, without friction.

    Raises
    ------
    ScenarioError
    """
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


def initial_state(equilibrium: Equilibrium, layout: StateLayout) -> "Array":
    """Return the state at the start: the belt in equilibrium, free pulleys at rest."""
    state = zero_state(layout)
    kinematics = kinematics_of(state, layout)
    kinematics[:3, : layout.bodies] = equilibrium.x, equilibrium.y, equilibrium.angle
    return state


def _error_scales(equilibrium: Equilibrium, system: System) -> "Array":
    """Return the size of each state that its error is measured by."""
    layout, length, mass = system.layout, system.chain.length, system.chain.mass
    stiffness = system.effects.axial_damping.stiffness
    radius = float(np.min(system.pulleys.table[PULLEY_RADIUS]))
    contact = contact_stiffness(system.effects, equilibrium)
    depth = float(np.max(equilibrium.normal_force, initial=0.0)) / contact
    # What is the smaller of the two decides how exactly positions have to be known.
    stretch = float(np.mean(equilibrium.tension)) / stiffness
    speed = min(stretch * np.sqrt(stiffness / mass), depth * np.sqrt(contact / mass))
    stretch = min(stretch, depth)
    scales = np.full(layout.size, np.inf)
    rows = kinematics_of(scales, layout)
    turning = ROTATION_TOLERANCE / length
    rows[:] = np.array([(stretch, stretch, turning * stretch, speed, speed, turning * speed)]).T
    scales[layout.angles : layout.speeds] = stretch / radius
    scales[layout.speeds : layout.energies] = speed / radius
    return scales
