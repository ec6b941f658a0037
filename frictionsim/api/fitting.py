"""Fits of free keys of a scenario to measured data from Python: fit and Fit."""

from collections.abc import Callable, Iterable, Mapping
from itertools import count
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frictionsim.api.result_base import Ending, ResultBase
from frictionsim.api.scenarios import with_overrides
from frictionsim.display import number_text, ratio_text, set_line, study_text
from frictionsim.document import Data, Document, Table
from frictionsim.errors import EXIT_BUDGET_EXCEEDED, EXIT_DONE, EXIT_SOLVER_FAILED, counted
from frictionsim.fits.data import STARTS, measured
from frictionsim.fits.data import FitOptions as FitOptions
from frictionsim.fits.fit import fit as fit_problem
from frictionsim.fits.outcome import (
    OUT_OF_REACH,
    Bootstrap,
    Finding,
    FitOutcome,
    TargetResiduals,
    outcome_json,
)
from frictionsim.fits.problem import FitProblem, check_runs, free_keys
from frictionsim.scenario.loading import ScenarioSource
from frictionsim.scenario.options import as_path
from frictionsim.scenario.settings import Origin, Scenario

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from frictionsim.scenario.overrides import Overrides

FITTED = "# Fitted by 'frictionsim fit'"
NO_INTERVAL = (None, None)


def fit_parts(outcome: "FitOutcome", overrides: str) -> Document:
    """Yield the estimates, their correlations, the residuals and the keys not identified.

    The line of the overrides of the scenario may be empty.
    """
    scenario = outcome.fitted
    values = sum(part.values.size for part in outcome.residuals)
    fit = f"fit of {counted(len(outcome.keys), 'key')} to {counted(values, 'value')}"
    yield f"{scenario.title or scenario.kind}: {fit}"
    if overrides:
        yield overrides
    yield _estimates(outcome)
    if len(outcome.keys) > 1:
        yield _correlations(outcome)
    yield _residuals(outcome)
    yield f"data: {', '.join(map(_read_as, outcome.residuals))}"
    if outcome.reduced_chi_squared is not None:
        chi_squared = number_text(outcome.chi_squared, 3)
        reduced = number_text(outcome.reduced_chi_squared, 3)
        yield (
            f"chi squared {chi_squared}, of {counted(outcome.degrees, 'degree')} of freedom:"
            f" reduced {reduced} (near 1 if sigma is right)"
        )
    for key, why in outcome.not_identified.items():
        yield f"{key} is not identified: {why}"
    yield _searches(outcome)
    if outcome.bootstrap is not None:
        failed = (
            f", {outcome.bootstrap.failed} more did not end" if outcome.bootstrap.failed else ""
        )
        yield f"bootstrap: {counted(outcome.bootstrap.done, 'fit')} to resampled data{failed}"


def _estimates(outcome: "FitOutcome") -> Table:
    drawn = outcome.bootstrap.intervals if outcome.bootstrap else None
    headings = ["key", ">estimate", ">standard error", ">95 % from", ">to"]
    headings += [">bootstrap from", ">to"] if drawn else []
    rows = []
    for key, value in outcome.values.items():
        error = number_text(outcome.standard_errors[key], 3)
        ends = [*(outcome.intervals[key] or NO_INTERVAL)]
        ends += (drawn[key] or NO_INTERVAL) if drawn else ()
        rows.append([key, study_text(value), error, *map(study_text, ends)])
    units = [key.unit for key in outcome.keys]
    return Table((*headings, "unit"), [(*row, u) for row, u in zip(rows, units, strict=True)])


def _correlations(outcome: "FitOutcome") -> Table:
    numbers = [f">({i})" for i in range(1, len(outcome.keys) + 1)]
    rows = [
        (f"({i}) {key.key}", *map(ratio_text, row))
        for i, (key, row) in enumerate(
            zip(outcome.keys, outcome.correlations, strict=True), start=1
        )
    ]
    return Table(("correlation", *numbers), rows)


def _residuals(outcome: "FitOutcome") -> Table:
    rows = [
        (
            part.name,
            str(part.values.size),
            number_text(part.rms, 3),
            number_text(part.largest, 3),
            number_text(part.sigma, 3),
            "given" if part.sigma_given else "estimated" if part.sigma is not None else "",
            part.unit,
        )
        for part in outcome.residuals
    ]
    return Table(("residual", ">values", ">rms", ">largest", ">sigma", "", "unit"), rows)


def _searches(outcome: "FitOutcome") -> str:
    ended = "" if outcome.status == "done" else f"; {outcome.status}: {outcome.reason}"
    also = f"; {outcome.finding.also}" if outcome.finding.also else ""
    return f"{outcome.finding.sentence}, in {counted(outcome.runs, 'run')}{also}{ended}"


