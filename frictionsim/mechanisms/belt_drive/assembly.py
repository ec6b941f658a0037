"""A belt drive ready to be stepped: at rest, with what acts on it."""

from typing import TYPE_CHECKING

import numpy as np

from frictionsim.errors import ScenarioError
from frictionsim.mechanisms.belt_drive.composition import (
    BeltModel,
    chain_of,
    compose,
    distinct_static_friction,
    effect_parameters,
    error_scales,
)
from frictionsim.mechanisms.belt_drive.equilibrium import (
    Equilibrium,
    NoEquilibrium,
    find_equilibrium,
)
from frictionsim.mechanisms.belt_drive.guided_string.model import assemble_string, string_at_rest
from frictionsim.mechanisms.belt_drive.kernels.layout import (
    StateLayout,
    kinematics_of,
    zero_state,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

    Array = npt.NDArray[np.float64]
    Indices = npt.NDArray[np.int64]


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
        error_scales(equilibrium, system),
    )


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


def initial_state(equilibrium: Equilibrium, layout: StateLayout) -> "Array":
    """Return the state at the start: the belt in equilibrium, free pulleys at rest."""
    state = zero_state(layout)
    kinematics = kinematics_of(state, layout)
    kinematics[:3, : layout.bodies] = equilibrium.x, equilibrium.y, equilibrium.angle
    return state
