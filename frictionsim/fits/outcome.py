"""Results of a fit as plain data: estimates, finding, residuals and warnings."""

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import counted
from frictionsim.fits.problem import FitProblem, FreeKey, Model
from frictionsim.fits.search import Minimum
from frictionsim.results import finite

if TYPE_CHECKING:
    from frictionsim.fits.data import Measured
    from frictionsim.results import Array
    from frictionsim.scenario.settings import Scenario

DONE, STOPPED = "done", "stopped"
REACHED, OUT_OF_REACH, MINIMUM = "reached", "out_of_reach", "minimum"
SIGNIFICANT = 4.0  # standard deviations
TOO_LARGE = 1e-2  # probability of a chi squared that chance exceeds
NUMBER = re.compile(r"-?\d[\d.]*(?:e[-+]?\d+)?")
POOR = 1.1  # of the spread of the data: larger residuals are worse than those of a constant
ROUNDING = 1e-6  # of the data
MAX_MINIMA = 4  # in a sentence
NO_SCATTER = (
    "no standard error is known: there are as many values as free keys, which leave no scatter;"
    " give sigma"
)


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
    rms: float  # root mean square, in the unit
    largest: float  # magnitude
    sigma: float | None  # given (the mean of several) or estimated; None if it cannot be
    sigma_given: bool
    worst: float | None  # the largest magnitude over its sigma, where that was given
    autocorrelation: float | None  # of neighbours of a time series


class Bootstrap(NamedTuple):
    """Bootstrap resamples of a fit."""

    done: int  # fits that converged
    failed: int
    intervals: dict[str, tuple[float, float] | None]  # of 95 %; None if not identified
    values: "Array"  # (done, keys)


class FitOutcome(NamedTuple):
    """The values of a fit with their uncertainties.

    Standard errors, intervals and correlations of a key that is not identified are None or NaN;
    so are those of all keys if there are as many values as keys and no given sigma.
    """

    fitted: "Scenario"  # with the estimates
    keys: tuple[FreeKey, ...]
    data: "Measured"
    values: dict[str, float]  # the estimates
    standard_errors: dict[str, float | None]
    intervals: dict[str, tuple[float, float] | None]  # of 95 %
    correlations: "Array"  # (keys, keys)
    not_identified: dict[str, str]  # why, by key
    residuals: tuple[TargetResiduals, ...]
    chi_squared: float | None  # None unless every sigma was given
    degrees: int  # of freedom: values minus the rank of the derivatives
    status: str  # DONE, or STOPPED where the search reached its limit of iterations
    reason: str
    finding: Finding
    starts: list[dict[str, Any]]  # the local searches by their costs, see `start_of`
    warnings: tuple[str, ...]
    bootstrap: Bootstrap | None
    runs: int

    @property
    def reduced_chi_squared(self) -> float | None:
        """chi_squared over the degrees of freedom; None if either is missing."""
        if self.chi_squared is None or not self.degrees:
            return None
        return self.chi_squared / self.degrees


def start_of(problem: FitProblem, end: Minimum) -> dict[str, Any]:
    """Return where a local search started and ended, as values of the keys, and its costs.

    A cost is half the weighted sum of squares.
    """
    return {
        "first": problem.values(end.start),
        "last": problem.values(end.x),
        "first_cost": end.first_cost,
        "cost": end.cost,
        "converged": end.converged,
    }


def outcome_json(outcome: FitOutcome, source: str, overrides: Mapping[str, Any]) -> dict[str, Any]:
    """Return the JSON object of a fit, with the overrides of keys that were not fitted."""
    finding, bootstrap = outcome.finding, outcome.bootstrap
    return {
        "scenario": source,
        "overrides": dict(overrides),
        "kind": outcome.fitted.kind,
        "status": outcome.status,
        "reason": outcome.reason,
        "finding": finding.kind,
        "sentence": finding.sentence,
        "reachable": None if finding.reachable is None else list(finding.reachable),
        "other_minima": list(finding.other_minima),
        "keys": {key.key: _key_json(outcome, key) for key in outcome.keys},
        "correlations": [[finite(float(c)) for c in row] for row in outcome.correlations],
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
            for r in outcome.residuals
        },
        "chi_squared": finite(outcome.chi_squared),
        "reduced_chi_squared": finite(outcome.reduced_chi_squared),
        "degrees_of_freedom": outcome.degrees,
        "starts": outcome.starts,
        "bootstrap": bootstrap and {"done": bootstrap.done, "failed": bootstrap.failed},
        "runs": outcome.runs,
        "warnings": list(outcome.warnings),
    }


