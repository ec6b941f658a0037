"""SciPy's integrators: what ends a run with them."""

import pytest

from frictionsim.errors import NonFinite
from frictionsim.mechanisms.extension import INPUT, OneCoordinate, Term
from tests.support.wheels import signal, solved


@pytest.mark.parametrize("method", ["rk45", "radau", "bdf"])
def test_a_run_in_which_one_number_of_the_state_overflows_ends_by_name(method: str) -> None:
    """A wheel turns at 1e154 rad/s under 1e154 N m: its energy overflows after 1.8 s."""
    system = OneCoordinate(
        signal(1e154), None, 1e300, (Term(lambda u, q, v: u, INPUT),), None, start=(0.0, 1e154)
    )
    with pytest.raises(NonFinite, match="the state of the motion is not finite after t = "):
        solved(system, 1e3, backend=method)
