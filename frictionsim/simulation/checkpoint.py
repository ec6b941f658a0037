"""Conversion of solver objects to arrays for a checkpoint, and back.

A class lists in CHECKPOINT_FIELDS the attributes that define its state: numbers, lists, deques or
`array.array` of numbers.
"""

from array import array
from collections import deque
from typing import Any

import numpy as np

from frictionsim.errors import InputError

Arrays = dict[str, Any]


def dump_part(owner: Any, name: str) -> Arrays:
    """Return the CHECKPOINT_FIELDS of an object as arrays of float64, by `name.attribute`.

    Parameters
    ----------
    owner : object with CHECKPOINT_FIELDS
    name : str

    Returns
    -------
    dict of arrays
    """
    return {
        f"{name}.{attribute}": np.array(getattr(owner, attribute), dtype=np.float64)
        for attribute in owner.CHECKPOINT_FIELDS
    }


def load_part(owner: Any, name: str, state: Arrays) -> None:
    """Set the CHECKPOINT_FIELDS of an object from the arrays of `dump_part`.

    Parameters
    ----------
    owner : object with CHECKPOINT_FIELDS
    name : str
        As in `dump_part`.
    state : dict of arrays

    Raises
    ------
    InputError
        If an array is missing or does not fit.
    """
    for attribute in owner.CHECKPOINT_FIELDS:
        before = getattr(owner, attribute)
        values = require_array(state, f"{name}.{attribute}", np.float64, ndim=np.ndim(before))
        setattr(owner, attribute, _cast_like(before, values, f"{name}.{attribute}"))


def require_array(state: Arrays, name: str, dtype: Any, ndim: int) -> Any:
    """Return an array of a state.

    Parameters
    ----------
    state : dict of arrays
    name : str
    dtype : numpy dtype
    ndim : int

    Returns
    -------
    array

    Raises
    ------
    InputError
        If it is missing, or of another type or number of dimensions.
    """
    values = state.get(name)
    if values is None or not np.issubdtype(values.dtype, dtype) or values.ndim != ndim:
        raise mismatch(name)
    return values


def mismatch(name: str) -> InputError:
    """Return the error for an array that does not fit the scenario."""
    return InputError(f"its checkpoint does not belong to this scenario: '{name}' does not fit")


def _cast_like(before: Any, values: Any, name: str) -> Any:
    """Return values in the type of the previous attribute."""
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
