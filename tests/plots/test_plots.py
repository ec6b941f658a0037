"""Pictures of results: every view of every kind, reproducible files, refused options."""

import tomllib
from collections.abc import Callable
from functools import cache
from pathlib import Path

import h5py
import numpy as np
import pytest

from frictionsim.errors import InputError, OutputError
from frictionsim.io import hdf5_reader, hdf5_writer
from frictionsim.plots import OF_EFFECT, VIEWS, plot, plot_all, views_of
from frictionsim.plots.time_history import EVENT_LINES, label_rows, line_widths
from frictionsim.results import Record
from frictionsim.simulation.simulate import RunResult
from tests.support.belt_results import FOUR, TWO, belt_run
from tests.support.scenarios import SCENARIOS, Scenario, changed, pulley, simulate, with_method

MAX_BYTES = 200_000  # of a picture, so that a page with several of them opens quickly
KINDS_SHIPPED = {"pulley", "marble_machine", "epicyclic", "shaft"}
SHIPPED = {
    path.stem: data["kind"]
    for path in sorted(SCENARIOS.glob("*.toml"))
    if (data := tomllib.loads(path.read_text()))["kind"] in KINDS_SHIPPED
}
BELTS = {"two pulleys": TWO, "four pulleys": FOUR}


def scenario(name: str) -> Scenario:
    return tomllib.loads((SCENARIOS / f"{name}.toml").read_text())


@cache
def run_of(name: str) -> RunResult:
    return belt_run(BELTS[name]) if name in BELTS else simulate(scenario(name))


def drawn(run: RunResult, tmp_path: Path, view: str | None = None, body: int | None = None) -> str:
    """Return the picture of a run as the text of an SVG."""
    hdf5_writer.write(run, tmp_path / "drawn.h5")
    picture = tmp_path / "drawn.svg"
    plot(hdf5_reader.read(tmp_path / "drawn.h5"), picture, view, body)
    return picture.read_text()


def views() -> list[tuple[str, str]]:
    kinds = SHIPPED | dict.fromkeys(BELTS, "belt_drive")
    return [(name, view) for name, kind in kinds.items() for view in views_of_run(name, kind)]


def views_of_run(name: str, kind: str) -> list[str]:
    return [view for view in VIEWS[kind] if name == "lift" or (kind, view) not in OF_EFFECT]


@pytest.mark.parametrize(("name", "view"), views())
def test_every_view_is_a_small_and_reproducible_file(name: str, view: str, tmp_path: Path) -> None:
    hdf5_writer.write(run_of(name), tmp_path / "a.h5")
    result = hdf5_reader.read(tmp_path / "a.h5")
    for picture in ("a.png", "b.png"):
        plot(result, tmp_path / picture, view)
    picture = (tmp_path / "a.png").read_bytes()
    assert picture == (tmp_path / "b.png").read_bytes()
    assert 5_000 < len(picture) < MAX_BYTES


@pytest.fixture
def result(tmp_path: Path) -> Record:
    path = tmp_path / "pulley.h5"
    hdf5_writer.write(simulate(pulley()), path)
    return hdf5_reader.read(path)


@pytest.mark.parametrize("suffix", [".png", ".pdf", ".svg"])
def test_pictures_are_reproducible_in_every_format(
    result: Record, suffix: str, tmp_path: Path
) -> None:
    pictures = [tmp_path / f"{name}{suffix}" for name in ("a", "b")]
    for picture in pictures:
        plot(result, picture)
    assert pictures[0].read_bytes() == pictures[1].read_bytes()


def test_panels_name_channel_and_unit(result: Record, tmp_path: Path) -> None:
    picture = tmp_path / "pulley.svg"
    plot(result, picture)
    text = picture.read_text()
    for label in ("drive force", "friction torque", "angular velocity", "angle", "time, s"):
        assert f">{label}" in text, label


def test_unknown_formats_and_folders_are_refused(result: Record, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"ends in \.png, \.pdf or \.svg"):
        plot(result, tmp_path / "pulley.jpg")
    with pytest.raises(OutputError, match="cannot write the picture"):
        plot(result, tmp_path / "nowhere" / "pulley.png")


def test_plot_command_names_what_it_wrote(cli: Callable, tmp_path: Path) -> None:
    hdf5_writer.write(simulate(pulley(effects=None)), tmp_path / "bare.h5")
    done = cli("plot", "bare.h5")
    assert (done.returncode, done.stdout.strip(), done.stderr) == (0, "bare.png", "")
    assert (tmp_path / "bare.png").read_bytes().startswith(b"\x89PNG")


