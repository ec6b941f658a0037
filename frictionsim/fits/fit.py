"""The fit of free keys of a scenario to measured data: search, noise, uncertainty, bootstrap.

Residuals are divided by the standard deviation of the data. A given one is used unchanged, and the
standard errors follow from it. Otherwise that of each channel or quantity is estimated from its
residuals; with several of them the fit is repeated with these weights until they converge
(iterated weighted least squares).

The bootstrap gives intervals from fits to resampled data, without linearisation.
"""

from typing import TYPE_CHECKING

import numpy as np

from frictionsim.errors import ArgumentError, counted
from frictionsim.fits.data import MIN_RESAMPLES, FitOptions
from frictionsim.fits.outcome import (
    OUT_OF_REACH,
    Bootstrap,
    FitOutcome,
    TargetResiduals,
    finding_of,
    residual_warnings,
    run_warnings,
)
from frictionsim.fits.problem import FitProblem
from frictionsim.fits.search import (
    AT_EDGE,
    Minimum,
    Search,
    checked_derivatives,
    minima,
    search,
)
from frictionsim.fits.uncertainty import (
    JUMP,
    JUMPS,
    NO_BETTER,
    NO_CHANGE,
    NOT_REACHED,
    SIDES,
    Identification,
    Noise,
    autocorrelation,
    identify,
    misfit_of_noise,
)
from frictionsim.scenario.model_fields import expanded

if TYPE_CHECKING:
    from frictionsim.results import Array

REWEIGHTED = 20  # times at most
SAME_NOISE = 1e-3  # relative change of the estimated standard deviations
SAME_COST = 1e-9  # relative
MIN_SERIES = 20  # values, for a meaningful correlation of neighbours
DIFFERENT_ENDS = 1e-2  # of the bounds: least distance of ends of searches
SAME = 1e-3  # relative difference of costs below which minima are equal
ROUNDED = 1e-12  # cost of the rounding of data without noise, in units of their spread
NO_SCATTER = (
    "no standard error is known: there are as many values as free keys, which leave no scatter;"
    " give sigma"
)


def fit(problem: FitProblem, options: FitOptions) -> FitOutcome:
    """Fit the free keys of a problem."""
    _check(problem)
    data, keys, noise = problem.data, problem.keys, Noise(problem.data.targets)
    found = search(problem, 1.0 / noise.sigma, options.starts, options.seed)
    if noise.is_to_be_balanced:
        found = _reweighed(problem, noise, found)
    best, known = _identified(problem, noise, found[0])
    degrees = data.size - known.rank
    has_noise = noise.all_given or degrees > 0
    of_noise = None if noise.all_given else degrees
    limit = misfit_of_noise(len(keys), of_noise) if has_noise else -np.inf
    factor = float(np.sqrt(misfit_of_noise(1, of_noise))) if has_noise else np.nan
    half_widths = factor * known.deviations
    wide = {key.key: NO_BETTER for key, half in zip(keys, half_widths, strict=True) if half > 1.0}
    known = known.without(keys, wide)
    cut: list[str] = []
    drawn = None
    if options.bootstrap:
        drawn = _bootstrap(problem, noise, best, has_noise, known, options, cut)
    known = known.without(keys, known.rough)
    if not has_noise:
        known = known._replace(covariance=np.full_like(known.covariance, np.nan))
    names = [key.key for key in keys]
    errors: dict[str, float | None] = dict.fromkeys(names)
    intervals: dict[str, tuple[float, float] | None] = dict.fromkeys(names)
    for j in np.flatnonzero(np.isfinite(known.deviations)).tolist():
        key, x, deviation = keys[j], float(best.x[j]), float(known.deviations[j])
        errors[key.key] = deviation * key.derivative(x)
        ends = x - factor * deviation, x + factor * deviation
        intervals[key.key] = _within_edges(problem, best.x, j, ends, "95 %", cut)
    same, others = _grouped(problem, 1.0 / noise.sigma, best, found, limit)
    finding = finding_of(problem, best, found, same, others)
    reasons = known.reasons
    if finding.kind == OUT_OF_REACH and len({*(finding.reachable or ())}) > 1:
        # The nearest run is at an extremum, where the data do change with the key, to second order.
        reasons = {k: NOT_REACHED if why == NO_CHANGE else why for k, why in reasons.items()}
    residuals = _residuals(problem, noise, best, degrees)
    chi = float(np.sum((problem.residuals(best.x) / noise.sigma) ** 2)) if noise.all_given else None
    model, values = problem.model(best.x), problem.values(best.x)
    return FitOutcome(
        scenario=problem.scenario.replace(expanded(values)),
        keys=keys,
        measured=data,
        values=values,
        standard_errors=errors,
        intervals=intervals,
        correlations={
            name: dict(zip(names, row, strict=True))
            for name, row in zip(names, known.correlations.tolist(), strict=True)
        },
        not_identified=reasons,
        cut=tuple(cut),
        residuals=residuals,
        chi_squared=chi,
        degrees=degrees,
        converged=best.converged,
        finding=finding,
        starts=[
            {
                "first": problem.values(end.start),
                "last": problem.values(end.x),
                "first_cost": end.first_cost,
                "cost": end.cost,
                "converged": end.converged,
            }
            for end in found
        ],
        doubts=(
            *([] if has_noise else [NO_SCATTER]),
            *([finding.sentence] if finding.kind == OUT_OF_REACH else []),
            *([finding.also] if finding.also else []),
            *([f"self-audit of the fitted run failed: {model.doubt}"] if model.doubt else []),
            *run_warnings(model.warnings, len(data.runs)),
            *residual_warnings(residuals, chi, degrees),
        ),
        bootstrap=drawn,
        runs=problem.runs,
    )


