"""Results of a fit as plain data: estimates, kind of minimum, residuals and warnings."""

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import counted
from frictionsim.fitting.problem import FitProblem, FreeKey, Model, residuals_of
from frictionsim.fitting.search import DISAGREE, Minimum, Start
from frictionsim.fitting.uncertainty import NO_CHANGE, Identification
from frictionsim.results import finite

if TYPE_CHECKING:
    from frictionsim.fitting.data import Measured
    from frictionsim.results import Array
    from frictionsim.scenario.settings import Scenario

DONE, STOPPED = "done", "stopped"
REACHED, OUT_OF_REACH, FLAT, PLATEAU = "reached", "out_of_reach", "flat", "plateau"
EQUAL_MINIMA, MINIMUM = "equal_minima", "minimum"
SIGNIFICANT = 4.0  # standard deviations
TOO_LARGE = 1e-2  # probability of a chi squared that chance exceeds
NUMBER = re.compile(r"-?\d[\d.]*(?:e[-+]?\d+)?")
UNLIKELY = 1e-3  # probability that chance makes one of many residuals so large
SAME = 1e-3  # relative difference of costs below which minima are equal
EXACT = 1e-12  # cost: rounding of data without noise
POOR = 1.1  # of the spread of the data: larger residuals are worse than those of a constant
ROUNDING = 1e-6  # of the data
APART = 1e-2  # of the bounds: ends of searches at different values
MAX_VALUES = 4  # in a sentence


class Finding(NamedTuple):
    """The kind of an estimate.

    `reached`: the fit gives the data exactly. `out_of_reach`: no run within the bounds gives the
    single value of the data. `flat`: the data do not change with any key. `plateau`: they do not
    change with any key near the estimate. `equal_minima`: several searches ended at different
    places with the same residual. Else `minimum`.
    """

    kind: str
    sentence: str
    reachable: tuple[float, float] | None = None  # by the runs of a fit to a single value


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
    starts: list[Start]  # by their costs
    warnings: tuple[str, ...]
    bootstrap: Bootstrap | None
    runs: int

    @property
    def reduced_chi_squared(self) -> float | None:
        """chi_squared over the degrees of freedom; None if either is missing."""
        if self.chi_squared is None or not self.degrees:
            return None
        return self.chi_squared / self.degrees


def outcome_json(outcome: FitOutcome, source: str, overrides: Mapping[str, Any]) -> dict[str, Any]:
    """Return the JSON object of a fit, with the overrides of keys that were not fitted."""
    bootstrap = outcome.bootstrap
    return {
        "scenario": source,
        "overrides": dict(overrides),
        "kind": outcome.fitted.kind,
        "status": outcome.status,
        "reason": outcome.reason,
        "finding": outcome.finding.kind,
        "sentence": outcome.finding.sentence,
        "reachable": None if outcome.finding.reachable is None else list(outcome.finding.reachable),
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
        "starts": [start._asdict() for start in outcome.starts],
        "bootstrap": None
        if bootstrap is None
        else {"done": bootstrap.done, "failed": bootstrap.failed},
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
        "interval": None if interval is None else list(interval),
        "bootstrap_interval": None if drawn is None else list(drawn),
        "unit": key.unit,
        "bounds": [key.low, key.high],
        "start": key.start,
        "not_identified": outcome.not_identified.get(name),
    }


