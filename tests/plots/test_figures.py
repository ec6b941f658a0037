"""Views as figures: in a given figure or in place of axes, in threads, with integer channels."""

import pickle
import tomllib
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import cycle, pairwise
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from frictionsim.errors import InputError, OutputError
from frictionsim.io import hdf5_reader, hdf5_writer
from frictionsim.plots import OF_EFFECT, VIEWS, draw, plot, save, views_of
from frictionsim.plots import time_history as over_time
from frictionsim.plots.picture_file import png
from frictionsim.plots.work_precision import diagram
from frictionsim.results import OPEN, SLACK, STICK, TAUT, Record
from frictionsim.scenario.loading import validate
from frictionsim.simulation.jumps import with_jumps
from frictionsim.work_precision.study import Study
from tests.support.belt_results import FOUR, TWO, belt_run
from tests.support.scenarios import SCENARIOS, pulley, simulate

NAMES = ("pulley_return", "marble_machine", "epicyclic", "two pulleys", "four pulleys")
LAYOUTS = ("constrained", "none", "tight")


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Record]:
    """Return a result of each kind, as read from its file."""
    path = tmp_path_factory.mktemp("results") / "a.h5"
    found = {}
    for name in NAMES:
        belts = {"two pulleys": TWO, "four pulleys": FOUR}
        data = {} if name in belts else tomllib.loads((SCENARIOS / f"{name}.toml").read_text())
        run = belt_run(belts[name]) if name in belts else simulate(data)
        hdf5_writer.write(run, path)
        found[name] = hdf5_reader.read(path)
    return found


def views(results: dict[str, Record]) -> list[tuple[str, str]]:
    kinds = {name: results[name].attributes["kind"] for name in NAMES}
    every = [(name, view) for name, kind in kinds.items() for view in views_of(kind)]
    return [(name, view) for name, view in every if (kinds[name], view) not in OF_EFFECT]


@pytest.fixture(scope="module")
def pictures(results: dict[str, Record]) -> Callable[[str, str], bytes]:
    """Return the PNG of a view of a result, drawn once."""
    return cache(lambda name, view: png(draw(results[name], view)))


def grid(layout: str) -> tuple[Figure, Any]:
    figure = Figure(figsize=(12.0, 12.0), layout=layout)  # type: ignore[arg-type]
    return figure, figure.subplots(2, 2)


def titles(figure: Figure) -> list[str]:
    return [part.get_suptitle() for part in figure.subfigs]


# --- where a view is drawn -------------------------------------------------------------------


def test_a_view_is_returned_as_a_figure(results: dict[str, Record]) -> None:
    figure = draw(results["epicyclic"], "torque")
    assert (
        figure.get_suptitle() == "Epicyclic gear with hinge and rolling friction (backend events)"
    )
    assert tuple(figure.get_size_inches()) == (8.0, 4.25)


def test_a_given_figure_is_drawn_into_with_its_own_width(results: dict[str, Record]) -> None:
    given = Figure(figsize=(10.0, 2.0), layout="constrained")
    assert draw(results["epicyclic"], "torque", figure=given) is given
    assert tuple(given.get_size_inches()) == (10.0, 4.25)


def test_a_subfigure_keeps_the_size_of_its_figure(results: dict[str, Record]) -> None:
    figure = Figure(figsize=(12.0, 6.0), layout="constrained")
    left, right = figure.subfigures(1, 2)
    nested = right.subfigures(2, 1)[1]
    for part in (left, nested):
        assert draw(results["epicyclic"], figure=part) is figure
    assert tuple(figure.get_size_inches()) == (12.0, 6.0)
    assert nested.get_suptitle().startswith("Epicyclic gear")
    assert png(figure).startswith(b"\x89PNG")


@pytest.mark.parametrize("layout", LAYOUTS)
def test_views_take_the_place_of_axes(layout: str, results: dict[str, Record]) -> None:
    figure, axes = grid(layout)
    other = axes[1, 1]
    chosen = ("pulley_return", None), ("epicyclic", "path"), ("four pulleys", "drive")
    for ax, (name, view) in zip(axes.flat, chosen, strict=False):
        assert draw(results[name], view, ax=ax) is figure
    assert [ax for ax in figure.axes if ax in axes] == [other]
    assert [title.split(" (")[0] for title in titles(figure)] == [
        "Pulley on a dry shaft, up and back to rest",
        "Epicyclic gear with hinge and rolling friction",
        results["four pulleys"].attributes["title"] or "belt_drive",
    ]
    assert tuple(figure.get_size_inches()) == (12.0, 12.0)


@pytest.mark.parametrize("layout", ["constrained", "none"])
def test_parts_of_views_do_not_overlap(layout: str, results: dict[str, Record]) -> None:
    """Neither panels with title and legend, nor labels of panels, nor views next to each other."""
    jobs = views(results)
    for four in (jobs[i : i + 4] for i in range(0, len(jobs), 4)):
        figure, axes = grid(layout)
        for ax, (name, view) in zip(axes.flat, four, strict=False):
            draw(results[name], view, ax=ax)
        figure.draw_without_rendering()
        for part, job in zip(figure.subfigs, four, strict=True):
            _check_boxes(part, FigureCanvasAgg(figure).get_renderer(), job)


