"""The state of an integration of a belt by adaptive RKF4(5), and what a checkpoint holds of it."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frictionsim.solvers.state_values import (
    COUNT,
    NUMBER,
    POSITIVE,
    TIME,
    Expected,
    Rows,
    Values,
)
from frictionsim.solvers.step_size import MIN_ERROR_NORM

if TYPE_CHECKING:
    import numpy.typing as npt

    Array = npt.NDArray[np.float64]
    Indices = npt.NDArray[np.int64]

CANDIDATE_UPDATE_INTERVAL = 8  # steps from one search for contact candidates to the next

# The numbers in `clock`: start and end of the last step, the length of the next one, s, and the
# error of the last one, in tolerances.
T_OLD, T, H, ERROR = range(4)
# The numbers in `counts`: the last one is the steps since the search for candidates.
STEPS, REJECTED, NFEV, SINCE_SEARCH = range(4)


class RKF45State(NamedTuple):
    """An integration between two steps, in arrays that its kernels write to.

    Attributes
    ----------
    y_old, y : (size,)
        The states at the start and the end of the last step.
    k : six of (size,)
        The rates of its stages; k[0] are those at its start.
    f : (size,)
        The rates at its end.
    kinematics : (6, width)
        Those that y begins with: a view.
    stage, error, inside : (size,)
        Workspace.
    inv_error_scale : (size,)
        1 over the error that a step may make in each state, 0 for an energy.
    clock : (4,)
        T_OLD, T, H, ERROR.
    counts : (4,)
        STEPS, REJECTED, NFEV, SINCE_SEARCH.
    """

    y_old: "Array"
    y: "Array"
    k: tuple["Array", ...]
    f: "Array"
    kinematics: "Array"
    stage: "Array"
    error: "Array"
    inside: "Array"
    inv_error_scale: "Array"
    clock: "Array"
    counts: "Indices"


# What the arrays of `BeltStepper.checkpoint_arrays` may hold, besides those of the contacts.
STATE_VALUES: dict[str, Expected] = {
    "y": NUMBER,
    # Beyond the range of double precision in a state that a step may end at; the next step fails
    # by name then.
    "f": Values(finite=False),
    "clock": Rows({T_OLD: TIME, T: TIME, H: POSITIVE, ERROR: Values(low=MIN_ERROR_NORM)}),
    "counts": Rows(
        {
            **dict.fromkeys((STEPS, REJECTED, NFEV), COUNT),
            SINCE_SEARCH: COUNT._replace(high=CANDIDATE_UPDATE_INTERVAL),
        }
    ),
}
