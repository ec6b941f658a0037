"""Compiled kernels: numba is imported here, and not before a kernel is called.

Kernels are plain loops over contiguous arrays. They are compiled once for each combination of
effects that a scenario calls for, and kept on the disk for later runs (`solvers.compilation`).
"""

import logging
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from functools import cache, cached_property, update_wrapper
from pathlib import Path
from time import perf_counter
from typing import Any

from frictionsim.errors import InputError
from frictionsim.simulation.monitor import RunMonitor
from frictionsim.solvers.compilation import (
    compiler_of_parts,
    folder_of,
    kept_in,
    without_collection,
)

LOG = logging.getLogger(__name__)

# All that lets sums be reordered into vectors; but a state that is not finite stays noticed.
FASTMATH_FLAGS = {"reassoc", "contract", "arcp", "nsz", "afn"}

OPTIONS: dict[str, Any] = {
    "fastmath": FASTMATH_FLAGS,
    "error_model": "numpy",
    "no_cfunc_wrapper": True,  # C calls no kernel
    "_nrt": False,
}

# Of a kernel that is a part of others: what Python calls it by would take as long to compile.
PART: dict[str, Any] = {"no_cpython_wrapper": True}
COPIED: dict[str, Any] = {"forceinline": True, **PART}

_functions: set[Any] = set()  # of all kernels


class BeltKernel:
    """A function that is compiled when Python or another kernel first calls it.

    A scenario can so be read and checked without numba, which takes half a second to import,
    though the kernels of an effect stand beside its parameters.

    Kernels make no arrays and return none. So numba need not count who uses one: counting all
    arrays of a `System` wherever a part of it is taken would cost more than the forces (`_nrt`).
    """

    def __init__(
        self, function: Callable[..., Any], compiler: str = "PartCompiler", **part_options: Any
    ) -> None:
        self.py_func = function
        self._compiler, self._part_options = compiler, part_options
        update_wrapper(self, function)
        _functions.add(function)

    def __call__(self, *arguments: Any) -> Any:
        return self.compiled(*arguments)

    @cached_property
    def compiled(self) -> Any:
        """The function as Python calls it."""
        return _compiled(self.py_func, **kept_in(_folder()))

    @cached_property
    def part(self) -> Any:
        """The function as other kernels call it."""
        if not self._part_options:
            return self.compiled
        return _compiled(
            self.py_func, pipeline_class=compiler_of_parts(self._compiler), **self._part_options
        )

    @property
    def _numba_type_(self) -> Any:
        """The type that numba gives it in a kernel that calls it."""
        return self.part._numba_type_


class KernelChoice:
    """Kernels of one signature; the class of the first argument, a named tuple, chooses.

    Kernels that call it are compiled with the one for the type that they have: nothing is asked
    while they run.

    Parameters
    ----------
    kernels : mapping of type to BeltKernel
    """

    def __init__(self, kernels: Mapping[type, BeltKernel]) -> None:
        self._kernels = kernels

    def __call__(self, first: Any, *arguments: Any) -> Any:
        return self._kernels[type(first)](first, *arguments)

    @cached_property
    def _numba_type_(self) -> Any:
        """The type that numba gives it in a kernel that calls it."""
        _numba()
        from numba.core.registry import cpu_target
        from numba.extending import overload

        def choice(*arguments: Any) -> Any:
            """Stand for all of the kernels."""

        options: Any = {**OPTIONS, **COPIED, "pipeline_class": compiler_of_parts()}

        @overload(choice, jit_options=options, strict=False)
        def chosen(first: Any, *arguments: Any) -> Any:
            return self._kernels[first.instance_class].py_func

        cpu_target.typing_context.refresh()
        return cpu_target.typing_context.resolve_value_type(choice)


def _compiled(function: Callable[..., Any], **options: Any) -> Any:
    return _numba().njit(function, **OPTIONS, **options)


def inline_kernel(function: Callable[..., Any]) -> Any:
    """Compile a function as a part of each kernel that calls it: the call costs nothing."""
    return BeltKernel(function, **COPIED)


def loop_kernel(function: Callable[..., Any]) -> Any:
    """Compile a part whose array arguments have no element in common, but for those it only reads.

    A loop that writes several arrays is so made of vector instructions with no look at overlaps
    first, for which a compiler would make a second version of it, or give up. Arrays may come in
    tuples.
    """
    return BeltKernel(function, compiler="LoopCompiler", **COPIED)


def shared_kernel(function: Callable[..., Any]) -> Any:
    """Compile a function that kernels call in several places, and that is too large to repeat."""
    return BeltKernel(function, **PART)


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function that Python calls."""
    return BeltKernel(function)


@cache
def _numba() -> Any:
    try:
        import numba
    except ImportError as error:
        raise InputError(
            "belts are integrated by compiled code, for which the package numba cannot be imported"
            f" ({error}); install it with pip install numba"
        ) from None
    return numba


@cache
def _folder() -> Path | None:
    """Return the folder that numba keeps the kernels of this build in; None if in none."""
    folder = folder_of(frozenset(_functions))
    if folder is not None:
        LOG.info("folder of the compiled kernels: %s", folder)
    return folder


class Compilation:
    """Compilation statistics of a `with` block.

    Attributes
    ----------
    seconds : float
        How long it took; 0 where every kernel was on the disk.
    noticed : bool
    """

    def __init__(self) -> None:
        self.seconds = 0.0
        self.noticed = False


@contextmanager
def announce_compilation(expected: float, monitor: RunMonitor) -> Iterator[Compilation]:
    """Announce and time the compilations in a `with` block.

    Parameters
    ----------
    expected : float
        Seconds that it should take.
    monitor : RunMonitor
        Its `compiling` is entered when something is compiled.
    """
    _numba()
    _folder()
    from numba.core import event

    compilation = Compilation()

    class Listener(event.Listener):
        """Hears of each kernel that is compiled because it is not on the disk."""

        def on_start(self, event: Any) -> None:
            """Announce the first."""
            if not compilation.noticed:
                stack.enter_context(monitor.compiling(expected))
                LOG.info("compilation of kernels starts")
            compilation.noticed = True

        def on_end(self, event: Any) -> None:
            """Do nothing: there may be more."""

    with ExitStack() as stack:
        started = perf_counter()
        with event.install_listener("numba:compile", Listener()), without_collection():
            yield compilation
        if compilation.noticed:
            compilation.seconds = perf_counter() - started
            LOG.info("kernels compiled in %.3g s", compilation.seconds)


def sum_of(terms: Mapping[str, Any], parameters: str) -> Any:
    """Return a kernel that sums what others return.

    Parameters
    ----------
    terms : mapping of str to BeltKernel
        Each with the arguments that it is called with, "system.effects.gravity, x".
    parameters : str
        Of the kernel, "system, x".

    numba has no loop over different functions; so its lines are written out. A kernel in a file
    that calls this one is kept on the disk like any other.
    """
    names = {f"kernel_{i}": kernel for i, kernel in enumerate(terms.values())}
    lines = [f"    total += {name}({call})" for name, call in zip(names, terms, strict=True)]
    code = "\n".join(
        [f"def total_of({parameters}):", "    total = 0.0", *lines, "    return total"]
    )
    scope: dict[str, Any] = {"__name__": __name__, **names}
    exec(compile(code, __file__, "exec"), scope)
    return inline_kernel(scope["total_of"])
