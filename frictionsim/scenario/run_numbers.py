"""Numbers of many runs in the place of one: a scenario is checked, and a mechanism built, for all.

Arithmetic on `RunNumbers` is that of arrays. A condition holds for all runs or for none; if it
holds for some, the runs take different ways, and `Unlike` says which. What takes one number, as
text and the functions of `math`, takes no numbers of many runs.
"""

import operator
from collections.abc import Callable, Iterator, Sequence, Set
from typing import Annotated, Any, NoReturn, TypeVar, get_args, get_origin

import numpy as np
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from frictionsim.scenario.toml_data import KeyPath

TableModel = TypeVar("TableModel", bound=BaseModel)
Returned = TypeVar("Returned")

BOUNDS: dict[str, Callable[[Any, Any], Any]] = {
    "gt": operator.gt,
    "ge": operator.ge,
    "lt": operator.lt,
    "le": operator.le,
}
# Those of numpy that have the bits of Python's.
EXACT = {
    *(np.add, np.subtract, np.multiply, np.divide, np.negative, np.absolute, np.sqrt, np.radians),
    *(np.equal, np.not_equal, np.less, np.less_equal, np.greater, np.greater_equal),
    *(np.logical_and, np.logical_or, np.logical_not),
}
# Of lists, of the types of other values, of the forms of a signal, and of units.
NOT_OF_NUMBERS = {"MinLen", "Strict", "Tag", "Discriminator", "UnitOfKey"}


class Unlike(Exception):
    """Runs cannot be done at once.

    Attributes
    ----------
    holds : (runs,) of bool, or None
        Where a condition holds that some fulfil; None if each run has to be done alone.
    """

    def __init__(self, holds: Any = None) -> None:
        super().__init__()
        self.holds = holds


class RunNumbers(np.ndarray[Any, np.dtype[Any]]):
    """A number, or whether something holds, of each of many runs."""

    def __bool__(self) -> bool:
        holds = np.asarray(self) != 0.0
        if holds.all() or not holds.any():
            return bool(holds.all())
        raise Unlike(holds)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **_: Any) -> Any:
        if ufunc not in EXACT or method != "__call__":
            raise Unlike
        return ufunc(*map(np.asarray, inputs)).view(RunNumbers)

    def __pow__(self, exponent: float) -> "RunNumbers":  # type: ignore[override]
        return as_run_numbers([number**exponent for number in np.asarray(self).tolist()])

    def __floor__(self) -> "RunNumbers":
        return as_run_numbers(np.floor(np.asarray(self)))

    def __ceil__(self) -> "RunNumbers":
        return as_run_numbers(np.ceil(np.asarray(self)))

    def _is_not_one(self, *_: object) -> NoReturn:
        raise Unlike

    __float__ = __int__ = __index__ = __hash__ = _is_not_one  # type: ignore[assignment]
    __iter__ = __len__ = __str__ = __repr__ = __format__ = _is_not_one


def as_run_numbers(values: Any) -> RunNumbers:
    """Return an array, (runs,), as numbers of many runs."""
    return np.asarray(values, dtype=float).view(RunNumbers)


def stacked(values: Sequence[Any]) -> Any:
    """Return numbers of which some are of many runs as an array, (runs, n)."""
    return np.stack(np.broadcast_arrays(*map(np.asarray, values)), axis=1)


def group_runs(
    function: Callable[[Any], Returned], runs: Any, fewest: int
) -> Iterator[tuple[Any, Returned]]:
    """Yield groups of runs that a function accepts at once, by indices, with its output.

    Runs that differ are divided until they do not; those of groups of less than `fewest`, and
    those that have to be done alone, are left out.
    """
    if len(runs) < fewest:
        return
    try:
        # A division by zero, and an overflow of a power, stop a run alone.
        with np.errstate(divide="raise", over="raise", invalid="raise", under="ignore"):
            values = function(runs)
    except Unlike as unlike:
        if unlike.holds is not None:
            for part in (unlike.holds, ~unlike.holds):
                yield from group_runs(function, runs[part], fewest)
    except (ArithmeticError, AttributeError, TypeError, ValueError):
        pass  # it is for numbers of one run only
    else:
        yield runs, values


def with_numbers(table: TableModel, numbers: "dict[KeyPath, RunNumbers]") -> TableModel:
    """Return a valid table with finite numbers of many runs at some keys, checked by its model.

    Raises
    ------
    Unlike
        If the model may refuse some of the runs, which it has to say itself.
    """
    inner: dict[str | int, dict[KeyPath, RunNumbers]] = {}
    for (key, *rest), values in numbers.items():
        inner.setdefault(key, {})[tuple(rest)] = values
    changed: dict[str, Any] = {}
    for key, below in inner.items():
        name, field = _field(table, key)
        changed[name] = _replaced(field, getattr(table, name), below)
    copy = table.model_copy(update=changed)
    _check(copy, changed.keys())
    return copy


def _field(table: BaseModel, key: str | int) -> tuple[str, FieldInfo]:
    for name, field in type(table).model_fields.items():
        if key == (field.alias or name):
            return name, field
    raise Unlike  # a validator has put something else in the place of what is given


def _replaced(field: FieldInfo, value: Any, numbers: "dict[KeyPath, RunNumbers]") -> Any:
    """Return the value of a field with numbers at some keys below it."""
    if isinstance(value, BaseModel):
        return with_numbers(value, numbers)
    if isinstance(value, tuple):
        items = list(value)
        for (index, *rest), one in numbers.items():
            i = int(index)
            items[i] = _replaced(field, items[i], {tuple(rest): one})
        return tuple(items)
    if type(value) is not float or [*numbers] != [()]:
        raise Unlike
    for constraint in (*field.metadata, *_constraints(field.annotation)):
        bounds = [name for name in BOUNDS if getattr(constraint, name, None) is not None]
        if not bounds and type(constraint).__name__ not in NOT_OF_NUMBERS:
            raise Unlike
        if not all(BOUNDS[name](numbers[()], getattr(constraint, name)) for name in bounds):
            raise Unlike
    return numbers[()]


def _constraints(annotation: Any) -> Iterator[Any]:
    """Yield the constraints within an annotation, without those of tables."""
    base, *constraints = get_args(annotation) or (annotation,)
    if get_origin(annotation) is not Annotated:
        for argument in get_args(annotation):
            yield from _constraints(argument)
    elif not (isinstance(base, type) and issubclass(base, BaseModel)):
        yield from constraints
        yield from _constraints(base)


def _check(table: BaseModel, changed: Set[str]) -> None:
    """Let the validators of a model check a table; raise Unlike if they refuse it."""
    validators = type(table).__pydantic_decorators__
    for of_fields in validators.field_validators.values():
        if {"*", *changed} & {*of_fields.info.fields}:
            raise Unlike
    for validator in validators.model_validators.values():
        if validator.info.mode != "after":
            raise Unlike
        try:
            validator.func(table)
        except PydanticCustomError:
            raise Unlike from None
