"""Pictures of belt drives: tension along the belt, slip, friction over slip, wear."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes

import frictionsim as fs
from frictionsim.errors import InputError
from frictionsim.results import Quantity, Record, Transition
from tests.support.belt_results import FOUR, TWO, Pulley, belt_run, lay, tension_at
from tests.support.belt_scenarios import path_of, scenario_of, shipped
from tests.support.cases import one_in
from tests.support.html_elements import charts_of, report_of
from tests.support.records import (
    VIEWS,
    draw,
    shown,
    string,
    with_channels,
    with_scenario,
    without,
    words_of,
)
from tests.support.scenarios import simulate

FORCES = ["normal_force", "friction_force"]
NEEDED = {
    "speeds": ["pulley_speed", "pulley_torque"],
    "drive": ["x", "y"],
    "tension": ["x", "y", "pulley_index", "tension"],
    "body": ["pulley_speed", "tension", *FORCES, "slip_velocity", "pulley_index"],
}
UNLIKE = (Pulley("big", 0.0, 0.0, 0.05), Pulley("small", 0.4, 0.1, 0.02))


@pytest.mark.parametrize("view", VIEWS["belt_drive"])
def test_each_view_requires_its_channels_only(view: str) -> None:
    record = belt_run(samples=5)
    kept = ("time", *NEEDED[view])
    draw(without(record, *(name for name in record.channels if name not in kept)), view)
    for name in NEEDED[view]:
        words = rf"no channel {name}( \(see|; the view needs .*{name})"
        with pytest.raises(InputError, match=words):
            draw(without(record, name), view)


@pytest.mark.parametrize("view", one_in(3, VIEWS["belt_drive"]))
def test_pulleys_are_named_and_a_belt_without_friction_has_no_word_of_it(view: str) -> None:
    words = words_of(draw(shown("four pulleys"), view))
    assert all(pulley.name in words for pulley in FOUR)
    record = belt_run(samples=5, effects={})
    words = words_of(draw(without(record, "friction_force", "slip_velocity", "sticking"), view))
    assert "stick" not in words
    assert "friction" not in words


def test_a_body_has_its_forces_while_it_touches_a_pulley() -> None:
    record = shown("two pulleys")
    figure = draw(record, "body", body=7)
    assert "body 7 on driven" in words_of(figure)
    touched = record.channels["pulley_index"][:, 7] >= 0
    wanted = np.where(touched, record.channels["normal_force"][:, 7], np.nan)
    np.testing.assert_array_equal(figure.axes[2].lines[0].get_ydata(), wanted)
    figure = draw(record, "body")
    longest = np.sum(record.channels["pulley_index"] >= 0, axis=0)
    assert f"tension before body {np.argmax(longest)}" in words_of(figure).replace("\n", " ")


@pytest.mark.parametrize("effects", [{}, {"contact": {"c2": 1e6}}])
def test_tensions_are_at_their_places_along_the_belt(effects: dict[str, Any]) -> None:
    """Of a string and of bodies in the plane, from where the belt leaves the first pulley."""
    bodies = 600
    _, distances, under = lay(FOUR)
    changes = {"effects": effects} if effects else {}
    ax = draw(belt_run(FOUR, bodies=bodies, **changes), "tension").axes[0]
    pitch = distances[-1] / bodies
    place, at_end = (np.asarray(values, dtype=float) for values in ax.lines[0].get_data())
    assert place[0] <= 0.0  # the joint before the first
    place, at_end = place[1:], at_end[1:]
    assert np.ptp(place) == pytest.approx(distances[-1], rel=1e-3)
    assert f"from {FOUR[0].name} towards {FOUR[1].name}" in ax.get_xlabel().replace("\n", " ")
    expected = tension_at(place[:-1], under, distances, 1.0)
    slope = 4.0 * 560.0 / distances[-1]
    assert np.max(np.abs(at_end[:-1] - expected)[2:-2]) < 2.0 * pitch * 2.0 * slope
    # The first stretch on a pulley is on the second one, where the ideal belt is.
    ends = distances[np.flatnonzero(under == 1)[[0, -1]]]
    first = min((patch for patch in ax.patches if patch.get_width() > 0), key=lambda p: p.get_x())
    assert [first.get_x(), first.get_x() + first.get_width()] == pytest.approx(ends, abs=2 * pitch)
    # The tension at a place is steady there, though each joint has run on by 0.24 m.
    steady = np.asarray(ax.lines[1].get_ydata())[1:]
    assert np.max(np.abs(steady - at_end)) < 0.02 * np.ptp(at_end)


def test_the_tension_of_a_string_is_that_of_its_joints() -> None:
    record = belt_run(TWO, bodies=60)
    ax = draw(record, "tension").axes[0]
    arc, span = np.pi * 0.027, 0.515
    shaded = sorted((p.get_x(), p.get_width()) for p in ax.patches if p.get_width() > 0)
    np.testing.assert_allclose(shaded, [(span, arc), (2 * span + arc, arc)], rtol=1e-9)
    place, tension = (np.asarray(values, dtype=float) for values in ax.lines[0].get_data())
    assert place[-1] - place[1] == pytest.approx(2 * (span + arc), rel=1e-12)
    assert sorted(tension[1:-1]) == sorted(record.channels["tension"][-1])
    # A joint is halfway between its points: those of a string at one tension are evenly spaced.
    np.testing.assert_allclose(np.diff(place), np.ptp(place) / 61, rtol=0.01)
    # The summary is of the whole run.
    assert "mean of a span, as in the summary" in words_of(draw(record, "tension"))
    assert "as in the summary" not in words_of(draw(record, "tension", time=1.0))
    of_periods = record._replace(quantities={"mean_duration": Quantity(1.2, "s")})
    assert "mean over whole periods" in words_of(draw(of_periods, "tension", time=1.4))
    assert "mean over the last fifth" in words_of(draw(of_periods, "tension", time=1.0))


@pytest.mark.parametrize("name", ["driven", "shaft"])
def test_a_pulley_slips_and_sticks_in_picture_and_report(name: str, tmp_path: Path) -> None:
    """A name is free: that of a contact of other kinds too. The modes are those of the file."""
    pulleys = [TWO[0], TWO[1]._replace(name=name)]
    events = [Transition(0.5, name, 0, 1), Transition(0.9, name, 1, 0)]
    events += [Transition(1.2, name, 0, -1), Transition(1.5, name, -1, 1)]
    result = fs.Result(belt_run(pulleys, bodies=40, samples=41, transitions=events))
    words = [f"{name}: {what}" for what in ("slips", "sticks", "reverses")]
    legend = [t.get_text() for of in fs.plot(result).legends for t in of.get_texts()]
    page = fs.report(result, tmp_path / "a.html").read_text("utf-8")
    for text in (" ".join(legend), page):
        assert all(one in text for one in words)
        assert "breakaway" not in text.partition("<script>")[0]


def slip_panel(record: Record) -> Any:
    axes = draw(record, "speeds").axes
    (ax,) = (ax for ax in axes if ax.get_ylabel().startswith("slip of"))
    return ax


def test_the_slip_is_that_of_the_angles_and_its_mean_that_of_the_summary() -> None:
    """By another way: how much less of the rims has passed, from the channel of the angles."""
    record = string(0.6, driven_radius=0.02)  # unlike pulleys that turn clockwise
    noise, line, mean = slip_panel(record).lines
    said = record.quantities["slip_percent"].value
    assert mean.get_ydata() == pytest.approx([said] * 2, 1e-12)
    assert mean.get_label() == f"weighted mean slip over the last fifth, {said:.4g} %"
    time, angle = record.channels["time"], record.channels["pulley_angle"]
    assert mean.get_xdata() == pytest.approx([0.8 * time[-1], time[-1]])
    passed = np.diff(np.abs(angle * [0.027, 0.02]), axis=0)
    expected = 100.0 * (passed[:, 0] - passed[:, 1]) / passed[:, 0]
    raw = np.asarray(noise.get_ydata())
    late = time[1:] > 0.35
    off = np.abs(0.5 * (raw[1:] + raw[:-1])[late] - expected[late])
    assert (off.max() < 0.1, off.mean() < 0.02) == (True, True)
    # The line is the mean over a fiftieth of the time.
    half = 0.01 * np.ptp(time)
    known = np.isfinite(raw)
    at, values = (np.asarray(data, dtype=float) for data in line.get_data())
    for k in np.flatnonzero((at > at[0] + half) & (at < at[-1] - half))[::80]:
        fine = np.linspace(at[k] - half, at[k] + half, 4001)
        averaged = np.interp(fine, time[known], raw[known]).mean()
        assert values[k] == pytest.approx(averaged, abs=2e-3 * np.ptp(values))  # of 4001 points


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize(("pulleys", "slip"), [(UNLIKE, 1.0), (FOUR, 3.0)])
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
    assert ax.get_ylabel().replace("\n", " ") == f"slip of {pulleys[-1].name}, %"


OIL = {"mu_s": 0.5, "mu_k": 0.4}
SHORT: dict[str, Any] = {"solver__duration": 0.02, "output__interval": 1e-3}


def curves(ax: Axes, words: str) -> list[tuple[Any, Any]]:
    """Return the points of the lines whose words begin so."""
    lines = [line for line in ax.lines if str(line.get_label()).startswith(words)]
    return [(np.asarray(line.get_xdata()), np.asarray(line.get_ydata())) for line in lines]


def test_the_cloud_of_exact_friction_lies_on_a_vertical_and_two_rays() -> None:
    law = {"mu_s": 0.2, "mu_k": 0.16}
    speeds = {
        "driver": {"speed": {"time": [0.0, 0.01], "value": [0.0, -30.0]}},
        "driven": {"torque": {"speed": [-50.0, 50.0], "value": [30.0, -30.0]}},
    }
    changes = {"effects__belt_friction": law, "drive": speeds, "solver__backend": "moreau"}
    record = simulate(shipped("belt_string", **SHORT, **changes))
    (ax,) = draw(record, "friction").axes
    ((slip, mu),) = curves(ax, "law, μs = 0.2, μk = 0.16")
    assert mu.tolist() == [-0.16, -0.16, -0.2, 0.0, 0.0, 0.2, 0.16, 0.16]
    assert slip.tolist()[1:-1] == [0.0] * 6
    late = record.time >= 0.8 * record.time[-1]
    touching = record.channels["normal_force"][late] > 0.0
    clouds = curves(ax, "bodies on ")
    assert sum(slip.size for slip, _ in clouds) == np.sum(touching)
    for slip, ratio in clouds:
        sticks = np.abs(slip) < 1e-9  # rounding of speeds of a metre per second
        assert np.all(np.abs(ratio[sticks]) <= 0.2 * (1.0 + 1e-9))
        assert ratio[~sticks] == pytest.approx(0.16 * np.sign(slip[~sticks]), rel=1e-9)
    stuck = with_channels(record, sticking=np.ones_like(record.channels["sticking"]))
    figure = draw(stuck, "friction")
    rings = [line for line in figure.axes[0].lines if line.get_markersize() == 5.0]
    slip = np.abs(record.channels["slip_velocity"][late])
    fast = slip[touching] > 2e-3 * slip[record.channels["pulley_index"][late] >= 0].max()
    assert sum(np.size(line.get_xdata()) for line in rings) == np.sum(fast) > 0
    assert "sticks, with residual slip" in words_of(figure)


def test_a_result_without_counts_of_steps_is_drawn_and_one_of_an_edited_scenario_refused() -> None:
    record = string()
    draw(record._replace(statistics=None), "friction")
    record = with_channels(record, friction_work=np.zeros_like(record.channels["x"]))
    text = record.attributes["scenario"].replace("mu_s", "mu_x")
    edited = with_scenario(record, f"{text}\n[effects.wear]\n")
    for view in ("friction", "wear"):
        with pytest.raises(
            InputError, match=r"is not valid: effects\.belt_friction\.mu_x: unknown"
        ):
            draw(edited, view)


def test_the_areas_of_the_wear_are_the_work_of_friction() -> None:
    patches = [{"from": 0.5, "to": 0.7, **OIL, "name": "oil"}, {"from": 0.8, "to": 0.9, **OIL}]
    changes = {"solver__backend": "moreau", "effects__patch": patches, "effects__wear": {}}
    data = shipped("belt_string", **SHORT, **changes)
    record = simulate(data)
    for sample in (-1, 10):
        ax = draw(record, "wear", time=float(record.time[sample])).axes[0]
        values, edges, _ = ax.patches[0].get_data()  # type: ignore[attr-defined]
        length = path_of(scenario_of(data)).length / (1.0 + 555.0 / 1.52e5)
        assert edges[[0, -1]] == pytest.approx([0.0, length], rel=1e-9)
        heat = record.channels["energy_friction"][sample]
        assert np.sum(values * np.diff(edges)) == pytest.approx(heat, rel=1e-9)
    shaded = sorted((p.get_x(), p.get_x() + p.get_width()) for p in ax.patches[1:])
    half = 0.5 * length / 60 + 1e-12  # to the ends of bodies, whose middles are inside
    assert np.ravel(shaded) == pytest.approx([0.5, 0.7, 0.8, 0.9], abs=half)
    ax = draw(record, "wear").axes[0]
    for name in ("clean", "oil", "patch"):
        mean = record.quantities[f"friction_work_{name}"].value
        assert [y[0] for _, y in curves(ax, f"mean of {name}, ")] == [
            pytest.approx(mean, rel=1e-12)
        ]
    (line,), _ = charts_of(report_of(fs.Result(record)))["wear"]
    assert line["y"][:-1] == pytest.approx(ax.patches[0].get_data()[0], rel=1e-6)  # type: ignore[attr-defined]
    with pytest.raises(InputError, match="this result has no channel friction_work"):
        draw(without(record, "friction_work"), "wear")
