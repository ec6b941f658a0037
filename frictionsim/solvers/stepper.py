"""The choice of steps of adaptive integrators, and their errors."""

from frictionsim.errors import NonFinite, StepUnderflow


def non_finite_error(t: float, what: str) -> NonFinite:
    """Return the error for a non-finite state after t, s; `what` is the subject."""
    return NonFinite(
        f"the state of {what} is not finite after t = {t:.9g} s; check the scenario for forces or"
        " coefficients that are too large"
    )


def step_underflow(t: float, h: float, what: str) -> StepUnderflow:
    """Return the error for a required step h, s, at t, s, below the resolution of the time."""
    return StepUnderflow(
        f"at t = {t:.9g} s the tolerances require a step of {h:.2g} s for {what}, below the"
        " resolution of double precision; give a larger solver.rtol or atol"
    )


SAFETY = 0.9  # Hairer, Norsett, Wanner 1993, II.4
MIN_FACTOR, MAX_FACTOR = 0.2, 5.0  # ibid.
STEP_END_TOLERANCE = 1.0 - 1e-9  # merge a remainder shorter than 1e-9 h into the step
# PI controller for an error estimate of order h^5: Gustafsson 1991, k_I = 0.3/5, k_P = 0.4/5.
PI_ALPHA, PI_BETA = 0.7 / 5, 0.4 / 5
MIN_ERROR_NORM = 1e-10  # replaces smaller errors in the controller


def reduced_step(h: float, error: float) -> float:
    """Return the length of the next trial after a step of length h with an error above 1."""
    return h * max(MIN_FACTOR, SAFETY * error**-0.2)


def clipped_step(h: float, left: float) -> float:
    """Return the length of the next step, at most `left`, s."""
    if h >= left * STEP_END_TOLERANCE:
        return left
    if h > 0.5 * left:
        return 0.5 * left  # two equal steps instead of a long one and a short one
    return h


def next_step_size(
    h: float, planned: float, error: float, error_old: float, rejected_here: bool, max_step: float
) -> float:
    """Return the length of the step after one of length h, s, from its error and the one before.

    Parameters
    ----------
    h, planned : float, s
        The length of the step, and what was planned for it.
    error, error_old : float
        Of the step and of the one before, relative to what is allowed.
    rejected_here : bool
        A longer step was tried first, and rejected.
    max_step : float, s
    """
    growth = SAFETY * error**-PI_ALPHA * error_old**PI_BETA
    length = h * min(max(growth, MIN_FACTOR), 1.0 if rejected_here else MAX_FACTOR)
    # The error of a shortened step is not representative: keep the planned length.
    kept = planned if not rejected_here and h < planned else 0.0
    return min(max(length, kept), max_step)
