"""Functions of many runs: the same arithmetic on one number of each run.

`build` of a mechanism returns functions that hold numbers of their scenario, and that use
arithmetic only. Those of two runs differ in these numbers alone; one function that holds arrays in
their place evaluates all runs at once. Sums, products, quotients and roots of arrays are those of
numbers to the last bit (IEEE 754); powers, sines and cosines are where the checks below say so.
"""

import math
from collections.abc import Callable, Sequence
from copy import copy
from functools import cache
from itertools import repeat
from operator import is_
from types import CellType, FunctionType
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.solvers.lockstep_signals import Unlike, joined_signal

if TYPE_CHECKING:
    from frictionsim.solvers.mechanism import Mechanism

POWER = "**"  # of an instruction of Python


class ExactPowers(np.ndarray):
    """An array whose powers are those of floats; numpy has faster ones that round differently."""

    def __pow__(self, exponent: Any, modulo: Any = None) -> Any:
        with np.errstate(over="raise"):  # as of floats, whose products do not
            return np.float_power(self, exponent)


def joined(values: Sequence[Any]) -> Any:
    """Return one value for those of many runs: numbers that differ become an array.

    Parameters
    ----------
    values : sequence
        Numbers, functions that hold numbers, or tuples and objects of these; one for each run.

    Raises
    ------
    Unlike
        If they differ in more than numbers.
    """
    first = values[0]
    if isinstance(first, float):
        return _joined_numbers(values)
    if all(map(is_, values, repeat(first))):
        return first
    if set(map(type, values)) != {type(first)}:
        raise Unlike
    if isinstance(first, FunctionType):
        return _joined_function(first, values)
    if isinstance(first, tuple):
        return _remade(first, _joined_items(values))
    if isinstance(first, bool | int | str):
        if any(value != first for value in values):
            raise Unlike
        return first
    if hasattr(first, "__dict__"):
        return _joined_object(first, values)
    raise Unlike


def _joined_numbers(values: Sequence[Any]) -> Any:
    found = np.array(values)
    if found.dtype != np.float64:
        raise Unlike
    same = found.view(np.int64) == found.view(np.int64)[0]  # tells 0.0 from -0.0
    return values[0] if same.all() else found


def _joined_items(values: Sequence[Any]) -> list[Any]:
    if set(map(len, values)) != {len(values[0])}:
        raise Unlike
    return [joined(items) for items in zip(*values, strict=True)]


def _joined_function(first: FunctionType, values: Sequence[Any]) -> Any:
    code = first.__code__
    if first.__kwdefaults__ or not all(f.__code__ is code for f in values):
        raise Unlike
    defaults = joined([f.__defaults__ for f in values])
    try:
        cells = [
            joined([f.__closure__[i].cell_contents for f in values])
            for i in range(len(code.co_freevars))
        ]
    except ValueError:  # a cell is empty
        raise Unlike from None
    return _function(first, defaults, cells)


def _joined_object(first: Any, values: Sequence[Any]) -> Any:
    if any(vars(value).keys() != vars(first).keys() for value in values):
        raise Unlike
    found = copy(first)
    vars(found).update({name: joined([vars(v)[name] for v in values]) for name in vars(first)})
    return found


def _function(like: FunctionType, defaults: Any, cells: list[Any]) -> FunctionType:
    closure = tuple(map(CellType, cells))
    return FunctionType(like.__code__, like.__globals__, like.__name__, defaults, closure)


def _remade(like: Any, items: list[Any]) -> Any:
    return type(like)(*items) if hasattr(like, "_fields") else type(like)(items)


def changed(value: Any, change: Callable[[Any], Any]) -> Any:
    """Return a joined value with another in the place of each array of one number per run."""
    if isinstance(value, np.ndarray):
        return change(value)
    if isinstance(value, FunctionType) and value.__closure__:
        cells = [changed(cell.cell_contents, change) for cell in value.__closure__]
        return _function(value, value.__defaults__, cells)
    if isinstance(value, tuple):
        return _remade(value, [changed(item, change) for item in value])
    if _holds_arrays(value):
        found = copy(value)
        vars(found).update({name: changed(item, change) for name, item in vars(value).items()})
        return found
    return value


def _holds_arrays(value: Any) -> bool:
    return (
        hasattr(value, "__dict__")
        and not isinstance(value, FunctionType | type)
        and any(
            isinstance(item, np.ndarray) or _holds_arrays(item) for item in vars(value).values()
        )
    )


