"""The backends of belts against the reference program, against each other, and their orders."""

from typing import Any

import numpy as np
import pytest

from tests.support.belt_reference import integrate, pack
from tests.support.belt_scenarios import (
    NO_FRICTION,
    SHORT,
    SMOOTH,
    STARTS,
    distance,
    halved,
    kick,
    kinematics,
    orders,
    pair,
    reference,
    scenario_of,
    shipped,
    stepped,
)
from tests.support.cases import one_in, slow
from tests.support.scenarios import Scenario, changed, sound


@pytest.mark.slow
def test_a_short_way_is_that_of_the_reference() -> None:
    """Twelve bodies that are kicked: contacts open and close, bodies stick, slide and turn back."""
    data = pair(
        mechanism__belt__bodies=12,
        drive__driver__torque=-5.0,
        solver__duration=1e-3,
        solver__rtol=1e-10,
    )
    end = stepped(data, kick(0.05))
    start = stepped({**data, "solver": {"duration": 1e-12}}, kick(0.05))
    tau = 1.0 / end.model.belt.inv_tau
    belt = reference(scenario_of(data), end.model.belt.length, tau)
    times = np.array([0.0, 1e-3])
    y0 = pack(*kinematics(start.state, start.model))
    expected = integrate(belt, y0, times, rtol=1e-9, atol=1e-11, mu=np.full(12, 0.6))[-1]
    values = pack(*kinematics(end.state, end.model))
    moved = np.abs(expected - y0)
    for part, size in zip(np.split(values - expected, PARTS), np.split(moved, PARTS), strict=True):
        # Of the way from the start. Both step over the switches of friction as their error
        # estimates allow: each costs the tolerance of 1e-9.
        assert np.max(np.abs(part)) <= 1e-7 * np.max(size)


PARTS = np.cumsum([12] * 6 + [2])


# The polygon, as published, has kernels of its own.
@pytest.mark.parametrize("wrap", ["corrected", slow("polygon")])
def test_backends_agree_on_the_shipped_drive_under_its_load(wrap: str) -> None:
    drive = {"mechanism__belt__wrap": wrap, "solver__duration": 0.3, "solver__rtol": 1e-4}
    moreau, rkf45 = (
        sound(shipped("belt_drive", **drive, solver__backend=backend, output__interval=2.5e-3))
        for backend in ("moreau", "rkf45")
    )
    for name in ("tension_tight", "tension_slack", "drive_speed", "driven_speed"):
        value, expected = (done.quantities[name].value for done in (moreau, rkf45))
        assert value == pytest.approx(expected, rel=1e-4), name


@pytest.mark.parametrize("name", SMOOTH)
def test_moreau_is_of_second_order_where_all_is_smooth(name: str) -> None:
    data = {**SMOOTH[name], "solver": {"backend": "moreau", "duration": SHORT}}
    slopes = orders(data, halved(3.2e-5, 6), "step", STARTS[name])
    assert slopes == pytest.approx([2.0] * 4, abs=0.02)


def test_moreau_is_of_first_order_at_least_through_switches() -> None:
    """Bodies that slide come to stick, and contacts open: the start is hard."""
    solver = {"backend": "moreau", "duration": SHORT}
    slopes = orders({**pair(), "solver": solver}, halved(3.2e-5, 7), "step", kick(0.2))
    # From step to step the switches fall differently; over sixteenfold shorter steps it shows.
    assert np.mean(slopes) >= 0.9


@pytest.mark.parametrize("name", SMOOTH)
def test_rkf45_is_of_fourth_order_where_all_is_smooth(name: str) -> None:
    # A tolerance that never bites: the steps are max_step, which divides the duration.
    solver = {"rtol": 0.99, "duration": SHORT}
    slopes = orders({**SMOOTH[name], "solver": solver}, halved(3.2e-5, 4), "max_step", STARTS[name])
    # The solution of order 4 that is propagated; those of order 5 would be 4.7 and more.
    assert slopes == pytest.approx([4.0, 4.0], abs=0.4)


@pytest.mark.parametrize("bodies", one_in(2, [60, 24]))
def test_a_tighter_tolerance_is_a_smaller_error(bodies: int) -> None:
    """Through switches, of a hard start; below 1e-6 each digit is about one of the end."""
    mesh = {"mechanism__belt__bodies": bodies, "solver__duration": SHORT}
    ends = [stepped(pair(solver__rtol=10.0**-k, **mesh), kick(0.2)) for k in (4, 6, 8, 10)]
    errors = [distance(end, ends[-1]) for end in ends[:-1]]
    # Measured 2.6 to 60, for at 1e-4 the longest stable step decides, and 24 to 50.
    assert errors[0] > 2 * errors[1] > 20 * errors[2]
    assert errors[2] <= 2e-6


UNLIKE = {"driven": {"c1": 3e7, "c2": 8e5, "damping": 100.0, "p_max": 2e-4}}


def test_both_methods_agree_on_unlike_contacts() -> None:
    """Fixed steps solve for the dampers of the contacts, adaptive ones evaluate them."""
    data = pair(
        effects__contact__pulleys=UNLIKE,
        effects__belt_friction=NO_FRICTION,
        solver__duration=2e-3,
    )

    def end(backend: str, of: Scenario, **settings: Any) -> Any:
        own = {**of["solver"], "backend": backend, **settings}
        return stepped(changed(of, solver=own), kick(2e-2))

    exact = end("rkf45", data, rtol=1e-9)
    assert distance(end("moreau", data, step=1e-6), exact) < 1e-5
    # What would be missed if a number of either pulley stood for both.
    for key, value in UNLIKE["driven"].items():
        own = {"driven": {**UNLIKE["driven"], key: data["effects"]["contact"][key]}}
        assert value != own["driven"][key]
        other = end("moreau", changed(data, effects__contact__pulleys=own), step=1e-6)
        assert distance(other, exact) > 5e-3, key
