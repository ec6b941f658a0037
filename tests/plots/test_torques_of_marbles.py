"""The torques of a marble machine over its angle: no panel that says nothing."""

from typing import Any

import numpy as np
import pytest

from frictionsim.results import Record
from tests.support.records import draw, shown, with_channels, without


def marbles() -> Record:
    return shown("marble_machine", solver__duration=0.6, solver__rtol=1e-4)


def panels(record: Record) -> list[Any]:
    return draw(record, "torque").axes


def test_torques_have_a_second_panel_where_its_scale_is_finer() -> None:
    upper, lower = panels(marbles())
    assert np.ptp(lower.get_ylim()) < 0.5 * np.ptp(upper.get_ylim())
    assert lower.get_ylabel() == "at the scale of\nthe load, N m"


@pytest.mark.parametrize("motor", ["twice the load", "constant", "none"])
def test_torques_of_about_the_same_range_have_one_panel(motor: str) -> None:
    load = marbles().channels["load_torque"]
    torque = {"twice the load": 0.5 * load, "constant": 0.005 + 0.0 * load, "none": 0.0 * load}
    (ax,) = panels(with_channels(marbles(), motor_torque=torque[motor]))
    assert len([line for line in ax.lines if np.size(line.get_xdata()) == load.size]) == 4


def test_torques_without_those_of_load_and_friction_have_one_panel() -> None:
    (ax,) = panels(without(marbles(), "load_torque", "friction_torque"))
    assert ax.lines[0].get_label() == "motor, times the gear ratio"
    still = np.full_like(marbles().channels["load_torque"], 0.012)
    assert len(panels(without(with_channels(marbles(), load_torque=still), "friction_torque"))) == 1


def test_a_gear_at_rest_has_points() -> None:
    still = np.zeros_like(marbles().channels["angle"])
    for ax in panels(with_channels(marbles(), angle=still)):
        drawn = [line for line in ax.lines if np.size(line.get_xdata()) == still.size]
        assert [line.get_marker() for line in drawn] == ["o"] * 4
    assert panels(marbles())[0].lines[0].get_marker() == "None"
