"""The tension of spans, and the audit that holds it to the torques."""

import tomllib
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.support.belt_scenarios import NO_MOTION_ACROSS, pair, shipped, swinging
from tests.support.falsified import falsified
from tests.support.scenarios import quantity, simulate
from tests.support.second_way import Recorded
from tests.support.second_way_belt import mean, span_tensions


def test_spans_beside_a_pulley_that_nobody_touches_are_one() -> None:
    """A roller hardly touches the back of a belt that swings, and is left alone for a while."""
    done = simulate(swinging())
    late = done.time >= 0.05 - 1e-9  # in the last period, of which the means are
    touched = np.any(done.channels["pulley_index"][late] == 1, axis=1)
    assert 0 < np.sum(touched) < len(touched)
    names = done.members["pulley"]
    quantities = [
        done.quantities[f"tension_{one}_to_{other}"].value
        for one, other in zip(names, names[1:] + names[:1], strict=True)
    ]
    # From the last body on a pulley to the first on the next, sample by sample.
    channels = {name: values[late] for name, values in done.channels.items()}
    scenario = tomllib.loads(done.attributes["scenario"])
    walked = span_tensions(Recorded(scenario, done.time[late], channels, []))
    # Sums in another order.
    assert quantities == pytest.approx(mean(done.time[late], walked), rel=1e-9)
    # Only where the roller is touched do the spans beside it differ.
    assert quantities[0] != quantities[1]


def test_the_balance_of_torques_catches_wrong_spans_and_friction() -> None:
    data = pair(
        **NO_MOTION_ACROSS,
        drive={
            "driver": {"speed": {"time": [0.0, 0.05], "value": [0.0, 10.0]}},
            "driven": {"torque": {"time": [0.0, 0.05], "value": [0.0, -8.0]}},
        },
        solver={"backend": "moreau", "duration": 0.2},
    )
    assert fs.solve(data).audit["torque_balance"].ok
    wrong: dict[str, Callable[[Any], Any]] = {
        "_span_tension": lambda tension: 0.95 * tension,
        "_friction": lambda friction: 0.9 * friction,
    }
    for name, change in wrong.items():
        falsified_run = falsified(data, 0.199, **{name: change})
        assert not falsified_run.audit["torque_balance"].ok, name


def test_the_spans_of_a_shipped_drive_are_what_its_torques_ask_for() -> None:
    done = simulate(shipped("belt_tensioner"))
    # 8 N m on a radius of 0.06 m; without wrap factors, as published, corners miss a part of it.
    force = quantity(done, "tension_tight") - quantity(done, "tension_slack")
    assert force == pytest.approx(8.0 / 0.06, rel=1e-3)