def _check_boxes(part: Any, renderer: Any, job: tuple[str, str]) -> None:
    title = part.texts[0].get_window_extent(renderer)
    legends = [legend.get_window_extent(renderer) for legend in part.legends]
    for panel in (ax.get_tightbbox(renderer) for ax in part.axes):
        for box in (title, *legends):
            assert min(panel.y1, box.y1) - max(panel.y0, box.y0) < 1.0, job  # pixel
        assert max(part.bbox.x0 - panel.x0, panel.x1 - part.bbox.x1) < 1.0, job
    if job[1] != "drive":  # its panels are side by side
        labels = [ax.yaxis.label.get_window_extent(renderer) for ax in part.axes]
        for upper, lower in pairwise(labels):
            assert upper.y0 > lower.y1, job


def test_what_cannot_be_drawn_into_is_refused(results: dict[str, Record]) -> None:
    result = results["epicyclic"]
    figure, axes = grid("none")
    cases: list[tuple[dict[str, Any], str]] = [
        ({"figure": figure}, "expected an empty figure, got one with axes or subfigures; give one"),
        ({"figure": axes}, "figure: expected a matplotlib Figure or SubFigure, got ndarray"),
        ({"ax": axes}, r"expected matplotlib Axes, got ndarray; of several, choose one, as axes\["),
        ({"ax": axes[0, 0], "figure": Figure()}, "got both; leave one out"),
        ({"ax": Figure().add_axes((0.1, 0.1, 0.8, 0.8))}, "got axes placed by hand; use subplots"),
    ]
    for options, message in cases:
        with pytest.raises(InputError, match=message):
            draw(result, **options)
    axes[0, 1].plot([1.0, 2.0])
    with pytest.raises(InputError, match="expected empty axes, got some with data"):
        draw(result, ax=axes[0, 1])
    draw(result, ax=axes[0, 0])
    with pytest.raises(InputError, match="these axes were removed from their figure"):
        draw(result, ax=axes[0, 0])


@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_view_that_fails_leaves_the_figure_as_it_was(
    layout: str, results: dict[str, Record]
) -> None:
    result = results["two pulleys"]
    wrong = result.channels["pulley_index"].copy()
    wrong[:, 3] = 2.0
    faulty = result._replace(channels=result.channels | {"pulley_index": wrong})
    figure, axes = grid(layout)
    margins = figure.subplotpars.left
    for view in ("tension", "body"):
        with pytest.raises(InputError, match="touch pulleys that are not in its scenario"):
            draw(faulty, view, ax=axes[0, 0])
    assert (figure.axes, figure.subfigs) == (list(axes.flat), [])
    assert figure.subplotpars.left == margins
    empty = Figure(figsize=(5.0, 5.0), layout=layout)  # type: ignore[arg-type]
    empty.suptitle("mine")
    with pytest.raises(InputError, match="touch pulleys"):
        draw(faulty, "tension", figure=empty)
    assert (empty.axes, empty.legends, empty.get_suptitle()) == ([], [], "mine")
    assert tuple(empty.get_size_inches()) == (5.0, 5.0)


def test_a_study_is_drawn_into_a_figure_or_in_place_of_axes() -> None:
    study = Study(validate(pulley(), Path()), (), None, [], "done", "", 0)
    assert tuple(diagram(study).get_size_inches()) == (9.0, 5.4)
    figure, axes = grid("constrained")
    assert diagram(study, ax=axes[0, 0]) is figure
    assert titles(figure)[0].endswith("error against run time")


# --- notebooks, processes, threads -----------------------------------------------------------


def test_a_figure_shows_itself_in_a_notebook_and_can_be_pickled(
    results: dict[str, Record], pictures: Callable[[str, str], bytes]
) -> None:
    for name, view in views(results):
        figure = pickle.loads(pickle.dumps(draw(results[name], view)))
        assert figure._repr_png_() == pictures(name, view), (name, view)


def test_a_figure_is_saved_as_the_command_line_does(
    results: dict[str, Record], tmp_path: Path
) -> None:
    plot(results["epicyclic"], tmp_path / "a.svg", "torque")
    save(draw(results["epicyclic"], "torque"), tmp_path / "b.svg")
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()


def test_threads_draw_the_same_pictures_as_one(results: dict[str, Record], tmp_path: Path) -> None:
    jobs = [
        (*job, suffix) for job, suffix in zip(views(results), cycle((".png", ".svg")), strict=False)
    ]

    def picture(name: str, view: str, suffix: str, folder: str) -> bytes:
        path = tmp_path / f"{folder}-{name}-{view}{suffix}"
        plot(results[name], path, view)
        return path.read_bytes()

    alone = [picture(*job, "alone") for job in jobs]
    parameters, filters = dict(mpl.rcParams), list(warnings.filters)
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda job: picture(*job, "together"), jobs))
    assert together == alone
    assert dict(mpl.rcParams) == parameters
    assert warnings.filters == filters


