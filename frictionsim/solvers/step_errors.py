"""Errors of the integrators of mechanisms with one coordinate."""

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
