"""Pictures of belt drives, from synthetic results with known tensions and forces."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frictionsim.errors import InputError
from frictionsim.io import hdf5_reader, hdf5_writer
from frictionsim.plots import VIEWS, draw, plot
from frictionsim.plots.belt_geometry import (
    BeltLine,
    constant_runs,
    first_free_body,
    middle_of_first_span,
)
from frictionsim.plots.belt_time_history import default_body
from frictionsim.results import Record
from tests.support.belt_results import FOUR, TWO, Pulley, belt_run, lay, tension_at
from tests.support.records import record_of

RING = [Pulley(f"p{i}", 0.5 * np.cos(0.483 * i), 0.5 * np.sin(0.483 * i), 0.05) for i in range(13)]
FORCES = ["normal_force", "friction_force"]
NEEDED = {
    "speeds": ["pulley_speed", "pulley_torque"],
    "drive": ["x", "y", "tension", *FORCES, "pulley_index", "sticking"],
    "tension": ["x", "y", "pulley_index", "tension"],
    "body": ["pulley_speed", "tension", *FORCES, "slip_velocity", "pulley_index"],
}


@pytest.fixture
def picture(tmp_path: Path) -> Callable[..., str]:
    """Draw a run; return the text of the picture."""

    def draw(run: object, view: str, body: int | None = None) -> str:
        plot(read_back(run, tmp_path), tmp_path / "a.svg", view, body)
        return (tmp_path / "a.svg").read_text()

    return draw


def read_back(run: object, tmp_path: Path) -> Record:
    hdf5_writer.write(run, tmp_path / "a.h5")  # type: ignore[arg-type]
    return hdf5_reader.read(tmp_path / "a.h5")


def without(*names: str) -> object:
    run = belt_run(samples=5)
    return run._replace(channels={k: v for k, v in run.channels.items() if k not in names})


@pytest.mark.parametrize("view", VIEWS["belt_drive"])
def test_each_view_requires_its_channels_only(view: str, picture: Callable[..., str]) -> None:
    others = [name for name in belt_run(samples=2).channels if name not in NEEDED[view]]
    picture(without(*others), view)
    for name in NEEDED[view]:
        with pytest.raises(InputError, match=rf"no channel {name}; the view needs .*{name}"):
            picture(without(name), view)


def test_plot_reports_missing_channels(cli: Callable, tmp_path: Path) -> None:
    hdf5_writer.write(without("x", "tension"), tmp_path / "a.h5")  # type: ignore[arg-type]
    done = cli("plot", "a.h5", "--view", "drive")
    assert (done.returncode, done.stdout) == (2, "")
    assert "this result has no channel x, tension; the view needs x, y, tension," in done.stderr


@pytest.mark.parametrize("view", VIEWS["belt_drive"])
def test_a_belt_without_friction_is_drawn(view: str, picture: Callable[..., str]) -> None:
    run = belt_run(samples=5, effects={})
    names = ("friction_force", "slip_velocity", "sticking")
    channels = {name: channel for name, channel in run.channels.items() if name not in names}
    text = picture(run._replace(channels=channels), view)
    assert "stick" not in text
    assert "friction" not in text


def test_pulleys_are_named(picture: Callable[..., str]) -> None:
    for view in VIEWS["belt_drive"]:
        text = picture(belt_run(FOUR, samples=41), view)
        for pulley in FOUR:
            assert f">{pulley.name}" in text, (view, pulley.name)


def test_details_are_limited_to_the_first_pulleys(picture: Callable[..., str]) -> None:
    text = picture(belt_run(RING, bodies=400, samples=3), "drive")
    assert "forces on the first 8 of 13 pulleys" in text


@pytest.mark.parametrize("bodies", [400, 4000])
def test_pictures_of_large_belts_are_small_files(bodies: int, tmp_path: Path) -> None:
    result = read_back(belt_run(RING, bodies=bodies, samples=11), tmp_path)
    for view in VIEWS["belt_drive"]:
        plot(result, tmp_path / "a.png", view)
        assert (tmp_path / "a.png").stat().st_size < 200_000, view


def test_a_body_is_chosen_by_its_number(picture: Callable[..., str]) -> None:
    assert "body 7 on driven" in picture(belt_run(), "body", 7)
    assert "body 32 on driver" in picture(belt_run(), "body")


def axes_of_body(touched: np.ndarray, body: int | None = None, drop: str = "") -> list[Any]:
    run = belt_run(bodies=6, samples=5)
    channels = {k: v for k, v in run.channels.items() if k not in drop}
    run = run._replace(channels=channels | {"pulley_index": touched})
    return draw(record_of(run), "body", body).axes


KINDS = np.array([[0.0, -1, -1, -1, 1, 1], [0, 0, -1, -1, 1, 1], [0, 0, -1, -1, -1, 1]])
FREE = KINDS[[0, 1, 1, 2, 2]]


def test_a_body_that_meets_no_pulley_is_drawn_with_its_place() -> None:
    axes = axes_of_body(FREE, 2)
    assert axes[0].get_title(loc="left") == (
        "body 2 meets no pulley from 0 s to 2 s: there are no forces on it, and no slip"
    )
    labels = [" ".join(ax.get_ylabel().split()) for ax in axes]
    assert labels == [
        *("pulley speed, rad/s", "tension before body 2, N"),
        *("x of body 2, m", "y of body 2, m"),
    ]
    run = belt_run(bodies=6, samples=5)
    for ax, name in zip(axes[1:], ("tension", "x", "y"), strict=True):
        np.testing.assert_allclose(ax.lines[0].get_ydata(), run.channels[name][:, 2])
    assert len(axes_of_body(FREE, 2, drop="xy")) == 2


def test_the_body_by_default_meets_a_pulley() -> None:
    assert middle_of_first_span(FREE[0]) == 2  # which meets none
    axes = axes_of_body(FREE)
    assert axes[0].get_title(loc="left") == ""
    assert "body 0" in axes[1].get_ylabel()
    assert default_body(np.full((3, 5), -1.0)) == 0
    touched = FREE.copy()
    touched[4, 2] = 1.0
    assert default_body(touched) == 2


def test_an_unknown_body_is_refused(cli: Callable, tmp_path: Path) -> None:
    hdf5_writer.write(belt_run(samples=3), tmp_path / "a.h5")
    for number in ("150", "-1"):
        done = cli("plot", "a.h5", "--view", "body", f"--body={number}")
        assert (done.returncode, done.stdout) == (2, "")
        assert f"there is no body {number}; the bodies of this belt are 0 to 149" in done.stderr
    done = cli("plot", "a.h5", "--body", "3")
    assert done.returncode == 2
    assert "the view 'speeds' shows no single body" in done.stderr


def test_an_unknown_pulley_index_is_refused(picture: Callable[..., str]) -> None:
    run = belt_run(samples=3)
    touched = run.channels["pulley_index"].copy()
    touched[:, 3] = 2.0
    for view in ("drive", "tension", "body"):
        with pytest.raises(InputError, match="touch pulleys that are not in its scenario"):
            picture(run._replace(channels=run.channels | {"pulley_index": touched}), view)


def test_positions_along_the_belt_start_at_the_first_pulley(tmp_path: Path) -> None:
    bodies = 600
    result = read_back(belt_run(FOUR, bodies=bodies), tmp_path)
    _, distances, under = lay(FOUR)
    belt = BeltLine(result, -1)
    pitch = distances[-1] / bodies
    assert belt.length == pytest.approx(distances[-1], rel=1e-3)
    found = result.channels["tension"][-1][belt.order]
    # The first joint is within a body of where the belt leaves the pulley.
    expected = tension_at(belt.place[:-1], under, distances, 1.0)
    slope = 4.0 * 560.0 / distances[-1]
    assert np.max(np.abs(found - expected)[2:-2]) < 2.0 * pitch * 2.0 * slope


def test_the_mean_tension_is_taken_at_fixed_positions(tmp_path: Path) -> None:
    result = read_back(belt_run(FOUR, bodies=600), tmp_path)
    belt = BeltLine(result, -1)
    at_end = result.channels["tension"][-1][np.append(belt.order, belt.order[0])]
    # The tension at a place is steady there, though each joint has run on by 0.24 m.
    steady = belt.mean(result, range(160, 201))
    assert np.max(np.abs(steady - at_end)) < 0.02 * np.ptp(at_end)


def test_points_are_projected_to_the_nearest_segment(tmp_path: Path) -> None:
    result = read_back(belt_run(TWO, samples=3), tmp_path)
    belt = BeltLine(result, -1)
    middle = 0.5 * (belt.place[10] + belt.place[11])
    start, stop = (np.array(belt._points[i]) for i in (10, 11))
    off = 0.002 * np.array([start[1] - stop[1], stop[0] - start[0]]) / np.hypot(*(stop - start))
    places = belt.project(np.array([start, 0.5 * (start + stop) + off]))
    np.testing.assert_allclose(places, [belt.place[10], middle], atol=1e-12)


def test_constant_runs() -> None:
    assert list(constant_runs(np.array([0.0, 0.0, -1.0, 2.0]))) == [
        (0.0, 0, 2),
        (-1.0, 2, 3),
        (2.0, 3, 4),
    ]


@pytest.mark.parametrize(
    ("touched", "off", "middle"),
    [
        ([-1, -1, -1, 1, 1, -1, 0, 0], 0, 1),
        ([0, 0, -1, -1, -1, -1, 1, -1], 2, 4),
        ([0, -1, 0, -1, -1, 1, 1, 1], 3, 4),  # one has lifted off between two that touch
        ([-1, -1, -1, -1], 0, 0),
    ],
)
def test_first_free_body_and_middle_of_the_first_span(
    touched: list[int], off: int, middle: int
) -> None:
    assert first_free_body(np.array(touched)) == off
    assert middle_of_first_span(np.array(touched)) == middle
