"""Checks of the arrays of a checkpoint, of which a file has a digest: names, shapes, finiteness."""

from typing import Any

import numpy as np

from frictionsim.errors import InputError

Arrays = dict[str, Any]

# A rate may be beyond the range of double precision in a state that a step ends at, and the next
# step fails by name then; no contact is released at `held`.
INFINITE = ("stepping.f", "state.held", "step.k", "step.k_old")


def unfit(name: str, what: str = "is of another type or shape") -> InputError:
    """Return the error for an array that does not fit the scenario; `what` follows its name."""
    return InputError(
        f"its checkpoint does not belong to this scenario or was changed: '{name}' {what}"
    )


def require_array(state: Arrays, name: str, dtype: Any, ndim: int) -> Any:
    """Return an array of a state."""
    values = state.get(name)
    if values is None:
        raise unfit(name, "is missing")
    if not np.issubdtype(values.dtype, dtype) or values.ndim != ndim:
        raise unfit(name)
    if values.dtype.kind == "f" and name not in INFINITE and not np.isfinite(values).all():
        raise unfit(name, "is not finite")
    return values


def require_same_arrays(state: Arrays, restored: Arrays) -> None:
    """Check that a state has exactly the arrays of the object restored from it."""
    for name in sorted(state.keys() ^ restored.keys()):
        raise unfit(name, "is missing" if name in restored else "is unknown")
    for name, values in restored.items():
        if (values.dtype, values.shape) != (state[name].dtype, state[name].shape):
            raise unfit(name)
