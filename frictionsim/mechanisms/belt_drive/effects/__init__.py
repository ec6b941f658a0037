"""The effects that a belt drive can have, one file each.

A file has the table of the scenario, the parameters of the force, the force itself, a kernel, and
what it does to the highest frequency and decay rate, which bound the steps. Energies are in
`energy.py`.

A new effect is a class derived from `BeltEffect` and a line in this list. Forces are added in the
order of their stages, scenarios list effects in the order of the list.
"""

from frictionsim.mechanisms.belt_drive.effects.axial import AxialEffect
from frictionsim.mechanisms.belt_drive.effects.base import BeltEffect
from frictionsim.mechanisms.belt_drive.effects.belt_friction import FrictionEffect
from frictionsim.mechanisms.belt_drive.effects.bending import BendingEffect
from frictionsim.mechanisms.belt_drive.effects.contact import ContactEffect
from frictionsim.mechanisms.belt_drive.effects.gravity import GravityEffect
from frictionsim.mechanisms.belt_drive.effects.patch import PatchEffect

EFFECTS: list[BeltEffect] = [
    ContactEffect(),
    FrictionEffect(),
    AxialEffect(),
    BendingEffect(),
    GravityEffect(),
    PatchEffect(),
]


def ordered_effects() -> list[BeltEffect]:
    """Return the effects in the order in which their forces are added."""
    return sorted(EFFECTS, key=lambda effect: effect.stage)
