"""Views of pulley and marble machine: labels inside their panel, and no panel that says nothing."""

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure

from frictionsim.plots import draw
from frictionsim.results import Record
from tests.support.cases import one_in
from tests.support.records import shown, with_channels, without


def pulley_record() -> Record:
    return shown("pulley", solver__duration=1.0, solver__rtol=1e-4)


def marbles() -> Record:
    return shown("marble_machine", solver__duration=0.6, solver__rtol=1e-4)


def force_labels(figure: Figure) -> tuple[Any, list[Any]]:
    """Return the extents, in points of the screen, of the panel of the force and of its labels."""
    figure.draw_without_rendering()
    ax = next(ax for ax in figure.axes if ax.get_ylabel().startswith("drive force"))
    texts = [text for text in ax.texts if text.get_text().endswith(("to hold", "to lift"))]
    return ax.get_window_extent(), [text.get_window_extent() for text in texts]


FORCES = {
    "both at the lower edge": (0.0, 60_000.0),
    "hold at the lower edge": (1830.0, 3100.0),
    "lift at the upper edge": (1000.0, 2700.0),
    "both at the upper edge": (-60_000.0, 2000.0),
    "both inside": (0.0, 5000.0),
    "force below both": (1000.0, 1001.0),
    "force above both": (3000.0, 3001.0),
}


@pytest.mark.parametrize(
    ("ends", "part"),
    one_in(3, [*((ends, False) for ends in FORCES), ("both at the lower edge", True)]),
)
def test_labels_of_forces_stay_beside_their_panel(ends: str, part: bool) -> None:
    count = pulley_record().channels["time"].size
    record = with_channels(pulley_record(), drive_force=np.linspace(*FORCES[ends], count))
    if part:
        figure, axes = plt.subplots(2, 2, figsize=(10.0, 10.0), layout="constrained")
        draw(record, ax=axes[1, 1])
        plt.close(figure)
    else:
        figure = draw(record)
    panel, labels = force_labels(figure)
    assert len(labels) == 2
    for label in labels:
        assert label.y0 >= panel.y0 - 0.5
        assert label.y1 <= panel.y1 + 0.5
        assert label.x0 >= panel.x1
    low, high = sorted(labels, key=lambda label: float(label.y0))
    assert high.y0 >= low.y1 - 0.5


def panels(record: Record) -> list[Any]:
    return draw(record, "torque").figure.axes  # type: ignore[no-any-return]


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
        assert [line.get_marker() for line in drawn] == ["o", "s", "^", "D"]
    assert panels(marbles())[0].lines[0].get_marker() == "None"
