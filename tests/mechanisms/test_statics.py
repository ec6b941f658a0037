"""Forces of impending motion of the pulley, eq 24, against closed forms and the paper."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import frictionsim as fs
from tests.support.problems import CORD_RADIUS, LOAD, MU_S
from tests.support.scenarios import pulley
from tests.support.second_way import friction_radius

# The closed form evaluated with 30 digits; double precision gives it to a few roundings.
EXACT = {
    "friction_radius_static": 4.981349832509874e-3,
    "friction_radius_kinetic": 2.527394463133372e-3,
    "force_to_lift": 2707.703079618707,
    "force_to_hold": 1826.869735915273,
    "force_to_lift_vertical": 2707.703079618707,
    "force_to_hold_vertical": 1826.869735915273,
    "force_to_lift_horizontal": 2556.365307504849,
    "force_to_hold_horizontal": 1935.021100262141,
    "force_to_keep_lifting": 2456.993085547742,
    "force_to_keep_lowering": 2013.2823486954345,
}
PRINTED = {
    "friction_radius_static": 4.981e-3,
    "friction_radius_kinetic": 2.527e-3,
    "force_to_lift": 2707.6,
    "force_to_hold": 1826.8,
    "force_to_lift_horizontal": 2556.34,
    "force_to_hold_horizontal": 1935.02,
}


def test_statics_are_exact_and_agree_with_the_paper() -> None:
    values = {name: quantity.value for name, quantity in fs.static(pulley()).items()}
    assert values == pytest.approx(EXACT, rel=1e-14)  # a few roundings
    for name, printed in PRINTED.items():
        # The paper rounds r_s to 4.981 mm before it uses it and cuts digits instead of rounding;
        # the radii are printed with four digits.
        rel = 1.6e-4 if name.startswith("friction") else 5e-5
        assert values[name] == pytest.approx(printed, rel=rel), name


def test_the_textbook_s_friction_radius() -> None:
    """r mu in the place of r mu/sqrt(1 + mu^2): what the page about the pulley has of it."""
    textbook = {"shaft_radius": 0.0254, "mu_s": 0.2041241452, "mu_k": 0.1}
    values = {n: q.value for n, q in fs.static(pulley(effects__shaft_friction=textbook)).items()}
    assert values["friction_radius_static"] == pytest.approx(0.0254 * 0.2, rel=1e-9)
    names = ("force_to_lift", "force_to_hold", "force_to_lift_horizontal")
    assert [values[name] for name in names] == pytest.approx([2718.3, 1819.7, 2563.5], abs=0.05)


arms = st.floats(1e-3, 10.0)
mus = st.floats(1e-6, 10.0)
loads = st.floats(1e-3, 1e6)
directions = st.booleans()


def limits(arm: float, mu: float, load: float, vertical: bool, shaft: float = 0.5) -> Any:
    """Return the friction radius and the forces to lift and to hold of a pulley.

    Its shaft has a share of the arm as its radius.
    """
    direction = "vertical" if vertical else "horizontal"
    quantities = fs.static(
        pulley(
            mechanism__cord_radius=arm,
            mechanism__load=load,
            drive__direction=direction,
            effects__shaft_friction={"shaft_radius": shaft * arm, "mu_s": mu, "mu_k": mu},
        )
    )
    names = ("friction_radius_static", "force_to_lift", "force_to_hold")
    return tuple(quantities[name].value for name in names)


@given(arms, mus, loads, directions)
def test_forces_are_roots_of_eq_24(arm: float, mu: float, load: float, vertical: bool) -> None:
    radius, *forces = limits(arm, mu, load, vertical)
    assert radius == pytest.approx(friction_radius(0.5 * arm, mu), rel=1e-14)
    for force in forces:
        assert force is not None
        reaction = force + load if vertical else (force**2 + load**2) ** 0.5
        # M and r_s R are differences and roots of products near arm * (force + load).
        assert abs(force - load) * arm == pytest.approx(
            radius * reaction, abs=1e-14 * arm * (force + load)
        )


@pytest.mark.parametrize("vertical", [True, False])
def test_a_shaft_that_locks_itself_has_no_force_to_lift(vertical: bool) -> None:
    radius, *forces = limits(CORD_RADIUS, MU_S, LOAD, vertical, shaft=10.0)
    assert radius > CORD_RADIUS
    assert forces == [None, 0.0]
