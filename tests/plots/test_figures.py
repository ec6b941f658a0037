"""Views as figures: in a given figure or in place of axes, in threads, with integer channels."""

import pickle
import warnings
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import Collection
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patches import Patch
from matplotlib.spines import Spine

from frictionsim.errors import InputError
from frictionsim.results import OPEN, SLACK, STICK, TAUT, Record
from tests.plots.test_plots import MAX_BYTES
from tests.support.cases import one_in, slow
from tests.support.records import VIEWS, draw, drawn_views, picture, png, shown, with_channels

LAYOUTS = ("constrained", "none", "tight")


DOTS_OF_EDGES = 2e-3  # of all dots; a thin curve has as many: artists are compared, too


def grid(layout: str) -> tuple[Figure, Any]:
    figure = Figure(figsize=(12.0, 12.0), layout=layout)  # type: ignore[arg-type]
    return figure, figure.subplots(2, 2)


def content(figure: Figure) -> list[Any]:
    """Return kind, texts, colours, points and shapes of all artists of a picture."""
    items: list[Any] = []
    for artist in figure.findobj(lambda artist: not isinstance(artist, Spine)):
        items.append(type(artist).__name__)
        for name in ("text", "color", "facecolor", "marker", "linewidth"):
            if hasattr(artist, f"get_{name}"):
                items.append(repr(getattr(artist, f"get_{name}")()))
        for name in ("position", "xlim", "ylim", "xydata", "array", "offsets"):
            if hasattr(artist, f"get_{name}"):
                values = np.ma.array(getattr(artist, f"get_{name}")(), dtype=float)
                items.append(values.filled(np.nan).tobytes())
        if isinstance(artist, Patch):
            items.append(artist.get_extents().get_points().tobytes())
        elif isinstance(artist, Collection):
            items += [path.vertices.tobytes() for path in artist.get_paths()]
    return items


@cache
def content_of(name: str, view: str) -> list[Any]:
    return content(picture(name, view))


@pytest.mark.parametrize(("name", "view"), one_in(6, drawn_views()))
def test_every_view_is_a_small_file_and_can_be_pickled(name: str, view: str) -> None:
    figure = pickle.loads(pickle.dumps(picture(name, view)))
    assert content(figure) == content_of(name, view)
    assert 5_000 < len(png(figure)) < MAX_BYTES


@pytest.mark.slow
def test_a_pickled_figure_is_the_same_in_a_notebook() -> None:
    figure = draw(shown("marble_machine"), "torque")
    pickled = pickle.loads(pickle.dumps(figure))
    expected, image = (mpl.image.imread(BytesIO(png(one))) for one in (figure, pickled))
    assert image.shape == expected.shape
    # Without AVX-512 the edges of a few artists were seen to depend on what ran before.
    assert np.mean(np.any(image != expected, axis=2)) < DOTS_OF_EDGES


def test_axes_of_subfigures_are_replaced_too() -> None:
    figure = Figure(figsize=(12.0, 6.0), layout="constrained")
    left, right = figure.subfigures(1, 2)
    nested = right.subfigures(2, 1)[1]
    for part in (left, nested):
        assert draw(shown("epicyclic"), "torque", ax=part.subplots()) is figure
    assert tuple(figure.get_size_inches()) == (12.0, 6.0)
    assert nested.subfigs[0].get_suptitle().startswith("Epicyclic gear")
    figure.draw_without_rendering()


# Of belts four pulleys need more room than two.
PLACED = [job for job in drawn_views() if job[0] != "two pulleys"][1:12:2]


@pytest.mark.parametrize(
    ("layout", "jobs"),
    [("none", PLACED[:1]), slow("none", PLACED[1:3]), slow("constrained", PLACED[3:])],
)
def test_views_take_the_place_of_axes(layout: str, jobs: list[tuple[str, str]]) -> None:
    """Neither panels with title and legend, nor labels of panels, nor views next to each other."""
    figure, axes = grid(layout)
    for ax, (name, view) in zip(axes.flat, jobs, strict=False):
        assert draw(shown(name), view, ax=ax) is figure
    assert [ax for ax in figure.axes if ax in axes] == list(axes.flat[len(jobs) :])
    assert tuple(figure.get_size_inches()) == (12.0, 12.0)
    figure.draw_without_rendering()
    for part, job in zip(figure.subfigs, jobs, strict=True):
        assert part.get_suptitle() == " ".join(picture(*job).get_suptitle().split())
        _check_boxes(part, FigureCanvasAgg(figure).get_renderer(), job)


def _check_boxes(part: Any, renderer: Any, job: tuple[str, str]) -> None:
    title = part.texts[0].get_window_extent(renderer)
    legends = [legend.get_window_extent(renderer) for legend in part.legends]
    for panel in (ax.get_tightbbox(renderer) for ax in part.axes):
        for box in (title, *legends):
            assert min(panel.y1, box.y1) - max(panel.y0, box.y0) < 1.0, job  # pixel
        assert max(part.bbox.x0 - panel.x0, panel.x1 - part.bbox.x1) < 1.0, job
    if job[1] not in ("drive", "friction_circle"):  # their panels are side by side
        labels = [ax.yaxis.label.get_window_extent(renderer) for ax in part.axes]
        for upper, lower in pairwise(labels):
            assert upper.y0 > lower.y1, job


