"""The tension of spans, and the audit that holds it to the torques."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionsim.mechanisms.belt_drive.model import assemble
from frictionsim.mechanisms.belt_drive.quantities import torque_balance
from frictionsim.mechanisms.belt_drive.slip import span_tensions
from frictionsim.results import Record
from tests.support.belt_scenarios import Array, shipped
from tests.support.scenarios import scenario_run, simulate
from tests.support.second_way_belt import walked


@st.composite
def belts(draw: st.DrawFn) -> tuple[Array, Array, int]:
    """Belts that pass two pulleys or more, somewhere along their bodies, with bodies that lift."""
    pulleys = draw(st.integers(2, 6))
    index: list[int] = []
    for j in range(pulleys):
        arc = draw(st.lists(st.booleans(), min_size=1, max_size=6))
        arc[draw(st.integers(0, len(arc) - 1))] = True
        index += [j if on else -1 for on in arc] + [-1] * draw(st.integers(0, 8))
    turned = draw(st.integers(0, len(index)))
    random = np.random.default_rng(draw(st.integers(0, 99)))
    return random.uniform(-50.0, 900.0, len(index)), np.roll(index, turned), pulleys


@given(belt=belts())
def test_a_span_reaches_from_the_last_body_on_a_pulley_to_the_first_on_the_next(
    belt: tuple[Array, Array, int],
) -> None:
    # Sums in another order: a few roundings of 900 N.
    assert span_tensions(*belt) == pytest.approx(walked(*belt), abs=1e-9)


def test_spans_beside_a_pulley_that_nobody_touches_are_one() -> None:
    tension = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    tensions = span_tensions(tension, np.array([0, -1, -1, 2, -1, -1]), 3)
    assert tensions == pytest.approx([3.0, 3.0, 4.0])


def test_with_one_pulley_touched_the_rest_of_the_belt_is_every_span() -> None:
    tension = np.arange(8.0)
    tensions = span_tensions(tension, np.array([1, -1, 1, -1, -1, -1, -1, -1]), 2)
    assert tensions == pytest.approx([np.mean([3, 4, 5, 6, 7, 0])] * 2)
    assert span_tensions(tension, np.full(8, -1), 2) == pytest.approx([3.5, 3.5])


@pytest.fixture(scope="module")
def tensioner() -> Record:
    return simulate(shipped("belt_tensioner"))


def seen_of(done: Record, spans: Array) -> dict[str, Array]:
    """Return the audit's input for a run, from its channels, with these tensions of spans."""
    c = done.channels
    pulleys = c["pulley_speed"].shape[1]
    vx, vy = (np.gradient(c[name], done.time, axis=0) for name in ("x", "y"))
    along = vx * np.cos(c["angle"]) + vy * np.sin(c["angle"])
    return {
        "_torque": c["pulley_torque"],
        "_speed": c["pulley_speed"],
        "_friction": np.stack(
            [
                np.sum(c["friction_force"] * (c["pulley_index"] == j), axis=1)
                for j in range(pulleys)
            ],
            axis=1,
        ),
        "_span_tension": spans,
        "_belt_speed": along.mean(axis=1),
        "_touching": np.ones((len(done.time), pulleys)),
    }


def test_the_balance_of_torques_catches_wrong_spans_and_friction(tensioner: Record) -> None:
    scenario: Any = scenario_run(tensioner)
    model, c = assemble(scenario), tensioner.channels
    pulleys = len(scenario.mechanism.pulleys)
    right = np.array(
        [span_tensions(*row, pulleys) for row in zip(c["tension"], c["pulley_index"], strict=True)]
    )
    seen = seen_of(tensioner, right)
    little = seen | {"_friction": 0.9 * seen["_friction"]}
    for values, ok in ((seen, True), (seen_of(tensioner, 0.95 * right), False), (little, False)):
        assert torque_balance(scenario, model, tensioner.time, values).ok is ok


def test_the_spans_of_a_shipped_drive_are_what_its_torques_ask_for(tensioner: Record) -> None:
    value = {name: q.value for name, q in tensioner.quantities.items()}
    # 8 N m on a radius of 0.06 m; without wrap factors, as published, corners miss a part of it.
    tight, slack = value["tension_tight"], value["tension_slack"]
    assert tight is not None
    assert slack is not None
    assert tight - slack == pytest.approx(8.0 / 0.06, rel=1e-3)
    # As found; by `rkf45` 0.2 N less, and 0.1 N off from processor to processor. Arcs of the
    # published polygon hold more of the pretension: its spans, 365.8 and 232.3 N, less.
    assert (tight, slack) == pytest.approx((372.44, 239.08), abs=0.1)
