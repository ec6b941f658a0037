"""Conversion of solver objects to arrays for a checkpoint, and back.

A class lists in CHECKPOINT_FIELDS the attributes that define its state: numbers, lists, deques or
`array.array` of numbers. Its method `restored`, if it has one, is called when they are set. A file
has a digest of its checkpoint; here names, shapes and finiteness are checked.
"""

from array import array
from collections import deque
from collections.abc import Iterable
from typing import Any

import numpy as np

from frictionsim.errors import InputError

Arrays = dict[str, Any]

# A rate may be beyond the range of double precision in a state that a step ends at, and the next
# step fails by name then; no contact is released at `held`.
INFINITE = ("stepping.f", "state.held", "step.k", "step.k_old")


def unfit(name: str, what: str) -> InputError:
    """Return the error for an array that does not fit the scenario; `what` follows its name."""
    return InputError(
        f"its checkpoint does not belong to this scenario or was changed: '{name}' {what}"
    )


def dump_part(owner: Any, name: str) -> Arrays:
    """Return the CHECKPOINT_FIELDS of an object as arrays of float64, by `name.attribute`."""
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
    """
    for attribute in owner.CHECKPOINT_FIELDS:
        before, full = getattr(owner, attribute), f"{name}.{attribute}"
        values = require_array(state, full, np.float64, ndim=np.ndim(before))
        setattr(owner, attribute, _cast_like(before, values, full))
    if hasattr(owner, "restored"):
        owner.restored()


def require_array(state: Arrays, name: str, dtype: Any, ndim: int) -> Any:
    """Return an array of a state."""
    values = state.get(name)
    if values is None:
        raise unfit(name, "is missing")
    if not np.issubdtype(values.dtype, dtype) or values.ndim != ndim:
        raise unfit(name, "is of another type or shape")
    if values.dtype.kind == "f" and name not in INFINITE and not np.isfinite(values).all():
        raise unfit(name, "is not finite")
    return values


def require_same_arrays(state: Arrays, restored: Arrays) -> None:
    """Check that a state has exactly the arrays of the object restored from it."""
    for name in sorted(state.keys() ^ restored.keys()):
        raise unfit(name, "is missing" if name in restored else "is unknown")
    for name, values in restored.items():
        if (values.dtype, values.shape) != (state[name].dtype, state[name].shape):
            raise unfit(name, "is of another type or shape")


def require_names(names: Iterable[str], known: Iterable[str], prefix: str) -> None:
    """Check that the arrays of a state are those that are known, `prefix` before their names."""
    expected = set(known)
    for name in sorted(expected ^ set(names)):
        what = "is missing" if name in expected else "is unknown"
        raise unfit(f"{prefix}{name}", what)


def _cast_like(before: Any, values: Any, name: str) -> Any:
    """Return values in the type of the previous attribute."""
    if isinstance(before, deque):
        return deque(values.tolist(), maxlen=before.maxlen)
    if isinstance(before, array):
        return array("d", values.tobytes())
    if isinstance(before, list):
        if len(before) != len(values):
            raise unfit(name, "is of another type or shape")
        return values.tolist()
    return type(before)(values)