def _check(problem: FitProblem) -> None:
    data, keys = problem.data, problem.keys
    if data.size < len(keys):
        raise ArgumentError(
            "data",
            f"{counted(data.size, 'value')} cannot determine {len(keys)} free keys; give more data",
        )
    quantities = [] if data.over else [t for t in data.targets if t.kind == "quantity"]
    single = [target.name for target in quantities if target.sigma is None]
    if single and any(target.kind == "channel" for target in data.targets):
        raise ArgumentError(
            "sigma",
            f"the quantity {single[0]} beside channels needs a standard deviation, as"
            f" {single[0]}=0.01",
        )


def _reweighed(problem: FitProblem, noise: Noise, found: list[Minimum]) -> list[Minimum]:
    """Return all minima, by their costs, weighted by the noise estimated at the best one."""
    for _ in range(REWEIGHTED):
        if noise.estimate(problem.residuals(found[0].x), len(problem.keys)) < SAME_NOISE:
            break
        weights = 1.0 / noise.sigma
        ends = zip(found, minima([Search(problem, weights, end.x) for end in found]), strict=True)
        found = [
            end._replace(start=old.start, first_cost=problem.cost(old.start, weights))
            for old, end in ends
        ]
        found.sort(key=lambda end: end.cost)
    return found


def _identified(problem: FitProblem, noise: Noise, best: Minimum) -> tuple[Minimum, Identification]:
    """Return the minimum and the keys identified there.

    Keys that nothing changes with have their starts, if this is no worse.
    """
    keys, sigma = problem.keys, noise.sigma.copy()
    jacobian, changes = checked_derivatives(problem, best.x, sigma)
    first, x = identify(problem, best.x, jacobian, noise.spread / sigma), best.x.copy()
    for j, key in enumerate(keys):
        if first.reasons.get(key.key) == NO_CHANGE:
            x[j] = key.scaled(key.start)
    if problem.cost(x, 1.0 / sigma) <= best.cost * (1.0 + SAME_COST):
        best = best._replace(x=x)
    # The rank gives the degrees of freedom, and these the noise.
    noise.estimate(problem.residuals(best.x), first.rank)
    scaled = jacobian * (sigma / noise.sigma)[:, None]
    known = identify(problem, best.x, scaled, noise.spread / noise.sigma)
    rough = {key.key: JUMP for key, change in zip(keys, changes, strict=True) if change > JUMPS}
    return best, known._replace(rough=rough)


def _within_edges(
    problem: FitProblem, x: "Array", j: int, ends: tuple[float, float], what: str, cut: list[str]
) -> tuple[float, float]:
    """Return an interval of a key, given by places, as far as there are runs.

    A sentence is added to `cut` where it ends at a bound or an edge, with the other keys at their
    estimates.
    """
    key, inside = problem.keys[j], []

    def at(position: float) -> "Array":
        place = x.copy()
        place[j] = min(max(position, 0.0), 1.0)
        return place

    for side, end in zip(SIDES, ends, strict=True):
        last, beyond = at(end), problem.model(at(end + side * AT_EDGE))
        if beyond.fault and not problem.works(last):
            last = problem.last_good(x, last)
        value = key.value(float(last[j]))
        where = f"the {what} interval of {key.key} ends at"
        if beyond.fault:
            cut.append(f"{where} the edge of valid values, {value:.6g}; beyond it, {beyond.fault}")
        elif not 0.0 <= end <= 1.0:
            cut.append(f"{where} its {SIDES[side][0]} bound {value:g}")
        inside.append(value)
    return inside[0], inside[1]