def _key_json(outcome: FitOutcome, key: FreeKey) -> dict[str, Any]:
    name, bootstrap = key.key, outcome.bootstrap
    interval = outcome.intervals[name]
    drawn = None if bootstrap is None else bootstrap.intervals[name]
    return {
        "value": outcome.values[name],
        "standard_error": outcome.standard_errors[name],
        "interval": interval and list(interval),
        "bootstrap_interval": drawn and list(drawn),
        "unit": key.unit,
        "bounds": [key.low, key.high],
        "start": key.start,
        "not_identified": outcome.not_identified.get(name),
    }


def finding_of(
    problem: FitProblem,
    best: Minimum,
    same: int,
    found: Sequence[Minimum],
    others: Sequence[dict[str, float]],
) -> Finding:
    """Return the kind of the estimate.

    Parameters
    ----------
    problem, best
    same : int
        Number of searches that ended there.
    found : sequence of Minimum
        The ends of all searches.
    others : sequence of dict
        Values of the keys at other minima within the noise.
    """
    reached = problem.is_exact(best.x)
    reachable = problem.reachable if problem.data.size == 1 else None
    searches = f"{len(found)} {'search' if len(found) == 1 else 'searches'}"
    if reachable and not reached and _is_beyond_noise(problem, best):
        return Finding(OUT_OF_REACH, _out_of_reach(problem, best, reachable), reachable)
    also = ""
    if others:
        places = (
            ", ".join(f"{key} = {value:.6g}" for key, value in place.items())
            for place in others[:MAX_MINIMA]
        )
        more = "; ..." if len(others) > MAX_MINIMA else ""
        also = f"the data fit as well, within their noise, at {'; at '.join(places)}{more}"
    if reached:
        number = sum(end.cost <= found[0].cost or problem.is_exact(end.x) for end in found)
        sentence = f"{number} of {searches} reached the data exactly"
        return Finding(REACHED, sentence, reachable, also, tuple(others))
    return Finding(
        MINIMUM, f"{same} of {searches} found this minimum", reachable, also, tuple(others)
    )


def _is_beyond_noise(problem: FitProblem, best: Minimum) -> bool:
    """Return whether the residual of a single value exceeds the noise of its sigma, if given."""
    sigma = problem.data.targets[0].sigma
    noise = 0.0 if sigma is None else SIGNIFICANT * float(sigma[0])
    return abs(float(problem.residuals(best.x)[0])) > noise


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


def run_warnings(model: Model, rows: int) -> list[str]:
    """Return the distinct warnings of the runs with the estimates, each with its number of rows.

    Warnings that differ only in their numbers count as one, with the numbers of the first row.
    """
    if rows == 1:
        return list(model.warnings)
    alike: dict[str, list[str]] = {}
    for text in model.warnings:
        alike.setdefault(NUMBER.sub("#", text), []).append(text)
    return [
        f"{texts[0]} ({sum(model.warnings[text] for text in texts)} of {rows} rows"
        f"{'; the numbers are of the first' if len(texts) > 1 else ''})"
        for texts in alike.values()
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
    if chi is not None:
        yield from _chi_warning(statistics, chi, degrees)


def _chi_warning(statistics: Sequence[TargetResiduals], chi: float, degrees: int) -> Iterator[str]:
    """Yield the warning that chi squared is too large, if it is."""
    from scipy import special  # imported here: a fit alone needs it

    # A run that jumps may not reach as many values as keys exactly: there may be residuals without
    # degrees of freedom, too; their limit is that of one degree.
    limit = float(special.chdtri(max(degrees, 1), TOO_LARGE))
    if chi <= limit:
        return
    worst = max(statistics, key=lambda part: part.worst or 0.0)
    largest = f"{worst.worst:.3g} sigma, of {worst.name}"
    if degrees:
        yield (
            f"chi squared {chi:.3g} is above {limit:.3g}, which chance exceeds in 1 % of fits with"
            f" {counted(degrees, 'degree')} of freedom: the residuals are"
            f" {np.sqrt(chi / degrees):.3g} times as large as the sigma that was given (up to"
            f" {largest}); the standard errors are too small"
        )
    else:
        yield (
            f"the residuals are up to {largest}, although there are as many free keys as values:"
            " the scenario cannot give the data, or sigma is too small"
        )
