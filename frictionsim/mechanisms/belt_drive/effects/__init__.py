"""The effects that a belt drive can have, one file each: parameters and kernel of the force."""

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