def joined_mechanism(mechanisms: "Sequence[Mechanism]") -> "Mechanism":
    """Return the mechanism of many runs, whose functions take and return arrays.

    Only the members that a solver uses are joined; the others are those of the first run.

    Raises
    ------
    Unlike
        If the mechanisms differ in more than numbers.
    """
    first = mechanisms[0]
    contacts = [mechanism.contact for mechanism in mechanisms]
    if any(contact is None for contact in contacts):
        raise Unlike
    breaks = _joined_breaks([contact.monotonicity_breaks for contact in contacts])  # type: ignore[union-attr]
    bare = [contact._replace(monotonicity_breaks=()) for contact in contacts]  # type: ignore[union-attr]

    def joined_functions(name: str) -> dict[str, Any]:
        tables = [getattr(mechanism, name) for mechanism in mechanisms]
        if any(table.keys() != tables[0].keys() for table in tables):
            raise Unlike
        return {key: joined([table[key] for table in tables]) for key in tables[0]}

    arrays: dict[str, Any] = {
        "drive": joined_signal([mechanism.drive for mechanism in mechanisms]),
        "position": np.array([mechanism.position for mechanism in mechanisms]),
        "velocity": np.array([mechanism.velocity for mechanism in mechanisms]),
    }
    return first._replace(
        **arrays,
        inertia=joined([mechanism.inertia for mechanism in mechanisms]),
        applied_torque=joined([mechanism.applied_torque for mechanism in mechanisms]),
        contact=joined(bare)._replace(monotonicity_breaks=breaks),
        power_flows=joined_functions("power_flows"),
        stored_energies=joined_functions("stored_energies"),
    )


def _joined_breaks(breaks: list[tuple[float, ...]]) -> tuple[Any, ...]:
    """Return the k-th break of each run for each k; nan where a run has no more, which is none."""
    most = max(map(len, breaks))
    filled = np.full((most, len(breaks)), np.nan)
    for run, values in enumerate(breaks):
        filled[: len(values), run] = values
    return tuple(filled)


def changed_mechanism(mechanism: "Mechanism", change: Callable[[Any], Any]) -> "Mechanism":
    """Return a joined mechanism with another array in the place of each."""
    return mechanism._replace(
        inertia=changed(mechanism.inertia, change),
        applied_torque=changed(mechanism.applied_torque, change),
        contact=changed(mechanism.contact, change),
        power_flows={k: changed(f, change) for k, f in mechanism.power_flows.items()},
        stored_energies={k: changed(f, change) for k, f in mechanism.stored_energies.items()},
        position=change(mechanism.position),
        velocity=change(mechanism.velocity),
    )


def selected(mechanism: "Mechanism", runs: Any) -> "Mechanism":
    """Return the mechanism of some of the runs, by their indices."""
    found = changed_mechanism(mechanism, lambda values: values[runs])
    return found._replace(drive=mechanism.drive.select(runs))  # type: ignore[attr-defined]


def with_exact_powers(mechanism: "Mechanism") -> "Mechanism":
    """Return the mechanism with functions whose powers are those of floats."""

    def exact(function: Any) -> Any:
        if not _has_powers(function):
            return function
        inside = changed(function, lambda values: values.view(ExactPowers))
        return lambda *arguments: inside(*map(_exact, arguments))

    contact = mechanism.contact
    assert contact is not None  # of `joined_mechanism`
    return mechanism._replace(
        applied_torque=exact(mechanism.applied_torque),
        contact=contact._replace(
            **{k: exact(getattr(contact, k)) for k in ("static_limit", "kinetic_limit", "roundoff")}
        ),
        power_flows={k: exact(f) for k, f in mechanism.power_flows.items()},
        stored_energies={k: exact(f) for k, f in mechanism.stored_energies.items()},
    )


def _exact(value: Any) -> Any:
    return value.view(ExactPowers) if isinstance(value, np.ndarray) else value


def _has_powers(value: Any) -> bool:
    """Return whether a function may raise a number to a power, itself or in what it holds."""
    if not isinstance(value, FunctionType):
        return not isinstance(value, np.ndarray | float | int | str | None)
    return _code_has_powers(value.__code__) or any(
        _has_powers(cell.cell_contents) for cell in value.__closure__ or ()
    )


@cache
def _code_has_powers(code: Any) -> bool:
    from dis import get_instructions

    return any(step.argrepr == POWER or step.argval == "pow" for step in get_instructions(code))


@cache
def functions_agree() -> bool:
    """Return whether powers and sines of arrays have the bits of those of floats here.

    They do where both call the same library; numpy may have its own, and then a scenario runs
    alone.
    """
    values = np.random.default_rng(1).uniform(-12.0, 3.0, 4096)
    sizes = np.array([10.0**x for x in values])
    angles = sizes * np.sign(values)
    pairs = [
        (np.float_power(sizes, e), [size**e for size in sizes.tolist()])
        for e in (0.5, 2.0, -0.14, 0.08, 0.2, -0.2)
    ]
    pairs.append((np.sin(angles), [math.sin(x) for x in angles.tolist()]))
    pairs.append((np.cos(angles), [math.cos(x) for x in angles.tolist()]))
    return all(np.array_equal(ours, theirs) for ours, theirs in pairs)
