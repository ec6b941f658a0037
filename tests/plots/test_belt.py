"""Pictures of belt drives: tension along the belt, slip, friction over slip, wear."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes

import frictionsim as fs
from frictionsim.errors import InputError
from frictionsim.results import Quantity, Record
from tests.support.belt_scenarios import path_of, scenario_of, shipped
from tests.support.cases import one_in
from tests.support.html_elements import charts_of, report_of
from tests.support.records import (
    BELTS,
    VIEWS,
    draw,
    guided,
    shown,
    with_channels,
    with_scenario,
    without,
    words_of,
)
from tests.support.scenarios import simulate

FORCES = ["normal_force", "friction_force"]
STEEP = {"speed": [-50.0, 50.0], "value": [30.0, -30.0]}  # a torque over the speed
NEEDED = {
    "speeds": ["pulley_speed", "pulley_torque"],
    "drive": ["x", "y"],
    "tension": ["x", "y", "pulley_index", "tension"],
    "body": ["pulley_speed", "tension", *FORCES, "slip_velocity", "pulley_index"],
}


@pytest.mark.parametrize("view", VIEWS["belt_drive"])
def test_each_view_requires_its_channels_only(view: str) -> None:
    record = shown("belt_string")
    kept = ("time", *NEEDED[view])
    draw(without(record, *(name for name in record.channels if name not in kept)), view)
    for name in NEEDED[view]:
        words = rf"no channel {name}( \(see|; the view needs .*{name})"
        with pytest.raises(InputError, match=words):
            draw(without(record, name), view)


@pytest.mark.parametrize("view", one_in(3, VIEWS["belt_drive"]))
def test_pulleys_are_named_and_a_belt_without_friction_has_no_word_of_it(view: str) -> None:
    record = shown("belt_tensioner")
    words = words_of(draw(record, view))
    assert all(name in words for name in record.members["pulley"])
    text = fs.load(guided("belt_tensioner", effects__belt_friction=None)).to_toml()
    record = without(with_scenario(record, text), "friction_force", "slip_velocity", "sticking")
    words = words_of(draw(record, view))
    assert "stick" not in words
    assert "friction" not in words


def test_a_body_has_its_forces_while_it_touches_a_pulley() -> None:
    record = shown("belt_string")
    figure = draw(record, "body", body=31)
    assert "body 31 on driven" in words_of(figure)
    touched = record.channels["pulley_index"][:, 31] >= 0
    wanted = np.where(touched, record.channels["normal_force"][:, 31], np.nan)
    np.testing.assert_array_equal(figure.axes[2].lines[0].get_ydata(), wanted)
    figure = draw(record, "body")
    longest = np.sum(record.channels["pulley_index"] >= 0, axis=0)
    assert f"tension before body {np.argmax(longest)}" in words_of(figure).replace("\n", " ")


@pytest.mark.parametrize("name", BELTS)
def test_tensions_are_at_their_places_along_the_belt(name: str) -> None:
    """From where the belt leaves the first pulley, in the origin, along its tangent."""
    record = shown(name)
    first, second, *_ = shipped(name)["mechanism"]["pulleys"]
    ax = draw(record, "tension").axes[0]
    drawn = np.asarray(ax.lines[0].get_xydata())
    now = {channel: values[-1] for channel, values in record.channels.items()}
    index = now["pulley_index"]
    leaves = np.flatnonzero((index == 0) & (np.roll(index, -1) < 0))[0]
    order = np.roll(np.arange(len(index)), -leaves - 1)
    span = order[: np.argmax(index[order] >= 0)]  # the bodies on it
    distance = np.sqrt(now["x"][span] ** 2 + now["y"][span] ** 2 - first["radius"] ** 2)
    joints = np.column_stack([0.5 * (distance[1:] + distance[:-1]), now["tension"][span[1:]]])
    at = np.searchsorted(drawn[:, 0], joints[:, 0] - 1e-9)
    np.testing.assert_allclose(drawn[at], joints, rtol=1e-12)
    words = " ".join(ax.get_xlabel().split())
    assert f"from {first['name']} towards {second['name']}" in words
    # The first stretch on a pulley is on the second one.
    across = first["radius"] + (1.0 if "side" in second else -1.0) * second["radius"]
    start = np.sqrt(np.hypot(*second["center"]) ** 2 - across**2)
    arc = record.quantities[f"contact_arc_{second['name']}"].value * second["radius"]
    stretch = min((p for p in ax.patches if p.get_width() > 0), key=lambda p: p.get_x())
    assert [stretch.get_x(), stretch.get_width()] == pytest.approx([start, arc], rel=1e-9)
    # The mean at a place of a span is that of the span, by 7e-4 of the range, though joints have
    # run on and waves of up to a twentieth of it pass.
    place, mean = (np.asarray(values) for values in ax.lines[1].get_data())
    means, pitch = [q.value for n, q in record.quantities.items() if "_to_" in n], np.diff(place)[0]
    for line, expected in zip(ax.lines[2:], means, strict=True):
        low, high = line.get_xdata()
        assert line.get_ydata() == pytest.approx([expected] * 2, rel=1e-12)
        inside = (place > low + 2.0 * pitch) & (place < high - 2.0 * pitch)
        assert np.abs(mean[inside] - expected).max() < 2e-3 * np.ptp(drawn[:, 1])


def test_the_tension_of_a_string_is_that_of_its_joints() -> None:
    record = shown("belt_string")
    ax = draw(record, "tension").axes[0]
    arc, span = np.pi * 0.027, 0.515
    shaded = sorted((p.get_x(), p.get_width()) for p in ax.patches if p.get_width() > 0)
    np.testing.assert_allclose(shaded, [(span, arc), (2 * span + arc, arc)], rtol=1e-9)
    place, tension = (np.asarray(values, dtype=float) for values in ax.lines[0].get_data())
    assert place[-1] - place[1] == pytest.approx(2 * (span + arc), rel=1e-12)
    assert sorted(tension[1:-1]) == sorted(record.channels["tension"][-1])
    # A joint is halfway between its points. They are evenly spaced, but for the 0.2 % by which they
    # are stretched more or less, and the chords across the ends of arcs.
    np.testing.assert_allclose(np.diff(place), np.ptp(place) / 61, rtol=0.01)
    # The summary is of the whole run.
    assert "mean of a span, as in the summary" in words_of(draw(record, "tension"))
    assert "as in the summary" not in words_of(draw(record, "tension", time=0.15))
    of_periods = record._replace(quantities={"mean_duration": Quantity(0.18, "s")})
    assert "mean over whole periods" in words_of(draw(of_periods, "tension", time=0.2))
    assert "mean over the last fifth" in words_of(draw(of_periods, "tension", time=0.15))


@pytest.mark.parametrize("name", ["driven", "shaft"])
def test_a_pulley_slips_and_sticks_in_picture_and_report(name: str, tmp_path: Path) -> None:
    """A name is free: that of a contact of other kinds too. The modes are those of the file."""
    speed = {"time": [0.0, 0.01, 0.03, 0.04, 0.06], "value": [0.0, -30.0, 30.0, 30.0, 0.0]}
    changes = {
        "drive": {"driver": {"speed": speed}, name: {"torque": STEEP}},
        "effects__belt_friction": {"mu_s": 0.05, "mu_k": 0.05},
    }
    data = guided(**changes, solver__duration=0.1)
    data["mechanism"]["pulleys"][1]["name"] = name
    result = fs.solve(data)
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
    data = guided(solver__duration=0.6)
    data["mechanism"]["pulleys"][1]["radius"] = 0.02  # unlike pulleys, which turn clockwise
    record = simulate(data)
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


def test_the_slip_is_of_the_pulleys_that_put_in_and_take_out_the_most_work() -> None:
    """Of these the latter is the roller on the back, which turns the other way."""
    drive = {**guided("belt_tensioner")["drive"], "tensioner": {"torque": STEEP}}
    record = simulate(guided("belt_tensioner", drive=drive))
    ax = slip_panel(record)
    crank, roller = (np.abs(record.channels["pulley_speed"][:, j]) for j in (0, 1))
    slow = crank < 0.1 * crank.max()
    percent = 100.0 * (1.0 - 0.035 * roller[~slow] / (0.06 * crank[~slow]))
    drawn = np.asarray(ax.lines[0].get_ydata())
    np.testing.assert_array_equal(np.isnan(drawn), slow)
    np.testing.assert_allclose(drawn[~slow], percent, atol=1e-9)
    assert ax.get_ylabel().replace("\n", " ") == "slip of tensioner, %"


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
        "driven": {"torque": STEEP},
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
    record = shown("belt_string")
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
