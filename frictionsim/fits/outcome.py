"""A fit as plain data: estimates, finding, residuals and warnings."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import counted
from frictionsim.fits.problem import FitProblem, FreeKey
from frictionsim.fits.search import Minimum
from frictionsim.results import finite
from frictionsim.sweeps.statistics import grouped

if TYPE_CHECKING:
    from frictionsim.fits.data import Measured
    from frictionsim.results import Array
    from frictionsim.scenario.settings import Scenario

REACHED, OUT_OF_REACH, MINIMUM = "reached", "out_of_reach", "minimum"
SIGNIFICANT = 4.0  # standard deviations
TOO_LARGE = 1e-2  # probability of a chi squared that chance exceeds
POOR = 1.1  # of the spread of the data: larger residuals are worse than those of a constant
ROUNDING = 1e-6  # of the data
MAX_MINIMA = 4  # in a sentence


class Finding(NamedTuple):
    """The kind of an estimate.

    `reached`: the fit gives the data exactly. `out_of_reach`: no run within the bounds gives the
    single value of the data. Else `minimum`.
    """

    kind: str
    sentence: str
    reachable: tuple[float, float] | None = None  # by the runs of a fit to a single value
    also: str = ""  # a sentence on other minima that fit the data as well, within their noise
    other_minima: tuple[dict[str, float], ...] = ()  # the values of the keys there


class TargetResiduals(NamedTuple):
    """The residuals of a channel or quantity: data minus fit."""

    name: str
    unit: str
    column: str | int | None  # of the data; None for a value given directly
    data_unit: str  # unit of the data as read
    values: "Array"
    fitted: "Array"  # values of the fitted scenario
    sigma: float | None  # given (the mean of several) or estimated; None if it cannot be
    sigma_given: bool
    worst: float | None  # the largest magnitude over its sigma, where that was given
    autocorrelation: float | None  # of neighbours of a time series

    @property
    def rms(self) -> float:
        """Root mean square, in the unit."""
        return float(np.sqrt(np.mean(self.values**2)))

    @property
    def largest(self) -> float:
        """The largest magnitude, in the unit."""
        return float(np.max(np.abs(self.values)))


class Bootstrap(NamedTuple):
    """Bootstrap resamples of a fit."""

    done: int  # fits that converged
    failed: int
    intervals: dict[str, tuple[float, float] | None]  # of 95 %; None if not identified
    values: "Array"  # (done, keys)


@dataclass(frozen=True, eq=False, repr=False)
class FitOutcome:
    """A fit of free keys to measured data. `frictionsim.Fit` describes what users read."""

    scenario: "Scenario"
    keys: tuple[FreeKey, ...]
    measured: "Measured"
    values: dict[str, float]
    standard_errors: dict[str, float | None]
    intervals: dict[str, tuple[float, float] | None]
    correlations: dict[str, dict[str, float]]
    not_identified: dict[str, str]
    cut: tuple[str, ...]  # sentences on intervals that end at a bound or an edge of valid values
    residuals: tuple[TargetResiduals, ...]
    chi_squared: float | None
    degrees: int
    converged: bool
    finding: Finding
    starts: list[dict[str, Any]]
    doubts: tuple[str, ...]  # further warnings
    bootstrap: Bootstrap | None
    runs: int

    @property
    def reduced_chi_squared(self) -> float | None:
        """chi_squared over the degrees of freedom: about 1 if scenario and sigma are right."""
        if self.chi_squared is None or not self.degrees:
            return None
        return self.chi_squared / self.degrees

    @property
    def residual_rms(self) -> dict[str, float]:
        """Root mean square of data minus fit, by channel or quantity, in its unit."""
        return {part.name: part.rms for part in self.residuals}

    @property
    def warnings(self) -> tuple[str, ...]:
        """Reasons to doubt the estimates or their standard errors."""
        unidentified = (
            f"{key} is not identified: {why}" for key, why in self.not_identified.items()
        )
        return (*unidentified, *self.cut, *self.doubts)


def outcome_json(fit: FitOutcome) -> dict[str, Any]:
    """Return the numbers of a fit as a JSON object."""
    finding, drawn = fit.finding, fit.bootstrap
    return {
        "finding": finding.kind,
        "sentence": finding.sentence,
        "reachable": finding.reachable and list(finding.reachable),
        "other_minima": list(finding.other_minima),
        "keys": {
            key.key: {
                "value": fit.values[key.key],
                "standard_error": fit.standard_errors[key.key],
                "interval": _list(fit.intervals[key.key]),
                "bootstrap_interval": _list(drawn and drawn.intervals[key.key]),
                "unit": key.unit,
                "bounds": [key.low, key.high],
                "start": key.start,
                "not_identified": fit.not_identified.get(key.key),
            }
            for key in fit.keys
        },
        "correlations": [[*map(finite, row.values())] for row in fit.correlations.values()],
        "residuals": {
            r.name: {
                "unit": r.unit,
                "column": r.column,
                "data_unit": r.data_unit,
                "count": int(r.values.size),
                "rms": finite(r.rms),
                "largest": finite(r.largest),
                "sigma": finite(r.sigma),
                "sigma_given": r.sigma_given,
                "autocorrelation": finite(r.autocorrelation),
            }
            for r in fit.residuals
        },
        "chi_squared": finite(fit.chi_squared),
        "reduced_chi_squared": finite(fit.reduced_chi_squared),
        "degrees_of_freedom": fit.degrees,
        "starts": fit.starts,
        "bootstrap": drawn and {"done": drawn.done, "failed": drawn.failed},
        "runs": fit.runs,
        "warnings": [*fit.cut, *fit.doubts],
    }


def _list(interval: tuple[float, float] | None) -> list[float] | None:
    return None if interval is None else list(interval)


def finding_of(
    problem: FitProblem, best: Minimum, found: Sequence[Minimum], same: int, others: list[Minimum]
) -> Finding:
    """Return the kind of an estimate.

    `found` are the ends of all searches by their costs, of which as many as `same` are at the best
    minimum; the others are within the noise.
    """
    reached = problem.is_exact(best.x)
    reachable = problem.reachable if problem.data.size == 1 else None
    if reachable and not reached:
        sigma = problem.data.targets[0].sigma
        noise = 0.0 if sigma is None else SIGNIFICANT * float(sigma[0])
        if abs(float(problem.residuals(best.x)[0])) > noise:
            return Finding(OUT_OF_REACH, _out_of_reach(problem, best, reachable), reachable)
    also, values = "", tuple(problem.values(other.x) for other in others)
    if others:
        places = (
            ", ".join(f"{key} = {value:.6g}" for key, value in place.items())
            for place in values[:MAX_MINIMA]
        )
        more = "; ..." if len(others) > MAX_MINIMA else ""
        also = f"the data fit as well, within their noise, at {'; at '.join(places)}{more}"
    searches = f"{len(found)} {'search' if len(found) == 1 else 'searches'}"
    kind, sentence = MINIMUM, f"{same} of {searches} found this minimum"
    if reached:
        number = sum(end.cost <= found[0].cost or problem.is_exact(end.x) for end in found)
        kind, sentence = REACHED, f"{number} of {searches} reached the data exactly"
    return Finding(kind, sentence, reachable, also, values)


def _out_of_reach(problem: FitProblem, best: Minimum, reachable: tuple[float, float]) -> str:
    (target,) = problem.data.targets
    unit = problem.units[target.name]
    unit = f" {unit}" if unit not in ("", "1") else ""
    jump = ""
    if best.jump is not None:
        below, above = best.jump
        ((key, value),) = problem.values(best.x).items()
        jump = f"it jumps from {below:.6g} to {above:.6g}{unit} at {key} = {value:.6g}; "
    # Equal ends, where the key changes nothing, are one.
    gave = " to ".join(dict.fromkeys(f"{end:.6g}" for end in reachable))
    return (
        f"out of reach: {target.name} = {target.values[0]:.6g}{unit}; {jump}runs within the bounds"
        f" gave {gave}{unit}"
    )


def run_warnings(texts: Sequence[str], rows: int) -> Sequence[str]:
    """Return the warnings of the runs with the estimates; those of several rows by their kinds."""
    if rows == 1:
        return texts
    return [
        f"{group.text} ({group.runs} of {rows} rows; the numbers are of the first)"
        for group in grouped(dict(enumerate(texts)))
    ]


def residual_warnings(
    statistics: Sequence[TargetResiduals], chi: float | None, degrees: int
) -> Iterator[str]:
    """Yield warnings about residuals that noise does not explain.

    They are worse than those of a constant, often because of a wrong unit; neighbours in time are
    alike; or they are too large for the sigma that was given. Chi squared is None unless every
    sigma was given.
    """
    for part in statistics:
        data = part.values + part.fitted
        spread = max(float(np.std(data)), ROUNDING * float(np.max(np.abs(data))))
        if part.values.size > 1 and part.rms > POOR * spread > 0.0:  # zero of data that are all 0
            yield (
                f"the residuals of {part.name} are {part.rms / spread:.3g} times the spread of the"
                " data: a constant would fit these better; check the units of data and scenario"
            )
        near, limit = part.autocorrelation, SIGNIFICANT / np.sqrt(part.values.size)
        if near is not None and near > limit and part.rms > ROUNDING * float(np.std(data)):
            yield (
                f"neighbouring residuals of {part.name} are alike (correlation {near:.2f}): the"
                " scenario lacks something that the data show, or their noise is not white; the"
                " standard errors are too small"
            )
    if chi is None:
        return
    from scipy import special  # imported here: a fit alone needs it

    # A run that jumps may miss as many values as keys, too: without degrees the limit is that of 1.
    limit = float(special.chdtri(max(degrees, 1), TOO_LARGE))
    if chi > limit:
        worst = max(statistics, key=lambda part: part.worst or 0.0)
        yield (
            f"chi squared {chi:.3g} with {counted(degrees, 'degree')} of freedom is above"
            f" {limit:.3g}, which chance exceeds in 1 % of fits: the residuals are up to"
            f" {worst.worst:.3g} sigma, of {worst.name}; the scenario lacks something that the data"
            " show, or sigma is too small, and so are the standard errors"
        )