def _read_as(part: "TargetResiduals") -> str:
    """Return the column and unit of the data of a channel or quantity."""
    column = "" if part.column is None else f" from '{part.column}'"
    if isinstance(part.column, int):
        column = f" from column {part.column}"
    unit = "" if part.data_unit in ("", "1") else f" in {part.data_unit}"
    return f"{part.name}{column}{unit}"


def toml_of(outcome: "FitOutcome", source: str) -> str:
    """Return the fitted scenario as TOML, with comments on the keys and data of the fit.

    Parameters
    ----------
    outcome : FitOutcome
    source : str
        Path of the scenario; empty if it has none.
    """
    names = ", ".join(part.name for part in outcome.residuals)
    of = f" from {Path(source).name}" if source else ""
    lines = [f"{FITTED}{of} to measured {names}: estimate, standard error"]
    for key in outcome.keys:
        error = outcome.standard_errors[key.key]
        why = outcome.not_identified.get(key.key)
        unit = f" {key.unit}" if key.unit not in ("", "1") else ""
        spread = "unknown" if error is None else f"{number_text(error, 3)}{unit}"
        spread = f"not identified: {why}" if why else spread
        lines.append(f"#   {key.key} = {study_text(outcome.values[key.key])}, {spread}")
    for part in outcome.residuals:
        lines.append(f"# Residual of {part.name}: rms {number_text(part.rms, 3)} {part.unit}")
    if outcome.finding.kind == OUT_OF_REACH:
        lines.append(f"# {outcome.finding.sentence}")
    # One line each: names of files may hold anything.
    comments = [" ".join(line.split()) if i == 0 else line for i, line in enumerate(lines)]
    return "\n".join([*comments, "", outcome.fitted.to_toml()])


ColumnNames = str | Iterable[str] | Mapping[str, str | int]
"""Names that are those of their columns, too; or the column of each name."""


