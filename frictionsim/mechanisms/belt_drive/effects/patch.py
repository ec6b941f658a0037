"""A dirty or oily part of the belt with other coefficients of friction."""

from typing import TYPE_CHECKING, Self

import numpy as np
from pydantic import model_validator

from frictionsim.mechanisms.belt_drive.effects.base import BeltEffect
from frictionsim.mechanisms.belt_drive.kernels.system import Chain
from frictionsim.scenario.schema import CoefficientsOfFriction, inconsistent, unit_field

if TYPE_CHECKING:
    import numpy.typing as npt


class PatchTable(CoefficientsOfFriction):
    """`[effects.patch]`: a part of the belt, by unstretched length, with other friction.

    Measured from where the belt leaves the first pulley at the start, in its direction.
    """

    start: float = unit_field(
        "m",
        "Start of the patch, from where the belt leaves the first pulley at the start.",
        alias="from",
        ge=0,
    )
    end: float = unit_field(
        "m", "End of the patch, in the direction of the belt.", alias="to", gt=0
    )

    @model_validator(mode="after")
    def _check_ends(self) -> Self:
        if not self.end > self.start:
            raise inconsistent(("to",), f"{self.end} m is not after from = {self.start} m")
        return self


class PatchEffect(BeltEffect):
    """`[effects.patch]`: it changes coefficients of friction and adds no force."""

    key = "patch"
    table = PatchTable
    on_guided_string = True


def patch_bodies(patch: PatchTable | None, chain: Chain) -> "npt.NDArray[np.bool_]":
    """Return which bodies are in the patch, (n,); none without one."""
    centres = (np.arange(chain.bodies) + 0.5) * chain.length
    if patch is None:
        return np.zeros(len(centres), dtype=bool)
    return (centres >= patch.start) & (centres < patch.end)