def finding_of(
    problem: FitProblem, best: Minimum, starts: list[Start], identification: Identification
) -> Finding:
    """Return the kind of the estimate; the searches are sorted by cost."""
    names = " and ".join(key.key for key in problem.keys)
    still = all(identification.reasons.get(key.key) == NO_CHANGE for key in problem.keys)
    if still:  # a search that did not move has evaluated only the neighbourhood of its start
        for end in (0.0, 1.0):
            problem.model(np.full(len(problem.keys), end))
    flat = still and bool((problem.largest - problem.least <= problem.accuracy).all())
    reached = problem.is_exact(best.x)
    reachable = None
    if problem.data.size == 1:
        reachable = float(problem.least[0]), float(problem.largest[0])
        if not reached and _is_beyond_noise(problem, best):
            return Finding(OUT_OF_REACH, _out_of_reach(problem, best, names, flat), reachable)
    exactly = "the data are reached exactly; " if reached else ""
    if flat:
        sentence = f"flat: {exactly}the data do not change with {names} within the bounds"
        return Finding(FLAT, sentence, reachable)
    # Of data without noise the costs are roundings.
    least = starts[0].cost
    same = [start for start in starts if start.cost <= least * (1.0 + SAME) + EXACT]
    searches = f"{len(same)} of {len(starts)} {'search' if len(starts) == 1 else 'searches'}"
    places = _places(problem, same)
    if still:
        place = "on a plateau"
        if len(places) > 1:
            place = f"on plateaus with equal residuals{_place_list(problem, places)}"
        sentence = f"{exactly}{searches} ended {place}, where the data do not change with {names}"
        return Finding(PLATEAU, sentence, reachable)
    if len(places) > 1 and len(problem.keys) == 1:
        ends = _place_list(problem, places)
        sentence = (
            f"{exactly}{searches} ended with equal residuals{ends}: the data fit them as well"
        )
        return Finding(EQUAL_MINIMA, sentence, reachable)
    if reached:
        return Finding(REACHED, f"{searches} reached the data exactly", reachable)
    return Finding(MINIMUM, f"{searches} found this minimum", reachable)


def _is_beyond_noise(problem: FitProblem, best: Minimum) -> bool:
    """Return whether the residual of a single value exceeds the noise of its sigma, if given."""
    sigma = problem.data.targets[0].sigma
    noise = 0.0 if sigma is None else SIGNIFICANT * float(sigma[0])
    return abs(float(residuals_of(problem, best.x)[0])) > noise


def _out_of_reach(problem: FitProblem, best: Minimum, names: str, flat: bool) -> str:
    (target,) = problem.data.targets
    unit = problem.units[target.name]
    unit = f" {unit}" if unit not in ("", "1") else ""
    least, largest, wanted = problem.least[0], problem.largest[0], target.values[0]
    begin = f"out of reach: {target.name} = {wanted:.6g}{unit}"
    if flat:
        return f"{begin}; it is {least:.6g}{unit} whatever {names} is within the bounds"
    reachable = f"runs within the bounds gave {least:.6g} to {largest:.6g}{unit}"
    if best.jump is not None:
        below, above = best.jump
        value = problem.values(best.x)[names]
        jump = f"it jumps from {below:.6g} to {above:.6g}{unit} at {names} = {value:.6g}"
        return f"{begin}; {jump}; {reachable}"
    return f"{begin}; {reachable}"


def _places(problem: FitProblem, starts: list[Start]) -> list[dict[str, float]]:
    """Return the distinct ends of searches, as values by key."""
    places: list[dict[str, float]] = []
    for start in starts:
        if all(
            any(
                abs(k.scaled(start.last[k.key]) - k.scaled(other[k.key])) > APART
                for k in problem.keys
            )
            for other in places
        ):
            places.append(start.last)
    return places


def _place_list(problem: FitProblem, places: list[dict[str, float]]) -> str:
    """Return the values of a single key at some places."""
    if len(problem.keys) > 1:
        return " at different values"
    (key,) = problem.keys
    values = sorted(place[key.key] for place in places)
    more = ", ..." if len(values) > MAX_VALUES else ""
    return f" at {key.key} = {', '.join(f'{value:.6g}' for value in values[:MAX_VALUES])}{more}"


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


