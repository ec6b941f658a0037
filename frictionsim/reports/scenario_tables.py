"""The scenarios of runs as text, in which keys they differ, and how the results were made."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from frictionsim.errors import InputError
from frictionsim.reports.page import text
from frictionsim.reports.tables import paragraph, section, table
from frictionsim.scenario.recorded import differing_keys

if TYPE_CHECKING:
    from frictionsim.reports.reported_run import ReportedRun

ABSENT = "\N{EM DASH}"
MAX_VALUE = 120  # characters of a value in a table


def scenarios(runs: "Sequence[ReportedRun]") -> str:
    """Return the scenarios of runs as TOML."""
    parts = []
    for run in runs:
        toml = "\n".join(text(line) for line in run.attribute("scenario").split("\n")).strip()
        words = f"Scenario of {run.label}" if len(runs) > 1 else "After overrides, as it was solved"
        parts.append(
            f"<details open><summary>{text(words)}</summary>\n"
            f'<pre tabindex="0"><code>{toml}</code></pre></details>\n'
        )
    return section("scenario", "Scenario", "".join(parts))


def differences(runs: "Sequence[ReportedRun]") -> str:
    """Return the keys in which the scenarios of several runs differ, with their values."""
    if len(runs) < 2:
        return ""
    try:
        found = differing_keys([run.record for run in runs])
    except InputError as error:
        return section("differences", "Differing keys", paragraph(str(error)))
    rows = [(name, *map(_cell, values)) for name, values in found.items()]
    if not rows:
        return section("differences", "Differing keys", paragraph("The scenarios are the same."))
    headings = ["key", *(run.label for run in runs)]
    caption = f"Keys in which the scenarios differ; {ABSENT} where there is none"
    return section("differences", "Differing keys", table(caption, headings, rows))


def _cell(value: Any) -> str:
    text = ABSENT if value is None else _value(value)
    return text if len(text) <= MAX_VALUE else f"{text[: MAX_VALUE - 3]}..."


def _value(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    return str(value).lower() if isinstance(value, bool) else str(value)


def origins(runs: "Sequence[ReportedRun]") -> str:
    """Return how the results were made: version, file, command, overrides."""
    names = [run.label if len(runs) > 1 else "value" for run in runs]
    asked = {
        "version of frictionsim": "frictionsim_version",
        "format version": "format_version",
        "scenario file": "source",
        "overrides": "overrides",
        "command": "command",
    }
    rows = [("result file", *("" if run.path is None else str(run.path) for run in runs))]
    for words, attribute in asked.items():
        values = [" ".join(run.attribute(attribute).split("\n")) for run in runs]
        if any(values):
            rows.append((words, *values))
    return section("origin", "How it was made", table("Origin", ["property", *names], rows))
