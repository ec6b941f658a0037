"""The slip in the view `speeds`: that of the summary, for unlike pulleys, reversed or at rest."""

from typing import Any

import numpy as np
import pytest

from frictionsim.results import Record
from tests.support.belt_results import FOUR, TWO, Pulley, belt_run
from tests.support.records import draw, string, with_channels, with_scenario

UNLIKE = (Pulley("big", 0.0, 0.0, 0.05), Pulley("small", 0.4, 0.1, 0.02))


def slip_panel(record: Record) -> Any:
    panels = [ax for ax in draw(record, "speeds").axes if ax.get_ylabel().startswith("slip of")]
    assert len(panels) == 1
    return panels[0]


def solved() -> Record:
    """Return a run with unlike pulleys that turn clockwise."""
    return string(0.6, driven_radius=0.02)


def test_the_mean_is_that_of_the_summary() -> None:
    record = solved()
    slip, _, mean = slip_panel(record).lines
    assert mean.get_ydata() == pytest.approx([record.quantities["slip_percent"].value] * 2, 1e-12)
    time = record.channels["time"]
    assert mean.get_xdata() == pytest.approx([0.8 * time[-1], time[-1]])
    said = (
        f"weighted mean slip over the last fifth, {record.quantities['slip_percent'].value:.4g} %"
    )
    assert mean.get_label() == said
    np.testing.assert_array_equal(slip.get_xdata(), time)


def test_the_slip_is_that_of_the_angles() -> None:
    """By another way: how much less of the rims has passed, from the channel of the angles."""
    record = solved()
    time, angle = record.channels["time"], record.channels["pulley_angle"]
    passed = np.diff(np.abs(angle * [0.027, 0.02]), axis=0)
    expected = 100.0 * (passed[:, 0] - passed[:, 1]) / passed[:, 0]
    slip, _, mean = slip_panel(record).lines
    values = np.asarray(slip.get_ydata())
    late = time[1:] > 0.35
    between = 0.5 * (values[1:] + values[:-1])
    off = np.abs(between[late] - expected[late])
    assert (off.max() < 0.1, off.mean() < 0.02) == (True, True)
    assert np.ptp(expected[late]) > 0.4
    last = passed[time[1:] > 0.48 + 1e-9].sum(axis=0)
    of_angles = 100.0 * (1.0 - last[1] / last[0])
    assert mean.get_ydata()[0] == pytest.approx(of_angles, abs=0.01)
    assert of_angles > 0.1


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize(("pulleys", "slip"), [(TWO, 1.0), (UNLIKE, 1.0), (FOUR, 3.0)])
def test_the_slip_of_drives_made_by_hand(
    pulleys: tuple[Pulley, ...], slip: float, direction: float
) -> None:
    """Each pulley of these is 1 % slower than the one before; of FOUR, one is on the back."""
    record = belt_run(pulleys, samples=101)
    turned = {n: direction * record.channels[n] for n in ("pulley_speed", "pulley_torque")}
    ax = slip_panel(with_channels(record, **turned))
    drawn, smooth, *_ = (np.asarray(line.get_ydata()) for line in ax.lines)
    assert np.isnan(drawn[0])  # all are at rest
    np.testing.assert_allclose(drawn[np.isfinite(drawn)], slip, atol=1e-9)
    np.testing.assert_allclose(smooth, slip, atol=1e-9)
    assert ax.get_ylabel() in (f"slip of {pulleys[-1].name}, %", f"slip of\n{pulleys[-1].name}, %")


@pytest.mark.parametrize(("turned", "slip"), [(1.0, 2.0), (-1.0, 198.0)])
def test_a_pulley_on_the_back_of_the_belt_slips_as_the_others(turned: float, slip: float) -> None:
    """It turns the other way; in the second case with a load that turns it against the belt."""
    record = belt_run(FOUR, samples=41)
    torque = np.tile([15.0, 0.0, 15.0 * turned, 0.0], (41, 1))
    speed = record.channels["pulley_speed"] * [1.0, 1.0, turned, 1.0]
    ax = slip_panel(with_channels(record, pulley_torque=torque, pulley_speed=speed))
    assert ax.get_ylabel() == "slip of\ntensioner, %"
    assert np.asarray(ax.lines[1].get_ydata()) == pytest.approx(slip)


def test_a_driver_at_rest_or_without_radius_has_no_slip() -> None:
    record = belt_run(samples=21)
    ax = slip_panel(with_channels(record, pulley_speed=np.zeros((21, 2))))
    assert not np.isfinite(ax.lines[0].get_ydata()).any()
    assert [text.get_text() for text in ax.texts] == ["no slip: driver is at rest"]
    bare = with_scenario(record, "")
    assert [ax.get_ylabel().split()[0] for ax in draw(bare, "speeds").axes] == ["pulley", "pulley"]


def test_the_scale_is_that_of_a_driver_in_motion() -> None:
    """Not that of its first moments, in which the ratio of two small speeds is anything."""
    record = belt_run(samples=201)
    speed = record.channels["pulley_speed"].copy()
    speed[1] = [1e-3, -5.0]
    speed[150, 1] *= 0.98
    ax = slip_panel(with_channels(record, pulley_speed=speed))
    low, high = ax.get_ylim()
    assert (0.7 < low < 1.0, 2.98 < high < 3.3) == (True, True)
    assert np.nanmax(np.asarray(ax.lines[0].get_ydata())) < 3.0


def test_the_line_of_the_slip_is_its_mean_over_a_fiftieth_of_the_time() -> None:
    record = solved()
    noise, line, _ = slip_panel(record).lines
    time, values = (np.asarray(data, dtype=float) for data in line.get_data())
    raw = np.asarray(noise.get_ydata(), dtype=float)
    half = 0.01 * np.ptp(record.channels["time"])
    for k in np.flatnonzero((time > time[0] + half) & (time < time[-1] - half))[::40]:
        fine = np.linspace(time[k] - half, time[k] + half, 4001)
        known = np.isfinite(raw)
        mean = np.interp(fine, np.asarray(noise.get_xdata())[known], raw[known]).mean()
        assert values[k] == pytest.approx(mean, abs=2e-3 * np.ptp(values))  # of 4001 points
    late = time > 0.35
    assert np.ptp(values[late]) < 0.7 * np.ptp(raw[-late.sum() :])
