"""Compilation of plain functions on named tuples of numbers; numba is imported here, when needed.

Functions that may be compiled are marked with `compilable`, and stay as they are for Python. An
argument may be a named tuple of numbers, arrays (`array.array` of doubles) and other such tuples;
its class may have methods, which compiled code calls as Python does. `reason_against` says before
anything is compiled what an argument has that cannot be.

Compiled code is kept on the disk. numba compares the time stamp of one file only, so the folder of
a build carries a digest of all that goes into it: the sources of this package, and the code of a
plug-in with what it takes from elsewhere (`code_digest`). Belts, whose kernels are functions of
arrays (`belt_drive.kernels`), keep theirs in the same way.
"""

import gc
import os
import platform
import re
import sys
import threading
from array import array
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import cache, cached_property, partial
from hashlib import sha256
from importlib import import_module
from itertools import count
from math import inf, ulp
from pathlib import Path
from time import time
from types import FunctionType
from typing import Any, TypeVar

from frictionsim.solvers.code_digest import code_digest, is_known

Marked = TypeVar("Marked", bound=Callable[..., Any] | type)

# Without contraction of products and sums compiled arithmetic has the bits of Python's, and a
# division by zero ends compiled code as it ends Python's. Nothing here makes arrays (`_nrt`).
OPTIONS: dict[str, Any] = {
    "error_model": "python",
    "fastmath": False,
    "_nrt": False,
    "no_cfunc_wrapper": True,
}
# Modules whose functions and constants go into compiled code.
SHARED = ("*.py", "mechanisms/**/*.py", "scenario/*.py", "solvers/*.py")
# Lines about a processor on Linux that say for which one code is.
PROCESSOR = ("model name", "flags", "CPU implementer", "CPU part", "Features")
# In an error of numba, the first place that is not in its own sources.
PLACE_OF_CAUSE = re.compile(
    r"^( *)During: .* at (?!.*[\\/]numba[\\/])(.*) \((\d+)\)$", re.MULTILINE
)
IMPORTED = time()  # s

_marked: list[Any] = []
_inlined: set[Any] = set()
_replaced: list[tuple[Any, Callable[..., Any], int]] = []
_choices: dict[Any, Callable[..., Any]] = {}  # what is in the place of functions
_alive: list[Any] = []  # numba knows a marked function by its dispatcher, as long as that lives
_methods: dict[str, int] = {}  # the number of parameters by name
_registered: set[str] = set()
_lock = threading.RLock()  # around what numba is told and asked: any thread may be the first
# In this process; a form that failed once is not tried again, none without a compiler.
_compiled_forms: set[tuple[Any, ...]] = set()
_failed_forms: set[tuple[Any, ...]] = set()
ANY_FORM: tuple[Any, ...] = ()


def compilable(function: Marked) -> Marked:
    """Mark a function that compiled functions call, or a class of named tuples that they make.

    A function takes and returns numbers and tuples of them.
    """
    _marked.append(function)
    return function


def inlined(function: Marked) -> Marked:
    """Mark a function, beside `compilable`, whose code is to be in the place of each call.

    Passing system and run takes longer than a step does with them at hand.
    """
    _inlined.add(function)
    return function


def compiled_as(replacement: Callable[..., Any]) -> Callable[[Marked], Marked]:
    """Mark a function in whose place compiled code calls another of the same parameters."""

    return compiled_by_type(lambda *_: replacement, _parameters(replacement))


def compiled_by_type(choice: Callable[..., Any], parameters: int) -> Callable[[Marked], Marked]:
    """Mark a function in whose place compiled code calls the one chosen by types of arguments."""

    def marked(function: Marked) -> Marked:
        _replaced.append((function, choice, parameters))
        _choices[function] = choice
        return function

    return marked


def reason_against(value: Any, above: tuple[type, ...] = ()) -> str:
    """Return why an argument cannot be compiled for; empty if it can."""
    kind = type(value)
    if kind in (float, int, bool, str):
        return ""
    if kind is array:
        return "" if value.typecode == "d" else f"an array of type '{value.typecode}'"
    if not isinstance(value, tuple):
        return f"a value of type {kind.__name__}"
    if kind is not tuple:
        if not value:
            return f"{kind.__name__} has no fields"
        if kind in above:
            return f"{kind.__name__} is nested in itself"
    return next(filter(None, (reason_against(inner, (*above, kind)) for inner in value)), "")


def classes_of(value: Any) -> Iterator[type]:
    """Yield the classes of named tuples in an argument."""
    if isinstance(value, tuple):
        if type(value) is not tuple:
            yield type(value)
        for inner in value:
            yield from classes_of(inner)


