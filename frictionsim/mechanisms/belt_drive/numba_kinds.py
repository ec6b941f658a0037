"""Decorators of belt kernels: numba's `njit` with the options of each kind.

Kernels are plain loops over contiguous rows; they make no arrays and return none. `loop` is for a
loop of vectors: its array arguments do not overlap, but for those it only reads. `part` is copied
into what calls it, `shared` is called, `kernel` is what Python calls, kept on the disk.

Importing this imports numba, for half a second.
"""

import logging
from collections.abc import Callable
from typing import Any

from frictionsim.errors import InputError

try:
    from numba import njit
except ImportError as error:
    raise InputError(
        "belts are integrated by compiled code, for which the package numba cannot be imported"
        f" ({error}); install it with pip install numba"
    ) from None

from frictionsim.mechanisms.belt_drive.kernel_folder import folder_of_build, kept_in, listeners

LOG = logging.getLogger(__name__)

# All that lets sums be reordered into vectors; but a state that is not finite stays noticed.
OPTIONS: dict[str, Any] = {
    "fastmath": {"reassoc", "contract", "arcp", "nsz", "afn"},
    "error_model": "numpy",
    "no_cfunc_wrapper": True,  # C calls no kernel
}
PART: dict[str, Any] = {"no_cpython_wrapper": True}  # nor does Python call a part
DISJOINT: dict[str, Any] = {}
ANNOUNCED: dict[str, Any] = {}

# What numba has no public option for. Without it a step takes some 17 % longer, and no compilation
# is announced.
try:
    from numba.core.compiler import CompilerBase, DefaultPassBuilder, Flags
    from numba.core.options import DefaultOptions

    _passes: Any = DefaultPassBuilder

    if not hasattr(DefaultOptions, "_nrt") or not hasattr(Flags, "noalias"):
        raise AttributeError("no flag _nrt or noalias")

    class _Disjoint(CompilerBase):
        """Numba's compiler for a function whose array arguments do not overlap."""

        def define_pipelines(self) -> list[Any]:
            """Return the passes, as numba asks for them."""
            self.state.flags.noalias = True
            return [_passes.define_nopython_pipeline(self.state)]

    class _Announced(CompilerBase):
        """Numba's compiler, which tells that it begins."""

        def define_pipelines(self) -> list[Any]:
            """Return the passes, as numba asks for them."""
            for tell in listeners:
                tell()
            return [_passes.define_nopython_pipeline(self.state)]

    OPTIONS["_nrt"] = False  # do not count references to arrays
    DISJOINT["pipeline_class"] = _Disjoint
    ANNOUNCED["pipeline_class"] = _Announced
except (ImportError, AttributeError) as error:
    LOG.info("kernels of belts will be slower: numba has no such insides (%s)", error)


def part(function: Callable[..., Any]) -> Any:
    """Compile a function as a part of each kernel that calls it."""
    return njit(function, **OPTIONS, **PART, forceinline=True)


def loop(function: Callable[..., Any]) -> Any:
    """Compile a part whose array arguments have no element in common, but for those it reads.

    A loop that writes several arrays becomes vector instructions without a look at overlaps.
    """
    return njit(function, **OPTIONS, **PART, **DISJOINT, forceinline=True)


def shared(function: Callable[..., Any]) -> Any:
    """Compile a function that kernels call in several places, too large to repeat."""
    return njit(function, **OPTIONS, **PART)


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function that Python calls, and keep its code on the disk if it is our own."""
    is_own = function.__module__.startswith("frictionsim.")
    folder = folder_of_build() if is_own else None
    return njit(function, **OPTIONS, **ANNOUNCED, **kept_in(folder))