def derivative_warnings(
    keys: Sequence[FreeKey], differences: "Array", jumps: "Array", identification: Identification
) -> list[str]:
    """Return warnings about keys whose derivatives do not hold within a standard error.

    Differences and jumps are those of `Search.checked_jacobian`.
    """
    warnings = []
    for j, key in enumerate(keys):
        if np.isnan(identification.covariance[j, j]):  # there is no standard error
            continue
        if differences[j] > DISAGREE:
            warnings.append(
                f"the derivatives by {key.key} change by {100.0 * differences[j]:.0f} % with the"
                " step of their differences, as where events pass samples: its standard error is"
                " rough; a bootstrap does not need them"
            )
        elif 0.0 < jumps[j] < np.sqrt(identification.covariance[j, j]):
            warnings.append(
                f"the run jumps or kinks where {key.key} is less than its standard error from the"
                " estimate: that is rough; a bootstrap does not need derivatives"
            )
    return warnings


def residual_warnings(
    statistics: Sequence[TargetResiduals], chi: float | None, degrees: int
) -> list[str]:
    """Return warnings about residuals that noise of the given sigma does not explain.

    Chi squared is None unless every sigma was given.
    """
    alike = [_alike(part) for part in statistics if _is_alike(part)]
    return [
        *_poor(statistics),
        *alike,
        *(_chi_warning(statistics, chi, degrees) or _outliers(statistics)),
    ]


def _poor(statistics: Sequence[TargetResiduals]) -> Iterator[str]:
    """Yield warnings about series and curves that a constant fits better: often a wrong unit."""
    for part in statistics:
        data = part.values + part.fitted
        spread = max(float(np.std(data)), ROUNDING * float(np.max(np.abs(data))))
        if part.values.size > 1 and part.rms > POOR * spread > 0.0:  # zero of data that are all 0
            yield (
                f"the residuals of {part.name} are {part.rms / spread:.3g} times the spread of the"
                " data: a constant would fit these better; check the units of data and scenario"
            )


def _is_alike(part: TargetResiduals) -> bool:
    spread, near = float(np.std(part.values + part.fitted)), part.autocorrelation
    limit = SIGNIFICANT / np.sqrt(part.values.size)
    return near is not None and part.rms > 1e-6 * spread and near > limit


def _alike(part: TargetResiduals) -> str:
    return (
        f"neighbouring residuals of {part.name} are alike (correlation {part.autocorrelation:.2f}):"
        " the scenario lacks something that the data show, or their noise is not white; the"
        " standard errors are too small"
    )


def _chi_warning(
    statistics: Sequence[TargetResiduals], chi: float | None, degrees: int
) -> list[str]:
    """Return the warning that chi squared is too large; empty if it is not."""
    from scipy import special  # imported here: a fit alone needs it

    # A run that jumps may not reach as many values as keys exactly: there may be residuals without
    # degrees of freedom, too; their limit is that of one degree.
    limit = float(special.chdtri(max(degrees, 1), TOO_LARGE))
    if chi is None or chi <= limit:
        return []
    worst = max(statistics, key=lambda part: part.worst or 0.0)
    largest = f"{worst.worst:.3g} sigma, of {worst.name}"
    if not degrees:
        return [
            f"the residuals are up to {largest}, although there are as many free keys as values:"
            " the scenario cannot give the data, or sigma is too small"
        ]
    return [
        f"chi squared {chi:.3g} is above {limit:.3g}, which chance exceeds in 1 % of fits with"
        f" {counted(degrees, 'degree')} of freedom: the residuals are {np.sqrt(chi / degrees):.3g}"
        f" times as large as the sigma that was given (up to {largest}); the standard errors are"
        " too small"
    ]


def _outliers(statistics: Sequence[TargetResiduals]) -> list[str]:
    """Return warnings about channels and quantities with a residual too large for their sigma."""
    from scipy import special

    warnings = []
    for part in statistics:
        # Of many values one may be beyond 4 sigma by chance.
        limit = max(SIGNIFICANT, -float(special.ndtri(0.5 * UNLIKELY / part.values.size)))
        if part.worst is not None and part.worst > limit:
            warnings.append(
                f"the residuals of {part.name} are up to {part.worst:.3g} times their sigma: the"
                " scenario cannot give the data, or sigma is too small"
            )
    return warnings