def packed(value: Any, runs: int = 1) -> tuple[Any, Any]:
    """Return the arguments of many runs as compiled code takes them: a template, and numbers.

    Parameters
    ----------
    value : tuple
        The argument, of which a number may be an array (runs,), and an array one of (runs, n).
    runs : int

    Returns
    -------
    tuple
        The argument with arrays of (runs, n), or (1, n) where they are the same in all runs.
    (runs, k) array
        The numbers of double precision in it, one after the other.
    """
    import numpy as np

    columns: list[Any] = []

    def template(value: Any) -> Any:
        if isinstance(value, tuple):
            parts = map(template, value)
            return tuple(parts) if type(value) is tuple else type(value)(*parts)
        if _is_number(value):
            columns.append(value)
            return 0.0
        if isinstance(value, array | np.ndarray):
            return np.array(value, order="C", ndmin=2)
        return value

    made, numbers = template(value), np.empty((runs, len(columns)))
    for k, column in enumerate(columns):
        numbers[:, k] = column
    return made, numbers


def _is_number(value: Any) -> bool:
    """Return whether a value is a number of double precision, or one of each of many runs."""
    return type(value) is float or getattr(value, "ndim", 0) == 1


def form_of(value: Any) -> Any:
    """Return the types of an argument, of one run or of many: compiled code is for one form."""
    if isinstance(value, tuple):
        return (type(value), *map(form_of, value))
    if _is_number(value):
        return float
    return array if hasattr(value, "ndim") else type(value)


def argument_of(template: Any, numbers: Any, run: int) -> Any:
    """Return the argument of one of many runs."""
    left = iter(numbers[run].tolist())

    def filled(value: Any) -> Any:
        if isinstance(value, tuple):
            parts = [filled(inner) for inner in value]
            return tuple(parts) if type(value) is tuple else type(value)(*parts)
        if hasattr(value, "ndim"):
            return array("d", value[min(run, len(value) - 1)])
        return next(left) if type(value) is float else value

    return filled(template)


def _filling(template: Any, numbers: Any, run: Any) -> Any:
    """Return the function that `argument_of` is compiled as for a template of some type."""
    types: Any = import_module("numba").types
    names: dict[str, type] = {}
    columns = count()

    def text(kind: Any, place: str) -> str:
        if isinstance(kind, types.BaseTuple):
            name = ""
            if isinstance(kind, types.BaseNamedTuple):
                name = f"class_{len(names)}"
                names[name] = kind.instance_class
            parts = [text(inner, f"{place}[{i}]") for i, inner in enumerate(kind.types)]
            return f"{name}({''.join(f'{part}, ' for part in parts)})"
        if isinstance(kind, types.Array):
            return f"{place}[min(x2, len({place}) - 1)]"
        return f"x1[x2, {next(columns)}]" if kind is types.float64 else place

    return eval(f"lambda x0, x1, x2: {text(template, 'x0')}", names)


