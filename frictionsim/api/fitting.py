"""Fits of free keys of a scenario to measured data from Python: fit and Fit."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frictionsim.api.result import Outcome, ResultBase
from frictionsim.api.scenarios import with_overrides
from frictionsim.display import number_text, ratio_text, set_line, study_text
from frictionsim.document import Data, Document, Table
from frictionsim.errors import EXIT_BUDGET_EXCEEDED, EXIT_DONE, EXIT_SOLVER_FAILED, counted
from frictionsim.fits.data import STARTS, FitOptions, measured
from frictionsim.fits.fit import fit as fit_problem
from frictionsim.fits.outcome import OUT_OF_REACH, FitOutcome, TargetResiduals, outcome_json
from frictionsim.fits.problem import FitProblem, check_runs, free_keys
from frictionsim.fits.search import MAX_ITERATIONS
from frictionsim.scenario.arguments import as_path
from frictionsim.scenario.loading import ScenarioSource
from frictionsim.scenario.settings import Scenario

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.scenario.overrides import Overrides

FITTED = "# Fitted by 'frictionsim fit'"
NO_INTERVAL = (None, None)

ColumnNames = str | Iterable[str] | Mapping[str, str | int]
"""Names that are those of their columns, too; or the column of each name."""


@dataclass(frozen=True, eq=False, repr=False)
class Fit(FitOutcome, ResultBase):
    """The fit of free keys of a scenario to measured data.

    Attributes
    ----------
    scenario : Scenario
        The scenario with the estimates.
    values : dict of float
        The estimates, by key.
    standard_errors : dict of float or None
        Their standard errors; None where they are not known.
    intervals : dict of (float, float) or None
        Their 95 % confidence intervals, which end at the bounds and at an edge of valid values;
        None where they are not known.
    correlations : dict of dict of float
        The correlations of the estimates, by key and key; nan where one is not identified.
    not_identified : dict of str
        Why the data do not determine a key, by key; empty if they determine all.
    finding : Finding
        The kind of estimate, in a sentence; of a single value its reachable range.
    residuals : tuple of TargetResiduals
        Data minus fit, of each channel or quantity.
    chi_squared : float or None
        Sum of the squared residuals over their sigma; None unless every sigma was given.
    degrees : int
        Of freedom: values minus the keys, or combinations of them, that the data determine.
    starts : list of dict
        The local searches by their costs: where each started and ended, and its cost, half the
        weighted sum of squares.
    bootstrap : Bootstrap or None
        Percentile intervals and all estimates of the bootstrap; None without one.
    runs : int
        Number of runs that were made.
    measured : Measured
        The data, in the units of the scenario.
    source : str
        Path of the scenario; empty if it has none.
    overrides : dict
        Overrides of the scenario, by key.
    """

    source: str = ""
    overrides: Mapping[str, Any] | None = None
    set_keys: str = ""  # the line of the summary with these overrides

    @property
    def _outcome(self) -> Outcome:
        code = EXIT_DONE if self.converged else EXIT_BUDGET_EXCEEDED
        code = EXIT_SOLVER_FAILED if self.finding.kind == OUT_OF_REACH else code
        if self.converged:
            return Outcome("done", "", code)
        return Outcome("stopped", f"limit of {MAX_ITERATIONS} iterations reached", code)

    def plot(self, *, figure: "Figure | SubFigure | None" = None) -> "Figure":
        """Draw data, fit and residuals.

        Parameters
        ----------
        figure : Figure or SubFigure, optional
            An empty one that is drawn into.
        """
        from frictionsim.plots.studies import fit_diagram

        return fit_diagram(self, figure=figure)

    def to_toml(self) -> str:
        """Return the fitted scenario as TOML, with comments on the keys and data of the fit."""
        names = ", ".join(part.name for part in self.residuals)
        of = f" from {Path(self.source).name}" if self.source else ""
        title = f"{FITTED}{of} to measured {names}: estimate, standard error"
        lines = [" ".join(title.split())]  # one line: names of files may hold anything
        for key in self.keys:
            error, why = self.standard_errors[key.key], self.not_identified.get(key.key)
            unit = f" {key.unit}" if key.unit not in ("", "1") else ""
            spread = "unknown" if error is None else f"{number_text(error, 3)}{unit}"
            spread = f"not identified: {why}" if why else spread
            lines.append(f"#   {key.key} = {study_text(self.values[key.key])}, {spread}")
        lines += [f"# {sentence}" for sentence in self.cut]
        for part in self.residuals:
            lines.append(f"# Residual of {part.name}: rms {number_text(part.rms, 3)} {part.unit}")
        if self.finding.kind == OUT_OF_REACH:
            lines.append(f"# {self.finding.sentence}")
        return "\n".join([*lines, "", self.scenario.to_toml()])

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

    @property
    def _writers(self) -> Mapping[str, Callable[[Path], Path]]:
        return {".toml": self.save_toml}

    @property
    def _fault(self) -> str:
        return self.reason or self.finding.sentence

    def _parts(self) -> Document:
        """Yield the estimates, their correlations and the residuals, and their data."""
        number = counted(sum(part.values.size for part in self.residuals), "value")
        fit = f"fit of {counted(len(self.keys), 'key')} to {number}"
        yield f"{self.scenario.title or Path(self.source).stem or self.scenario.kind}: {fit}"
        if self.set_keys:
            yield self.set_keys
        yield self._estimates()
        if len(self.keys) > 1:
            numbers = [f"({i})" for i in range(1, len(self.keys) + 1)]
            rows = zip(numbers, self.correlations.items(), strict=True)
            yield Table(
                ("correlation", *(f">{number}" for number in numbers)),
                [(f"{i} {key}", *map(ratio_text, row.values())) for i, (key, row) in rows],
            )
        yield Table(
            ("residual", ">values", ">rms", ">largest", ">sigma", "", "unit"),
            [
                (
                    part.name,
                    str(part.values.size),
                    *(number_text(number, 3) for number in (part.rms, part.largest, part.sigma)),
                    "given" if part.sigma_given else "estimated" * (part.sigma is not None),
                    part.unit,
                )
                for part in self.residuals
            ],
        )
        yield f"data: {', '.join(map(_read_as, self.residuals))}"
        if self.reduced_chi_squared is not None:
            yield (
                f"chi squared {number_text(self.chi_squared, 3)}, of"
                f" {counted(self.degrees, 'degree')} of freedom: reduced"
                f" {number_text(self.reduced_chi_squared, 3)} (near 1 if sigma is right)"
            )
        for key, why in self.not_identified.items():
            yield f"{key} is not identified: {why}"
        yield from self.cut
        also = f"; {self.finding.also}" if self.finding.also else ""
        ended = "" if self.converged else f"; {self.status}: {self.reason}"
        yield f"{self.finding.sentence}, in {counted(self.runs, 'run')}{also}{ended}"
        if drawn := self.bootstrap:
            failed = f", {drawn.failed} more did not end" if drawn.failed else ""
            yield f"bootstrap: {counted(drawn.done, 'fit')} to resampled data{failed}"
        given = {"scenario": self.source, "overrides": dict(self.overrides or {})}
        ending = {"status": self.status, "reason": self.reason}
        yield Data(given | {"kind": self.scenario.kind} | ending | outcome_json(self))

    def _estimates(self) -> Table:
        headings = ["key", ">estimate", ">standard error", ">95 % from", ">to"]
        headings += [">bootstrap from", ">to"] if self.bootstrap else []
        rows = []
        for key in self.keys:
            ends = [*(self.intervals[key.key] or NO_INTERVAL)]
            if self.bootstrap:
                ends += self.bootstrap.intervals[key.key] or NO_INTERVAL
            error = number_text(self.standard_errors[key.key], 3)
            estimate = study_text(self.values[key.key])
            rows.append((key.key, estimate, error, *map(study_text, ends), key.unit))
        return Table((*headings, "unit"), rows)

    def __repr__(self) -> str:
        values = ", ".join(f"{key}={study_text(value)}" for key, value in self.values.items())
        return f"<frictionsim.Fit {self.scenario.kind}: {self.status}, {values}>"


def _read_as(part: TargetResiduals) -> str:
    """Return the column and unit of the data of a channel or quantity."""
    column = "" if part.column is None else f" from '{part.column}'"
    if isinstance(part.column, int):
        column = f" from column {part.column}"
    unit = "" if part.data_unit in ("", "1") else f" in {part.data_unit}"
    return f"{part.name}{column}{unit}"


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
        Unit of the data of a channel or quantity, e.g. `deg/s`; by default that of the heading, or
        else its own.
    time : str or int, optional
        Column of the times; by default `time`, or the first column of a file.
    time_unit : str, optional
        Unit of the times; by default that of the heading, or s.
    time_offset : float, s
        Offset added to the times of the data.
    starts : int
        Number of local searches; 1 searches from the start value alone.
    seed : int
        Random seed of the scan for start values and of the bootstrap.
    bootstrap : int
        Number of bootstrap resamples for confidence intervals: 0, or at least 40.
    progress : callable, optional
        Called with the number of runs so far, after each and some times per second.

    Raises
    ------
    InputError, ScenarioError
        If the scenario, the data or an argument is not valid; before anything is fitted.
    SolverError
        If all runs fail.
    """
    options = FitOptions.among(locals())
    given = with_overrides(scenario, overrides)
    keys, its_data = free_keys(options.free, given), measured(options, given)
    check_runs(its_data, keys, given)
    runs = 0

    def on_runs(further: int) -> None:
        nonlocal runs
        before, runs = runs, runs + further
        if options.progress is not None:
            # Of no further ones the number is told again: the fit goes on.
            for number in range(before + 1, runs + 1) if further else [runs] * bool(runs):
                options.progress(number)

    found = fit_problem(FitProblem(given, keys, its_data, on_runs), options)
    origin = given.origin
    line = set_line({"overrides": "\n".join(origin.overrides)})
    return Fit(**vars(found), source=origin.source, overrides=origin.values, set_keys=line)