def test_view_all_draws_each_view_into_its_own_file(cli: Callable, tmp_path: Path) -> None:
    hdf5_writer.write(run_of("epicyclic"), tmp_path / "gear.h5")
    done = cli("plot", "gear.h5", "--view", "all", "-o", "g.svg")
    names = [f"g-{view}.svg" for view in ("response", "torque", "path")]
    assert (done.returncode, done.stdout.split(), done.stderr) == (0, names, "")
    assert all((tmp_path / name).is_file() for name in names)


def test_view_all_skips_views_without_channels(cli: Callable, tmp_path: Path) -> None:
    bare = changed(scenario("epicyclic"), effects__tracer_point=None)
    hdf5_writer.write(simulate(bare), tmp_path / "gear.h5")
    done = cli("plot", "gear.h5", "--view", "all")
    assert (done.returncode, done.stdout.split()) == (0, ["gear-response.png", "gear-torque.png"])
    assert "view skipped: cannot draw the view 'path'" in done.stderr
    alone = cli("plot", "gear.h5", "--view", "path")
    assert (alone.returncode, alone.stdout) == (2, "")
    assert "effects.tracer_point" in alone.stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["--view", "tension"],
            "unknown view 'tension' of kind 'pulley'; known: response, traction",
        ),
        (["--body", "3"], "the view 'response' shows no single body"),
        (
            ["--view", "all", "-o", "a.jpg"],
            "expected a picture name that ends in .png, .pdf or .svg",
        ),
        (["--body", "x"], "--body: expected a whole number, got 'x'"),
    ],
)
def test_plot_refuses_invalid_options(
    arguments: list[str], message: str, cli: Callable, tmp_path: Path
) -> None:
    hdf5_writer.write(run_of("pulley"), tmp_path / "a.h5")
    done = cli("plot", "a.h5", *arguments)
    assert (done.returncode, done.stdout) == (2, "")
    assert message in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["a.h5"]


def test_a_result_of_an_unknown_kind_is_refused() -> None:
    with pytest.raises(InputError, match="unknown kind 'clock'; known: pulley, marble_machine"):
        views_of("clock")


def test_a_result_without_samples_is_refused(tmp_path: Path) -> None:
    run = run_of("pulley")
    none = {name: channel[:0] for name, channel in run.channels.items()}
    with pytest.raises(InputError, match="it has no samples"):
        drawn(run._replace(time=run.time[:0], channels=none), tmp_path)


def test_one_sample_is_enough(tmp_path: Path) -> None:
    for name, kind in (SHIPPED | {"two pulleys": "belt_drive"}).items():
        run = run_of(name)
        first = {channel: values[:1] for channel, values in run.channels.items()}
        hdf5_writer.write(
            run._replace(time=run.time[:1], channels=first, transitions=[], sides={}),
            tmp_path / "a.h5",
        )
        written, reasons = plot_all(hdf5_reader.read(tmp_path / "a.h5"), tmp_path / f"{name}.png")
        assert (len(written), reasons) == (len(views_of_run(name, kind)), [])


def test_sticking_and_events_are_labelled(tmp_path: Path) -> None:
    text = drawn(run_of("pulley_return"), tmp_path)
    for words in ("sticking", "breakaway", "comes to rest", "0.5464 s", "5.134 s", "stick"):
        assert f">{words}</text>" in text


def test_a_pulley_is_drawn_with_its_static_limits(tmp_path: Path) -> None:
    text = drawn(run_of("pulley"), tmp_path)
    for words in ("2707.7 N", "1826.9 N", "limit of static friction"):
        assert f">{words}" in text
    locked = simulate(pulley(effects__shaft_friction__mu_s=1.9, drive__force=10.0))
    pressed = drawn(locked, tmp_path)
    assert "limit of static friction" in pressed
    assert "to lift" not in pressed
    free = drawn(simulate(pulley(effects=None)), tmp_path)
    assert "to lift" not in free
    assert "limit of static friction" not in free