@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_view_that_fails_leaves_the_figure_as_it_was(layout: str) -> None:
    wrong = shown("two pulleys").channels["pulley_index"].copy()
    wrong[:, 3] = 2.0
    faulty = with_channels(shown("two pulleys"), pulley_index=wrong)
    figure, axes = grid(layout)
    margins = figure.subplotpars.left
    for view in ("drive", "tension", "body"):
        with pytest.raises(InputError, match="touch pulleys that are not in its scenario"):
            draw(faulty, view, ax=axes[0, 0])
    assert (figure.axes, figure.subfigs) == (list(axes.flat), [])
    assert figure.subplotpars.left == margins
    engine = figure.get_layout_engine()
    assert isinstance(engine, ConstrainedLayoutEngine) == (layout == "constrained")


@pytest.mark.slow
def test_threads_write_the_same_pictures_as_one_in_every_format(tmp_path: Path) -> None:
    jobs = [
        *(("pulley_return", "response", ".png"), ("epicyclic", "torque", ".svg")),
        *(("epicyclic", "path", ".pdf"), ("four pulleys", "tension", ".png")),
        *(("two pulleys", "drive", ".svg"), ("marble_machine", "torque", ".pdf")),
    ]

    def written(name: str, view: str, suffix: str, folder: str) -> bytes:
        path = tmp_path / f"{folder}-{name}-{view}{suffix}"
        figure = draw(shown(name), view)
        with_date = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
        figure.savefig(path, metadata=with_date.get(suffix, {}))
        return path.read_bytes()

    mpl.rcParams["svg.hashsalt"] = "a"  # else names of elements are random
    alone = [written(*job, "alone") for job in jobs]
    parameters, filters = dict(mpl.rcParams), list(warnings.filters)
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda job: written(*job, "together"), jobs))
    assert together == alone
    assert dict(mpl.rcParams) == parameters
    assert warnings.filters == filters


def with_integers(result: Record) -> Record:
    counts = ("mode", "pulley_index", "sticking", "carried_marbles")
    columns = ("contact", "mode_from", "mode_to", *counts)
    return result._replace(
        channels={
            name: channel.astype(np.int8) if name.startswith(counts) else channel
            for name, channel in result.channels.items()
        },
        events={
            name: values.astype(np.int8) if name.startswith(columns) else values
            for name, values in result.events.items()
        },
    )


@pytest.mark.parametrize(("name", "view"), one_in(4, drawn_views()))
def test_integer_channels_give_the_same_pictures(name: str, view: str) -> None:
    result = with_integers(shown(name))
    assert [n for n, c in result.channels.items() if c.dtype == np.int8]
    assert content(draw(result, view)) == content_of(name, view)


def test_jumps_of_a_count_are_gaps() -> None:
    result = shown("marble_machine")
    name = "carried_marbles"
    counts = np.where(result.channels["time"] < 1.0, 3, 4).astype(np.int8)
    events = {key: values[:1] for key, values in result.events.items()}
    events |= {"time": np.array([1.0])}
    events |= {f"{name}_before": np.array([3]), f"{name}_after": np.array([4])}
    changed = with_channels(result, **{name: counts})._replace(events=events)
    values = np.asarray(draw(changed, channels=name).axes[0].lines[0].get_ydata(), dtype=float)
    assert np.flatnonzero(np.isnan(values)).size == 1
    assert set(values[~np.isnan(values)]) == {3.0, 4.0}


def with_engagements(count: int) -> Record:
    """Return a belt's result with events of its pulleys and spans, which have no angle."""
    modes = np.resize(np.array([STICK, 1, -1, OPEN, TAUT, SLACK], dtype=np.int8), count + 1)
    events = {
        "time": np.linspace(0.1, 1.9, count),
        "contact": np.arange(count) % 2,
        "mode_from": modes[:-1],
        "mode_to": modes[1:],
    }
    return shown("two pulleys")._replace(events=events, contacts=["driver", "driver_driven"])


@pytest.mark.parametrize("count", [12, slow(500)])
def test_events_of_pulleys_and_spans_leave_the_views_of_belts(count: int) -> None:
    for view in VIEWS["belt_drive"]:
        actual = content(draw(with_engagements(count), view))
        assert actual == content_of("two pulleys", view), view


def test_channels_over_time_name_events_of_pulleys_and_spans() -> None:
    engaged = with_engagements(6)
    result = shown("pulley_return")._replace(events=engaged.events, contacts=engaged.contacts)
    names = {text.get_text() for text in draw(result).legends[0].get_texts()}
    assert names >= {"driver: open", "driver_driven: taut", "driver: slack", "reverses",
                     "driver_driven: closed"}  # fmt: skip


def test_an_unknown_kind_is_refused_with_the_known_ones() -> None:
    result = shown("pulley_return")
    with pytest.raises(InputError, match="unknown kind 'clock'; known: pulley, marble_machine"):
        draw(result._replace(attributes=result.attributes | {"kind": "clock"}))
