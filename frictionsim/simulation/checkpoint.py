"""The state of objects that step through a run, as plain arrays: to a file, and back from it.

A class names in CHECKPOINT_FIELDS the attributes that its continuation depends on: numbers, or
sequences of numbers whose type has what it takes to be filled again.
"""

from array import array
from collections import deque
from typing import Any

import numpy as np

from frictionsim.errors import InputError

Arrays = dict[str, Any]


def dump_part(owner: Any, name: str) -> Arrays:
    """Return the CHECKPOINT_FIELDS of an object as arrays of float64, under `name.attribute`."""
    return {
        f"{name}.{attribute}": np.array(getattr(owner, attribute), dtype=np.float64)
        for attribute in owner.CHECKPOINT_FIELDS
    }


def load_part(owner: Any, name: str, state: Arrays) -> None:
    """Give an object the attributes that `dump_part` has returned of one of its kind.

    Raises
    ------
    InputError
        If they do not fit.
    """
    for attribute in owner.CHECKPOINT_FIELDS:
        before = getattr(owner, attribute)
        values = require_array(state, f"{name}.{attribute}", np.float64, ndim=np.ndim(before))
        setattr(owner, attribute, _cast_like(before, values, f"{name}.{attribute}"))


def require_array(state: Arrays, name: str, dtype: Any, ndim: int) -> Any:
    """Return an array of a state.

    Raises
    ------
    InputError
        If it is not there, or is another array.
    """
    values = state.get(name)
    if values is None or not np.issubdtype(values.dtype, dtype) or values.ndim != ndim:
        raise mismatch(name)
    return values


def mismatch(name: str) -> InputError:
    """Return the error of a state that belongs to something else."""
    return InputError(f"its checkpoint is not of this scenario: '{name}' does not fit")


def _cast_like(before: Any, values: Any, name: str) -> Any:
    """Return values as what stood there before: a number of its type, or a sequence of it."""
    if isinstance(before, deque):
        return deque(values.tolist(), maxlen=before.maxlen)
    if isinstance(before, array):
        return array("d", values.tobytes())
    if isinstance(before, list):
        if len(before) != len(values):
            raise mismatch(name)
        return values.tolist()
    number = float(values)
    if isinstance(before, float):
        return number
    if not number.is_integer():
        raise mismatch(name)
    return type(before)(number)
