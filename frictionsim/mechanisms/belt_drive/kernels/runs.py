"""Runs of candidates for a contact: neighbours on the belt that are neighbours in the list."""

from typing import TYPE_CHECKING

import numpy as np

from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel
from frictionsim.mechanisms.belt_drive.kernels.layout import SIMD_WIDTH

if TYPE_CHECKING:
    import numpy.typing as npt

    Bodies = npt.NDArray[np.uint64]


@inline_kernel
def run_end(body: "Bodies", start: int, count: int) -> int:
    """Return the end of the run that starts at a candidate: a loop over it needs no list.

    Candidates come in blocks of `SIMD_WIDTH` neighbours. Loops over a run count without a sign: an
    index that may be negative would be looked at for each number.
    """
    end = start + SIMD_WIDTH
    while end < count and body[end] == body[start] + np.uint64(end - start):
        end += SIMD_WIDTH
    return end