def test_many_events_are_not_marked(tmp_path: Path) -> None:
    sine = {"sine": {"mean": 2200.0, "amplitude": 600.0, "frequency_hz": 1.0}}
    run = simulate(pulley(drive__force=sine, solver__duration=60.0))
    assert "events, not marked" in drawn(run, tmp_path)
    plot(hdf5_reader.read(tmp_path / "drawn.h5"), tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size < MAX_BYTES


def test_an_invalid_scenario_omits_the_static_limits(tmp_path: Path) -> None:
    hdf5_writer.write(run_of("pulley"), tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5", "r+") as file:
        file.attrs["scenario"] = file.attrs["scenario"].replace("cord_radius", "radius_of_the_cord")
    picture = tmp_path / "a.svg"
    plot(hdf5_reader.read(tmp_path / "a.h5"), picture)
    assert "to lift" not in picture.read_text()


@pytest.mark.parametrize(
    ("name", "view", "scenario", "message"),
    [
        ("marble_machine", "torque", "", "the scenario in this result has no mechanism.gear_ratio"),
        ("epicyclic", "path", "a = ", "cannot read the scenario in this result"),
        ("two pulleys", "drive", "", "the scenario in this result has no mechanism.pulleys"),
    ],
)
def test_missing_scenario_values_are_reported(
    name: str, view: str, scenario: str, message: str, tmp_path: Path
) -> None:
    hdf5_writer.write(run_of(name), tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5", "r+") as file:
        file.attrs["scenario"] = scenario
    with pytest.raises(InputError, match=message):
        plot(hdf5_reader.read(tmp_path / "a.h5"), tmp_path / "a.png", view)


@pytest.mark.parametrize(
    ("name", "view", "channels", "needed"),
    [
        ("marble_machine", "torque", ["angle"], "no channel motor_torque"),
        ("epicyclic", "torque", ["drive_torque"], "no channel angle"),
        ("epicyclic", "torque", ["angle"], "none of the channels drive_torque, uniform_torque"),
        ("epicyclic", "path", ["tracer_x"], "tracer_x, tracer_y"),
    ],
)
def test_views_name_their_missing_channels(
    name: str, view: str, channels: list[str], needed: str, tmp_path: Path
) -> None:
    run = run_of(name)
    kept = {channel: run.channels[channel] for channel in channels}
    with pytest.raises(InputError, match=needed):
        drawn(run._replace(channels=kept), tmp_path, view)


def test_lines_of_dense_events_are_thinner() -> None:
    assert list(line_widths([0.0, 1.0, 2.0], 0.1)) == [1.0, 1.0, 1.0]
    assert list(line_widths([0.0, 0.05, 2.0], 0.1)) == [1.0, 1.0, 1.0]
    dense = line_widths(np.array([0.0, 0.05, 0.1, 0.10001, 0.10002, 3.0]), 0.1)
    assert dense == pytest.approx([1.0, 0.5, 0.5, 0.25, 1.0, 1.0])
    assert list(line_widths([0.0, 0.0, 0.0], 0.0)) == [1.0, 1.0, 1.0]
    assert list(line_widths([], 0.1)) == []


def test_each_event_of_an_end_stop_looks_different() -> None:
    words = ("impact", "comes to rest", "left")
    looks = {str(sorted(EVENT_LINES[f"stop: {word}"].items())) for word in words}
    others = {str(sorted(look.items())) for look in EVENT_LINES.values()}
    assert len(looks) == 3
    # Nor like that of any other contact; a rope on each side looks the same.
    assert len(others) == len(EVENT_LINES) - 3


def test_label_rows_avoid_overlap() -> None:
    assert label_rows([0.0, 1.0, 2.0], 0.9, max_rows=2) == [0, 0, 0]
    assert label_rows([0.0, 0.5, 1.0], 0.9, max_rows=2) == [0, 1, 0]
    assert label_rows(np.array([0.0, 0.1, 0.2]), 0.9, max_rows=2) == []
    assert label_rows([], 0.9, max_rows=2) == []


def test_the_title_names_another_law_than_the_set_valued(tmp_path: Path) -> None:
    published = simulate(with_method(pulley(solver__duration=0.1), "published", "rkf45"))
    assert "law published; backend rkf45" in drawn(published, tmp_path)
    assert "law" not in drawn(simulate(pulley(solver__duration=0.1)), tmp_path)


def test_a_picture_replaces_no_other_file(result: Record, tmp_path: Path) -> None:
    for name in ("a.png", "a.svg", "a.pdf"):
        picture = tmp_path / name
        plot(result, picture)
        plot(result, picture)
        picture.write_text("notes of mine")
        with pytest.raises(OutputError, match="the existing file is not a picture and is not"):
            plot(result, picture)
        assert picture.read_text() == "notes of mine"


def test_a_matplotlibrc_changes_no_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not even one that needs LaTeX; it is that of the working folder or of the user."""
    import matplotlib as mpl

    import frictionsim as fs

    result = fs.solve(SCENARIOS / "pulley.toml")
    plot(result.record, tmp_path / "a.png")
    of_user = {"text.usetex": True, "font.size": 20.0, "savefig.transparent": True}
    for name, value in of_user.items():
        monkeypatch.setitem(mpl.rcParams, name, value)
    plot(result.record, tmp_path / "b.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert {name: mpl.rcParams[name] for name in of_user} == of_user
