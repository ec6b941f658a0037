"""A dirty or oily part of the belt with other coefficients of friction."""

from typing import TYPE_CHECKING

import numpy as np

from frictionsim.mechanisms.belt_drive.effects.base import BeltEffect
from frictionsim.mechanisms.belt_drive.kernels.system import Chain
from frictionsim.mechanisms.belt_drive.schema import PatchTable

if TYPE_CHECKING:
    import numpy.typing as npt


class PatchEffect(BeltEffect):
    """`[effects.patch]`: it changes coefficients of friction and adds no force."""

    key = "patch"


def patch_bodies(patch: PatchTable | None, chain: Chain) -> "npt.NDArray[np.bool_]":
    """Return which bodies are in the patch, (n,); none without one."""
    centres = (np.arange(chain.bodies) + 0.5) * chain.length
    if patch is None:
        return np.zeros(len(centres), dtype=bool)
    return (centres >= patch.start) & (centres < patch.end)