class Fit(ResultBase):
    """The fit of free keys of a scenario to measured data.

    Attributes
    ----------
    data : frictionsim.fits.outcome.FitOutcome
        The fit as plain data.
    source : str
        Path of the scenario; empty if it has none.
    overrides : dict
        Overrides of the scenario, by key.
    """

    def __init__(self, data: FitOutcome, origin: Origin) -> None:
        self.data, self.source, self.overrides = data, origin.source, origin.values
        self._set_line = set_line({"overrides": "\n".join(origin.overrides)})

    @property
    def values(self) -> dict[str, float]:
        """The estimates, by key."""
        return self.data.values

    @property
    def standard_errors(self) -> dict[str, float | None]:
        """Their standard errors; None where they are not known."""
        return self.data.standard_errors

    @property
    def intervals(self) -> dict[str, tuple[float, float] | None]:
        """Their 95 % confidence intervals; None where they are not known."""
        return self.data.intervals

    @property
    def correlations(self) -> dict[str, dict[str, float]]:
        """The correlations of the estimates, by key and key; nan where one is not identified."""
        names, table = list(self.data.values), self.data.correlations
        return {
            name: dict(zip(names, map(float, row), strict=True))
            for name, row in zip(names, table, strict=True)
        }

    @property
    def not_identified(self) -> dict[str, str]:
        """Why the data do not determine a key, by key; empty if they determine all."""
        return self.data.not_identified

    @property
    def residual_rms(self) -> dict[str, float]:
        """Root mean square of data minus fit, by channel or quantity, in its unit."""
        return {part.name: part.rms for part in self.data.residuals}

    @property
    def chi_squared(self) -> float | None:
        """Sum of the squared residuals over their sigma; None unless every sigma was given."""
        return self.data.chi_squared

    @property
    def reduced_chi_squared(self) -> float | None:
        """chi_squared over the degrees of freedom: about 1 if scenario and sigma are right."""
        return self.data.reduced_chi_squared

    @property
    def starts(self) -> list[dict[str, Any]]:
        """The local searches by their costs: where each started and ended, and its cost."""
        return self.data.starts

    @property
    def bootstrap(self) -> Bootstrap | None:
        """Percentile intervals and all estimates of the bootstrap; None without one."""
        return self.data.bootstrap

    @property
    def scenario(self) -> Scenario:
        """The scenario with the estimates."""
        return self.data.fitted

    @property
    def _ending(self) -> Ending:
        code = EXIT_DONE if self.data.status == "done" else EXIT_BUDGET_EXCEEDED
        if self.finding.kind == OUT_OF_REACH:
            code = EXIT_SOLVER_FAILED
        return Ending(self.data.status, self.data.reason, code)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Reasons to doubt the estimates or their standard errors."""
        unidentified = (
            f"{key} is not identified: {why}" for key, why in self.data.not_identified.items()
        )
        return (*unidentified, *self.data.warnings)

    @property
    def finding(self) -> Finding:
        """The kind of estimate, in a sentence; of a single value its reachable range."""
        return self.data.finding

    def plot(self, *, ax: "Axes | None" = None) -> "Figure":
        """Draw data, fit and residuals.

        Parameters
        ----------
        ax : Axes, optional
            Draw in the place of these axes, which are removed.
        """
        from frictionsim.plots.studies import fit_diagram

        return fit_diagram(self.data, ax=ax)

    def to_toml(self) -> str:
        """Return the fitted scenario as TOML, with comments on the keys and data of the fit."""
        return toml_of(self.data, self.source)

    def save_toml(self, path: str | PathLike[str]) -> Path:
        """Write the fitted scenario as TOML; an existing file is not replaced.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        from frictionsim.io.output_file import SCENARIO, write_new

        target = as_path("path", path)
        write_new(target, self.to_toml(), SCENARIO)
        return target

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the fitted scenario (.toml, a new file) or the picture (.png, .pdf, .svg)."""
        target = as_path("path", path)
        return self.save_toml(target) if target.suffix == ".toml" else self.save_picture(target)

    def parts(self) -> Document:
        """Yield the estimates, their correlations and the residuals, and their data."""
        yield from fit_parts(self.data, self._set_line)
        yield Data(outcome_json(self.data, self.source, self.overrides))

    def __repr__(self) -> str:
        values = ", ".join(f"{key}={study_text(value)}" for key, value in self.values.items())
        return f"<frictionsim.Fit {self.scenario.kind}: {self.status}, {values}>"


def fit(
    scenario: Scenario | ScenarioSource,
    overrides: "Overrides | None" = None,
    *,
    data: Any = None,
    channels: ColumnNames = (),
    quantities: str | Iterable[str] | Mapping[str, str | int | float] = (),
    over: ColumnNames = (),
    free: Mapping[str, Any] | Iterable[str],
    sigma: Mapping[str, float | str] | Iterable[str] | None = None,
    units: Mapping[str, str] | Iterable[str] | None = None,
    time: str | int | None = None,
    time_unit: str | None = None,
    time_offset: float = 0.0,
    starts: int = STARTS,
    seed: int = 0,
    bootstrap: int = 0,
    progress: Callable[[int], Any] | None = None,
) -> Fit:
    """Fit free keys of a scenario to measured data by least squares within bounds.

    Parameters
    ----------
    scenario, overrides
        As for `solve`.
    data : path or mapping of arrays, optional
        A CSV file, a dict of arrays, a pandas.DataFrame or an xarray.Dataset. A value that is NaN,
        or an empty cell, was not measured.
    channels : str, iterable of str or mapping
        The channels that were measured over time; a mapping, or texts NAME=COLUMN, give the column
        of each.
    quantities : mapping, or texts NAME=VALUE
        The measured value of each quantity of one run; with `over` its column, as for `channels`.
    over : str, iterable of str or mapping
        Keys set by each row of the data, one run per row; a mapping, or texts KEY=COLUMN, give the
        column of each.
    free : mapping, or texts KEY=LOW:HIGH[:START]
        Bounds (low, high), or (low, high, start), of each key to be fitted. The default start is
        the scenario's value, or the middle. Several keys with commas between them have one value.
    sigma : mapping, or texts NAME=VALUE, optional
        Standard deviation of a channel or quantity, in the unit of the data, or the name of its
        column; by default it is estimated from the scatter about the fit.
    units : mapping, or texts NAME=UNIT, optional
        Unit of the data of a channel or quantity, e.g. `deg/s`; by default its own unit.
    time : str or int, optional
        Column of the times; by default `time`, or the first column of a file.
    time_unit : str, optional
        Unit of the times, by default s.
    time_offset : float, s
        Offset added to the times of the data.
    starts : int
        Number of local searches; 1 searches from the start value alone.
    seed : int
        Random seed of the scan for start values and of the bootstrap.
    bootstrap : int
        Number of bootstrap resamples for confidence intervals.
    progress : callable, optional
        Called with the number of runs so far.

    Raises
    ------
    InputError, ScenarioError
        If the scenario, the data or an argument is not valid; before anything is fitted.
    SolverError
        If all runs fail.
    """
    options = FitOptions.among(locals())
    return fit_with(with_overrides(scenario, overrides), options)


def fit_with(scenario: Scenario, options: FitOptions) -> Fit:
    """Fit free keys of a scenario."""
    keys = free_keys(options.free, scenario)
    data = measured(options, scenario)
    check_runs(data, keys, scenario)
    runs, progress = count(1), options.progress or (lambda runs: None)

    def on_runs(further: int) -> None:
        for _ in range(further):
            progress(next(runs))

    problem = FitProblem(scenario, keys, data, on_runs)
    return Fit(fit_problem(problem, options), scenario.origin)
