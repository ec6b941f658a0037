"""A report of one run, or of several ones of a kind side by side: its HTML and its data."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.errors import InputError
from frictionsim.mechanisms.belt_drive.spans import span_tensions
from frictionsim.motion import motion_of
from frictionsim.motion.parts import Band, Motion
from frictionsim.reports.charts import Chart, Line, TimePool, chart_data, charts_of, line, undrawn
from frictionsim.reports.page import page, text
from frictionsim.reports.run_tables import (
    differences,
    events,
    origins,
    overview,
    scenarios,
    summary,
    warnings,
)
from frictionsim.reports.thinning import thinned
from frictionsim.scenario.recorded import scenario_value
from frictionsim.simulation.phases import event_names, sticking_phases

if TYPE_CHECKING:
    from frictionsim.reports.reported_run import ReportedRun

NEEDED = ("tension", "pulley_index")
MAX_SAMPLES = 2001  # evenly spread over the run


def span_charts(runs: "Sequence[ReportedRun]") -> list[Chart]:
    """Return a chart of the mean tension of each span; none if the channels are not there."""
    lines = tuple(found for number, run in enumerate(runs) for found in _lines(run, number))
    if not lines:
        return []
    words = "mean tension of each span, between pulleys in the order of the scenario"
    return [Chart("span_tension", words, "N", True, lines)]


def _lines(run: "ReportedRun", number: int) -> list[Line]:
    record = run.record
    if any(name not in record.channels for name in NEEDED) or not record.channels["time"].size:
        return []
    try:
        pulleys = scenario_value(record, "mechanism", "pulleys")
        names = [str(pulley["name"]) for pulley in pulleys]
    except (InputError, KeyError, TypeError):  # of another program, or edited
        return []
    time = record.channels["time"]
    samples = np.unique(np.linspace(0, len(time) - 1, min(len(time), MAX_SAMPLES)).astype(int))
    tension, touched = (record.channels[name][samples] for name in NEEDED)
    if np.max(touched, initial=-1) >= len(names):
        return []
    spans = np.array(
        [span_tensions(*sample, len(names)) for sample in zip(tension, touched, strict=True)]
    )
    return [
        line(
            "tension",
            f"{names[i]} to {names[(i + 1) % len(names)]}",
            (number, i),
            (time[samples], values),
        )
        for i, values in enumerate(spans.T)
    ]


BELT = "belt_drive"
MAX_MARKS = 60  # events; marks of more would hide the lines
MAX_STEPS = 4000  # of the clock


def run_report(runs: "Sequence[ReportedRun]") -> str:
    """Return the HTML of a report of runs of one kind."""
    title = runs[0].title
    if len(runs) > 1:
        title = f"Comparison: {', '.join(dict.fromkeys(run.title for run in runs))}"
    return page(title, _body(title, runs), data_of(runs))


def _body(title: str, runs: "Sequence[ReportedRun]") -> str:
    head = f'<header>\n<h1>{text(title)}</h1>\n{overview(runs)}<div id="tools"></div></header>\n'
    viewer = (
        '<div id="viewer">\n<div id="stage">\n<div id="clock"></div>\n<div id="drawings"></div>\n'
        f"{events(runs)}</div>\n"
        '<section id="charts" aria-labelledby="charts-heading">\n'
        '<h2 id="charts-heading">Channels over time</h2>\n'
        '<p id="message" role="status"></p>\n'
        f"{_without_charts(runs)}</section>\n</div>\n"
    )
    tables = f'<div id="tables">\n{summary(runs)}{differences(runs)}</div>\n'
    foot = "<footer><p>Made by frictionsim; this file asks for nothing from elsewhere.</p></footer>"
    return (
        f"{head}<main>\n{warnings(runs)}{viewer}{tables}{scenarios(runs)}{origins(runs)}</main>\n"
        + foot
    )


def _without_charts(runs: "Sequence[ReportedRun]") -> str:
    """Return which channels no chart shows, and what a browser without scripts shows."""
    found = (
        "<noscript><p>Charts and drawing need scripts, which this browser does not run;"
        " the tables do not.</p></noscript>\n"
    )
    names = list(dict.fromkeys(name for run in runs for name in undrawn(run)))
    if names:
        words = (
            f"{', '.join(names)}: of each body or joint, so not charted over time;"
            " 'frictionsim show --csv' prints them."
        )
        found += f'<p class="note" id="undrawn">{text(words)}</p>\n'
    return found


def data_of(runs: "Sequence[ReportedRun]") -> dict[str, Any]:
    """Return the data of a report, for the scripts of its page."""
    times = TimePool()
    more = []
    if runs[0].attribute("kind") == BELT:
        more = span_charts(runs)
    charts = chart_data(charts_of(runs, more), times)
    results = [_of_one(run, times) for run in runs]
    return {"results": results, "charts": charts, "times": times.arrays}


def _of_one(run: "ReportedRun", times: TimePool) -> dict[str, Any]:
    record = run.record
    time = np.asarray(record.channels["time"], dtype=float)
    motion, reason = _motion(run)
    names = event_names(record)
    return {
        "label": run.label,
        "kind": run.attribute("kind"),
        "motion": motion,
        "no_motion": reason,
        # A clock that goes from sample to sample needs no more of them than a line.
        "steps": times.number(time[thinned(time, MAX_STEPS)]),
        "sticking": [list(phase) for phase in sticking_phases(record)] if time.size else [],
        "events": {
            "time": np.asarray(record.events["time"], dtype=float),
            "names": names if len(names) <= MAX_MARKS else [],
        },
    }


def _motion(run: "ReportedRun") -> tuple[Motion | None, str]:
    """Return the motion of a run, or why there is none."""
    try:
        motion = motion_of(run.record)
    except InputError as error:
        return None, str(error)
    if motion is None:
        return None, f"There is no drawing of the kind {run.attribute('kind')}."
    return motion._replace(parts=tuple(map(_as_drawn, motion.parts))), ""


def _as_drawn(part: Any) -> Any:
    """Return a part as a screen shows it: a belt has so many points that doubles are too large."""
    if not isinstance(part, Band):
        return part
    values = {name: getattr(part, name) for name in ("x", "y", "value")}
    small: dict[str, Any] = {
        name: None if array is None else np.asarray(array, dtype=np.float32)
        for name, array in values.items()
    }
    return part._replace(**small)