class Kernel:
    """A marked function for arguments of one form.

    Parameters
    ----------
    function : callable
    arguments : tuple
        Its first arguments, named tuples.

    Attributes
    ----------
    form : tuple
        Function and types; equal kernels have one form.
    reason : str
        Why it cannot be compiled; empty if it can.
    """

    def __init__(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
        self._function, self._arguments = function, arguments

    @cached_property
    def reason(self) -> str:
        return reason_against(self._arguments)

    @cached_property
    def form(self) -> tuple[Any, ...]:
        return (self._function, form_of(self._arguments))

    @cached_property
    def _classes(self) -> frozenset[type]:
        return frozenset(classes_of(self._arguments))

    @property
    def _roots(self) -> frozenset[Any]:
        return self._classes | {self._function}

    @property
    def is_loaded(self) -> bool:
        """Whether it is compiled in this process."""
        return not self.reason and self.form in _compiled_forms

    @property
    def is_at_hand(self) -> bool:
        """Whether it is compiled, in this process or on the disk."""
        if self.form in _compiled_forms:
            return True
        mark = self._file("form")
        return mark is not None and mark.exists()

    @property
    def steps_as_python(self) -> float:
        """How many steps long runs of all processes took as Python."""
        file = self._file("steps")
        if file is not None:
            with suppress(OSError, ValueError):  # there is none yet
                return sum(map(float, file.read_text().split()))
        return 0.0

    def count_steps_as_python(self, steps: int) -> None:
        """Count steps of a long run for later processes."""
        file = self._file("steps")
        if file is not None:
            with suppress(OSError), file.open("a") as lines:
                lines.write(f"{steps}\n")

    def _file(self, suffix: str) -> Path | None:
        """Return what is kept of the form on the disk; None if nothing can be."""
        folder = folder_of(self._roots) if not self.reason else None
        text = f"{self._function.__qualname__}{form_of(self._arguments)}{_compiler()}"
        return folder and folder / f"{sha256(text.encode()).hexdigest()[:16]}.{suffix}"

    def compiled(self, call: Callable[[Any], Any]) -> Any:
        """Return the function as numba compiles it; None if it cannot be, which a warning says.

        Parameters
        ----------
        call : callable
            Calls the function that it is given, which compiles it, and evaluates no equation.
        """
        if self.reason or _failed_forms & {self.form, ANY_FORM}:
            _log().info("not compiled: %s", self.reason or "it failed before")
            return None
        failed = self._file("failed")
        if failed is not None and failed.exists():  # in an earlier process
            self._warn_of(failed.read_text(), self.form)
            return None
        try:
            with _lock:
                function = _dispatcher(self._function, self._classes)
                if self.form not in _compiled_forms:
                    with without_collection():
                        function = self._called(call, function)
        except Exception as error:  # whatever is wrong with a compiler, the run takes its time
            said = f"{type(error).__name__}: {_cause_in(str(error))}"
            if failed is not None and type(error).__module__ == "numba.core.errors":
                with suppress(OSError):
                    failed.write_text(said)
            self._warn_of(said, ANY_FORM if isinstance(error, ImportError) else self.form)
            return None
        if self.form not in _compiled_forms:
            _compiled_forms.add(self.form)
            mark = self._file("form")
            if mark is not None:
                with suppress(OSError):  # on a full disk the next process compiles again
                    mark.touch()
        return function

    @staticmethod
    def _warn_of(failure: str, form: tuple[Any, ...]) -> None:
        _failed_forms.add(form)  # for which this process warns once
        _log().warning(
            "the equation of motion is not compiled, so that long runs and sweeps take the time of"
            " Python (%s)",
            failure,
        )

    def _called(self, call: Callable[[Any], Any], function: Any) -> Any:
        """Return a function that `call` has called, and so compiled."""
        try:
            call(function)
        except OSError as error:  # a full disk: compiled for this process alone
            _log().warning("the compiled code cannot be kept: %s", error)
            function = _dispatcher(self._function, self._classes, is_kept=False)
            call(function)
        return function


def _log() -> Any:
    import logging  # imported here: commands that only check a scenario do without

    return logging.getLogger(__name__)


def _cause_in(message: str) -> str:
    """Return the line of an error of numba that says what it cannot compile, and where.

    Inside of the message on a call is that on what is called, indented; a place is behind each.
    """
    place = PLACE_OF_CAUSE.search(message)
    causes = place and re.findall(rf"pipeline .*\n{place[1]}(\S.*)", message[: place.start()])
    return (
        f"{causes[-1]} ({place[2]}:{place[3]})" if place and causes else message.partition("\n")[0]
    )


@cache
def _compiler() -> tuple[Any, ...]:
    """Return versions and processor for which numba's files are valid."""
    from importlib.metadata import version

    with suppress(ImportError):
        numba = version("numba")
        return numba, sys.version, _processor(), os.environ.get("NUMBA_CPU_NAME")
    return ()


def _processor() -> str:
    """Return model and instructions of the processor; where they are unknown, the machine."""
    with suppress(OSError):
        first, *_ = Path("/proc/cpuinfo").read_text().split("\n\n")  # of one core
        lines = [line for line in first.splitlines() if line.startswith(PROCESSOR)]
        return "\n".join(lines)
    return platform.node()


def build_name(roots: Iterable[Any] = ()) -> str:
    """Return the name of the build: another one when a source changes.

    It is empty if a source of this package was edited since this process began: its code may not be
    that of its source.

    Parameters
    ----------
    roots : iterable
        Functions and classes of plug-ins.
    """
    package, digest, now = Path(__file__).parents[1], sha256(), time()
    for path in sorted({file for pattern in SHARED for file in package.glob(pattern)}):
        if IMPORTED < path.stat().st_mtime < now:
            return ""
        digest.update(str(path).encode() + path.read_bytes())
    digest.update(code_digest(roots, _choices).encode())
    return f"kernels-{digest.hexdigest()[:16]}"


@cache
def folder_of(roots: frozenset[Any]) -> Path | None:
    """Return the folder that keeps the code of functions and classes; None if none can be kept.

    All of this package is kept together.
    """
    from frictionsim.solvers.kernel_folder import usable_folder

    others = [root for root in roots if not is_known(root.__module__)]
    if not all(hasattr(sys.modules.get(root.__module__), "__file__") for root in others):
        return None  # of a notebook, whose classes no other process finds
    name = build_name(sorted(others, key=lambda root: (root.__module__, root.__qualname__)))
    return usable_folder(name) if name else None


def kept_in(folder: Path | None) -> dict[str, Any]:
    """Return the options of numba for code that is kept in a folder.

    Each time anew: numba takes the folder from the environment again when that changes, or from a
    file `.numba_config.yaml` where the user is.
    """
    if folder is None:
        return {}
    config: Any = import_module("numba").config
    config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = str(folder), ""
    return {"cache": True}


@cache
def _dispatcher(
    function: Callable[..., Any], classes: frozenset[type], is_kept: bool = True
) -> Any:
    """Return a marked function as numba compiles it, for arguments of some classes."""
    numba = _prepare()
    for one in classes:
        _register_methods(one)
    kept = kept_in(folder_of(classes | {function})) if is_kept else {}
    return numba.njit(function, **OPTIONS, **kept)


def _prepare() -> Any:
    """Import numba; tell it of the marked functions, and of those of Python that it lacks."""
    import numpy as np

    numba: Any = import_module("numba")  # whose types lack some options

    def ulp_of(x: float) -> float:
        return np.nextafter(abs(x), inf) - abs(x)

    if not _alive:
        compiled_as(ulp_of)(ulp)
        compiled_as(_bisect_right)(bisect_right)
        compiled_by_type(_filling, _parameters(argument_of))(argument_of)
    options = _options_of_parts()
    while _marked:  # modules that were imported since the last time may have more
        function = _marked.pop()
        if isinstance(function, type):
            _register_methods(function)
            continue
        dispatcher = numba.njit(function, **options, forceinline=function in _inlined)
        _alive.append(dispatcher)
        _compile_once(dispatcher)
        function._numba_type_ = dispatcher._numba_type_
    while _replaced:
        function, choice, parameters = _replaced.pop()
        chosen = _typing_function(choice, parameters)
        numba.extending.overload(function, jit_options=options, strict=False)(chosen)
    return numba


def compiler_of_parts(name: str = "PartCompiler") -> Any:
    """Return a compiler of parts; numba's own one where its insides are not those we know."""
    try:
        from frictionsim.solvers import compiled_parts
    except (ImportError, AttributeError):
        from numba.core.compiler import Compiler

        return Compiler
    return getattr(compiled_parts, name)


@contextmanager
def without_collection() -> Iterator[None]:
    """Search for no garbage in a block that compiles: all the while that would find nothing."""
    is_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if is_enabled:
            gc.enable()


def _options_of_parts() -> dict[str, Any]:
    return {**OPTIONS, "no_cpython_wrapper": True, "pipeline_class": compiler_of_parts()}


def _compile_once(dispatcher: Any) -> None:
    """Have a function compiled once for all constants as arguments, not for each of them."""
    from numba.core.types import unliteral

    template = dispatcher.get_call_template
    dispatcher.get_call_template = lambda args, kws: template(tuple(map(unliteral, args)), kws)


def _typing_function(choice: Callable[..., Any], count: int) -> Any:
    """Return the function by which numba resolves a call for the types of the arguments.

    Its parameters have the same names, whatever those in another class are.
    """
    parameters = ", ".join(f"x{i}" for i in range(count))
    return eval(f"lambda {parameters}: choice({parameters})", {"choice": choice})


def _parameters(function: Any) -> int:
    return int(function.__code__.co_argcount)


def _bisect_right(values: Any, x: float) -> int:
    low, high = 0, len(values)
    while low < high:
        middle = (low + high) // 2
        if x < values[middle]:
            high = middle
        else:
            low = middle + 1
    return low


def _register_methods(kind: type) -> None:
    """Let compiled code call the methods of a class of named tuples."""
    numba = _prepare()
    known_as: dict[str, Any] = {"jit_options": _options_of_parts(), "strict": False}
    for name in dir(kind):
        method = getattr(kind, name)
        if not isinstance(method, FunctionType) or name.startswith("_"):
            continue
        count = _parameters(method)
        if _methods.setdefault(name, count) != count:  # numba asks the first of a name only
            raise TypeError(
                f"the method '{name}' of {kind.__name__} has {count} parameters, one of another"
                f" class {_methods[name]}; give it another name"
            )
        if name not in _registered:
            _registered.add(name)
            chosen = _typing_function(partial(_method_of, name), count)
            named_tuple = numba.types.BaseNamedTuple
            numba.extending.overload_method(named_tuple, name, **known_as)(chosen)
            _leave_fields()


def _method_of(name: str, kind: Any, *_: Any) -> Any:
    return getattr(kind.instance_class, name, None)


def _leave_fields() -> None:
    """Have the method registered last hide no field of its name in another class."""
    from numba.core.typing.templates import builtin_registry

    template = builtin_registry.attributes[-1]
    method = template._resolve

    def resolved(self: Any, kind: Any, name: str) -> Any:
        return None if name in getattr(kind, "fields", ()) else method(self, kind, name)

    template._resolve = resolved
