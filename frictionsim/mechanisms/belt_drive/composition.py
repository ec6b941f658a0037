"""From a scenario to the arrays that the kernels step, in the plane or guided on a line."""

from collections import namedtuple
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.mechanisms.belt_drive.effects import EFFECTS
from frictionsim.mechanisms.belt_drive.effects.base import BeltProperties
from frictionsim.mechanisms.belt_drive.effects.patch import patch_bodies
from frictionsim.mechanisms.belt_drive.kernels.string import RUN_ROWS
from frictionsim.mechanisms.belt_drive.kernels.system import (
    CONTACT_ROWS,
    KINEMATIC_ROWS,
    PULLEY_ROWS,
    SIMD_WIDTH,
    SPEED_OVER_TIME,
    STRING_ROWS,
    STRING_WORKSPACE_ROWS,
    TORQUE_OVER_SPEED,
    TORQUE_OVER_TIME,
    WORKSPACE_ROWS,
    Array,
    Chain,
    Contacts,
    FrictionCoefficients,
    PitchLine,
    Plane,
    Pulleys,
    Signals,
    StateLayout,
    System,
    aligned_zeros,
    stack_signals,
    state_layout,
)
from frictionsim.mechanisms.belt_drive.kernels.wrap import wrap_factors
from frictionsim.scenario.signal_tables import SpeedTable, signal_from
from frictionsim.scenario.signals import Signal, linear

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.geometry import Path
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

    ComplexArray = npt.NDArray[np.complex128]


# The parameters of each effect, by its name.
EffectParameters: Any = namedtuple("EffectParameters", [e.key for e in EFFECTS])  # type: ignore[misc]


def compose(scenario: "BeltDriveScenario", body_length: float) -> System:
    """Return the system of a belt drive with bodies of a length, m, in the plane or on a line."""
    chain, pulleys = chain_of(scenario, body_length), _pulleys(scenario)
    count = pulleys.table.shape[1]
    kinematics: Any = Plane(chain.length)
    kinematic_rows, workspace_rows = KINEMATIC_ROWS, WORKSPACE_ROWS
    corrected = scenario.mechanism.belt.wrap == "corrected"
    if scenario.guided:
        kinematics = pitch_line(scenario.mechanism.path(), chain.bodies)
        kinematic_rows, workspace_rows = STRING_ROWS, STRING_WORKSPACE_ROWS
        corrected = False
    layout = state_layout(chain.bodies, count, len(pulleys.free), kinematic_rows)
    return System(
        layout,
        chain,
        effect_parameters(scenario, chain),
        _friction_coefficients(scenario, chain),
        _signals(scenario),
        aligned_zeros(workspace_rows, layout.width),
        _contacts(layout, count, corrected),
        pulleys,
        kinematics,
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


def chain_of(scenario: "BeltDriveScenario", body_length: float) -> Chain:
    """Return the common data of bodies of this length, m."""
    belt = scenario.mechanism.belt
    mass = belt.mass_per_length * body_length
    inertia = mass * body_length**2 / 12.0
    return Chain(belt.bodies, body_length, mass, inertia, scenario.mechanism.path().total_turning)


def effect_parameters(scenario: "BeltDriveScenario", chain: Chain) -> Any:
    """Return the parameters of each effect, None for those that the scenario lacks."""
    belt = BeltProperties(chain, scenario.mechanism.belt.axial_rigidity, scenario.mechanism.names)
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
                rows.append((j, TORQUE_OVER_SPEED, linear(term.speed, term.value)))
            else:
                rows.append((j, over_time, signal_from(term)))
    return stack_signals(rows)
