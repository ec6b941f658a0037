"""The tables of a fit, and the fitted scenario as TOML."""

from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING

from frictionsim.api.tables import Cells, Parts
from frictionsim.errors import counted
from frictionsim.parameter_study.fit_outcome import OUT_OF_REACH

if TYPE_CHECKING:
    from frictionsim.parameter_study.fit_outcome import Outcome, TargetResiduals

DIGITS = 6
FITTED = "# Fitted by 'frictionsim fit'"


def fit_parts(found: "Outcome") -> Parts:
    """Yield the estimates, their correlations, the residuals and what is not identified."""
    scenario = found.fitted
    values = sum(part.values.size for part in found.residuals)
    fit = f"fit of {counted(len(found.keys), 'key')} to {counted(values, 'value')}"
    yield f"{scenario.title or scenario.kind}: {fit}"
    yield _estimates(found)
    if len(found.keys) > 1:
        yield _correlations(found)
    yield _residuals(found)
    yield f"data: {', '.join(map(_read_as, found.residuals))}"
    if found.reduced_chi_squared is not None:
        yield (
            f"chi squared {_short(found.chi_squared)}, of {counted(found.degrees, 'degree')} of"
            f" freedom: reduced {_short(found.reduced_chi_squared)} (near 1 if sigma is right)"
        )
    for key, why in found.not_identified.items():
        yield f"{key} is not identified: {why}"
    yield _searches(found)
    if found.bootstrap is not None:
        failed = f", {found.bootstrap.failed} more did not end" if found.bootstrap.failed else ""
        yield f"bootstrap: {counted(found.bootstrap.done, 'fit')} to data drawn anew{failed}"


def _estimates(found: "Outcome") -> Cells:
    bootstrap = found.bootstrap
    drawn = (">bootstrap from", ">to") if bootstrap else ()
    headings = ("key", ">estimate", ">standard error", ">95 % from", ">to", *drawn, "unit")
    rows = []
    for key in found.keys:
        name = key.key
        cells = [name, _number(found.values[name]), _short(found.standard_errors[name])]
        cells += _pair(found.intervals[name])
        if bootstrap is not None:
            cells += _pair(bootstrap.intervals[name])
        rows.append((*cells, key.unit))
    return Cells(headings, rows)


def _correlations(found: "Outcome") -> Cells:
    numbers = [f">({i})" for i in range(1, len(found.keys) + 1)]
    rows = [
        (f"({i}) {key.key}", *("none" if isnan(c) else f"{c:.3f}" for c in row))
        for i, (key, row) in enumerate(zip(found.keys, found.correlations, strict=True), start=1)
    ]
    return Cells(("correlation", *numbers), rows)


def _residuals(found: "Outcome") -> Cells:
    rows = [
        (
            part.name,
            str(part.values.size),
            _short(part.rms),
            _short(part.largest),
            _short(part.sigma),
            "given" if part.sigma_given else "estimated" if part.sigma is not None else "",
            part.unit,
        )
        for part in found.residuals
    ]
    return Cells(("residual", ">values", ">rms", ">largest", ">sigma", "", "unit"), rows)


def _searches(found: "Outcome") -> str:
    ended = "" if found.status == "done" else f"; {found.status}: {found.reason}"
    return f"{found.finding.sentence}, in {counted(found.runs, 'run')}{ended}"


def _read_as(part: "TargetResiduals") -> str:
    """Return from which column the data of a channel or quantity were read, and in which unit."""
    column = "" if part.column is None else f" from '{part.column}'"
    if isinstance(part.column, int):
        column = f" from column {part.column}"
    unit = "" if part.data_unit in ("", "1") else f" in {part.data_unit}"
    return f"{part.name}{column}{unit}"


def _pair(interval: tuple[float, float] | None) -> list[str]:
    return ["none", "none"] if interval is None else [_number(end) for end in interval]


def _number(value: float) -> str:
    return f"{value:.{DIGITS}g}"


def _short(value: float | None) -> str:
    return "none" if value is None else f"{value:.3g}"


def toml_of(found: "Outcome", source: str) -> str:
    """Return the fitted scenario as TOML, with comments that say what was fitted to what.

    Parameters
    ----------
    found : Outcome
    source : str
        Path of the scenario; empty if it is of no file.
    """
    names = ", ".join(part.name for part in found.residuals)
    of = f" from {Path(source).name}" if source else ""
    lines = [f"{FITTED}{of} to measured {names}: estimate, standard error"]
    for key in found.keys:
        error = found.standard_errors[key.key]
        why = found.not_identified.get(key.key)
        spread = f"not identified: {why}" if why else _short(error)
        unit = f" {key.unit}" if key.unit not in ("", "1") else ""
        lines.append(
            f"#   {key.key} = {_number(found.values[key.key])}, {spread}{'' if why else unit}"
        )
    for part in found.residuals:
        lines.append(f"# Residual of {part.name}: rms {_short(part.rms)} {part.unit}")
    if found.finding.kind == OUT_OF_REACH:
        lines.append(f"# {found.finding.sentence}")
    # One line each: names of files may hold anything.
    comments = [" ".join(line.split()) if i == 0 else line for i, line in enumerate(lines)]
    return "\n".join([*comments, "", found.fitted.to_toml()])
