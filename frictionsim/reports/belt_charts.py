"""The tension of the spans of a belt over time, for reports."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from frictionsim.errors import InputError
from frictionsim.mechanisms.belt_drive.spans import span_tensions
from frictionsim.reports.charts import Chart, Line, line
from frictionsim.scenario.recorded import scenario_value

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