def _grouped(
    problem: FitProblem, weights: "Array", best: Minimum, found: list[Minimum], limit: float
) -> tuple[int, list[Minimum]]:
    """Return how many searches found the best minimum, and other minima within its noise.

    Chi squared at the latter exceeds the least one by no more than a limit, or they give the data
    exactly. Two ends are different minima where the data fit worse half way between them.
    """
    least = found[0].cost

    def cost(x: "Array") -> float:
        return problem.cost(x, weights)

    def are_different(one: Minimum, other: Minimum) -> bool:
        middle = 0.5 * (one.x + other.x)
        if np.max(np.abs(one.x - other.x)) <= DIFFERENT_ENDS:
            return False
        highest = max(cost(one.x), cost(other.x))
        return not problem.is_exact(middle) and cost(middle) > highest * (1.0 + SAME)

    same, others = 0, list[Minimum]()
    for end in found:
        if not are_different(found[0], end):
            same += end.cost <= least * (1.0 + SAME) + ROUNDED
        elif all(are_different(other, end) for other in others):
            excess = 2.0 * (cost(end.x) - cost(best.x))
            fits = excess <= limit or problem.is_exact(end.x)
            others += [end] if end.converged and fits else []
    return same, others


def _residuals(
    problem: FitProblem, noise: Noise, best: Minimum, degrees: int
) -> tuple[TargetResiduals, ...]:
    parts, start, residuals = [], 0, problem.residuals(best.x)
    for target in problem.data.targets:
        rows = slice(start, start + target.values.size)
        values, sigma, start = residuals[rows], noise.sigma[rows], rows.stop
        is_given, unit = target.sigma is not None, problem.units[target.name]
        is_series = target.kind == "channel" and values.size >= MIN_SERIES
        part = TargetResiduals(
            name=target.name,
            unit=unit,
            column=target.column,
            data_unit=target.data_unit or unit,
            values=values,
            fitted=target.values - values,
            sigma=float(np.mean(sigma)) if is_given or degrees else None,
            sigma_given=is_given,
            worst=float(np.max(np.abs(values / sigma))) if is_given else None,
            autocorrelation=autocorrelation(values) if is_series else None,
        )
        parts.append(part)
    return tuple(parts)


def _bootstrap(
    problem: FitProblem,
    noise: Noise,
    best: Minimum,
    has_noise: bool,
    known: Identification,
    options: FitOptions,
    cut: list[str],
) -> Bootstrap:
    """Fit bootstrap resamples: the fit plus normal deviations where sigma is given, else residuals.

    The residuals of each group are drawn with replacement, from those about their mean, scaled to
    the estimated standard deviation. Each fit starts at the best one. Only keys that the data
    determine have intervals.
    """
    rng = np.random.default_rng([options.seed, 1])
    residuals = problem.residuals(best.x)
    searches = []
    for _ in range(options.bootstrap):
        drawn = noise.sigma * rng.normal(size=residuals.size)
        for group in noise.groups:
            pool = residuals[group] / noise.sigma[group]
            pool = pool - np.mean(pool)
            size = np.sqrt(np.mean(pool**2)) or 1.0
            drawn[group] = noise.sigma[group] * rng.choice(pool / size, size=pool.size)
        resampled = problem.data.values - residuals + drawn
        searches.append(Search(problem, 1.0 / noise.sigma, best.x, resampled))
    ends = minima(searches)
    places = np.array([end.x for end in ends if end.converged]).reshape(-1, len(problem.keys))
    intervals: dict[str, tuple[float, float] | None] = {key.key: None for key in problem.keys}
    for j, key in enumerate(problem.keys):
        is_determined = has_noise and key.key not in known.reasons
        if is_determined and len(places) >= MIN_RESAMPLES:
            low, high = np.percentile(places[:, j], (2.5, 97.5)).tolist()
            intervals[key.key] = _within_edges(problem, best.x, j, (low, high), "bootstrap", cut)
    values = [[*problem.values(place).values()] for place in places]
    table = np.array(values).reshape(-1, len(problem.keys))
    return Bootstrap(len(table), len(ends) - len(table), intervals, table)