def test_a_picture_that_cannot_be_written_changes_no_parameter(
    results: dict[str, Record], tmp_path: Path
) -> None:
    parameters, filters = dict(mpl.rcParams), list(warnings.filters)
    with pytest.raises(OutputError, match="cannot write the picture: no space"):
        save(_Full(), tmp_path / "a.svg")
    assert (dict(mpl.rcParams), warnings.filters) == (parameters, filters)


class _Full(Figure):
    def savefig(self, *args: Any, **options: Any) -> None:
        raise OSError("no space")


# --- what later formats hold -----------------------------------------------------------------


def with_integers(result: Record, kind: type) -> Record:
    counts = ("mode", "pulley_index", "sticking", "carried_marbles")
    channels = {
        name: channel.astype(kind) if name.startswith(counts) else channel
        for name, channel in result.channels.items()
    }
    columns = ("contact", "mode_from", "mode_to", *counts)
    events = {
        name: values.astype(kind) if name.startswith(columns) else values
        for name, values in result.events.items()
    }
    return result._replace(channels=channels, events=events)


@pytest.mark.parametrize("kind", [np.int8, np.int32])
def test_integer_channels_give_the_same_pictures(
    kind: type, results: dict[str, Record], pictures: Callable[[str, str], bytes]
) -> None:
    for name, view in views(results):
        if name == "four pulleys":  # as of two
            continue
        result = with_integers(results[name], kind)
        changed_names = [n for n, c in result.channels.items() if c.dtype == kind]
        assert changed_names, name
        assert png(draw(result, view)) == pictures(name, view), (name, view)


def test_jumps_of_a_count_are_gaps(results: dict[str, Record]) -> None:
    result = results["marble_machine"]
    time = result.channels["time"]
    counts = np.where(time < 1.0, 3, 4).astype(np.int8)
    events = {name: values[:1] for name, values in result.events.items()}
    events |= {"time": np.array([1.0]), "n_before": np.array([3]), "n_after": np.array([4])}
    found = result._replace(channels=result.channels | {"n": counts}, events=events)
    _, values = with_jumps(found, "n")
    assert np.flatnonzero(np.isnan(values)).size == 1
    assert set(values[~np.isnan(values)]) == {3.0, 4.0}


def with_engagements(result: Record, count: int) -> Record:
    """Return a belt's result with events of its pulleys and spans, which have no angle."""
    modes = np.resize(np.array([STICK, 1, -1, OPEN, TAUT, SLACK], dtype=np.int8), count + 1)
    events = {
        "time": np.linspace(0.1, 1.9, count),
        "contact": np.arange(count) % 2,
        "mode_from": modes[:-1],
        "mode_to": modes[1:],
    }
    return result._replace(events=events, contacts=["driver", "driver_driven"])


@pytest.mark.parametrize("count", [12, 500])
def test_events_of_pulleys_and_spans_leave_the_views_of_belts(
    count: int, results: dict[str, Record], pictures: Callable[[str, str], bytes]
) -> None:
    result = with_engagements(results["two pulleys"], count)
    for view in VIEWS["belt_drive"]:
        assert png(draw(result, view)) == pictures("two pulleys", view), view


def test_channels_over_time_name_events_of_pulleys_and_spans(results: dict[str, Record]) -> None:
    figure = Figure(layout="constrained")
    result = with_engagements(results["two pulleys"], 6)
    over_time.response(result, figure)
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    for expected in ("driver: open", "driver_driven: taut", "driver: slack", "reverses"):
        assert expected in names, names
    assert "driver_driven: closed" in names


# --- kinds that are not built in -------------------------------------------------------------


@cache
def other_kind() -> Any:
    def dial(result: Record, figure: Any) -> None:
        figure.suptitle("dial")
        figure.subplots()

    return type("Module", (), {"VIEWS": {"dial": dial}})


def test_a_kind_may_bring_views_of_its_own(
    monkeypatch: pytest.MonkeyPatch, results: dict[str, Record]
) -> None:
    bare = type("Module", (), {})
    modules: dict[str, Callable[[], Any]] = {"clock": other_kind, "bare": lambda: bare}
    for room in ("frictionsim.plots", "frictionsim.plots.time_history"):
        monkeypatch.setattr(f"{room}.mechanism_module", lambda kind: modules[kind]())
    result = results["pulley_return"]
    clock = result._replace(attributes=result.attributes | {"kind": "clock"})
    assert list(views_of("clock")) == ["response", "dial"]
    assert draw(clock, "dial").get_suptitle() == "dial"
    assert list(views_of("bare")) == ["response"]
    plain = result._replace(attributes=result.attributes | {"kind": "bare"})
    assert draw(plain).axes[0].get_ylabel().endswith("rad")


def test_an_unknown_kind_is_refused(results: dict[str, Record]) -> None:
    result = results["pulley_return"]
    with pytest.raises(InputError, match="clock"):
        draw(result._replace(attributes=result.attributes | {"kind": "clock"}))
