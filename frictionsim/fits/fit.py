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
from frictionsim.fits.data import FitOptions
from frictionsim.fits.outcome import (
    DONE,
    NO_SCATTER,
    OUT_OF_REACH,
    STOPPED,
    Bootstrap,
    FitOutcome,
    TargetResiduals,
    finding_of,
    residual_warnings,
    run_warnings,
    start_of,
)
from frictionsim.fits.problem import FitProblem
from frictionsim.fits.search import (
    EVALUATIONS_OF_A_KEY,
    MAX_ITERATIONS,
    Minimum,
    Search,
    minima,
    search,
)
from frictionsim.fits.uncertainty import (
    JUMP,
    JUMPS,
    NO_BETTER,
    NO_CHANGE,
    Identification,
    Noise,
    autocorrelation,
    identify,
    interval,
    misfit_of_noise,
    quantile,
)
from frictionsim.scenario.model_fields import expanded

if TYPE_CHECKING:
    from frictionsim.results import Array

REWEIGHTED = 20  # times at most
SAME_NOISE = 1e-3  # relative change of the estimated standard deviations
SAME_COST = 1e-9  # relative
MIN_SERIES = 20  # values, for a meaningful correlation of neighbours
APART = 1e-2  # of the bounds: different ends of searches
SAME = 1e-3  # relative difference of costs below which minima are equal
ROUNDED = 1e-12  # cost of the rounding of data without noise, in units of their spread


def fit(problem: FitProblem, options: FitOptions) -> FitOutcome:
    """Fit the free keys of a problem."""
    _check(problem)
    keys, noise = problem.keys, Noise(problem.data.targets)
    found = search(problem, 1.0 / noise.sigma, options.starts, options.seed)
    best = _reweighed(problem, noise, found[0]) if noise.is_to_be_balanced else found[0]
    best, identification, changes = _identified(problem, noise, best)
    degrees = problem.data.size - identification.rank
    known = noise.all_given or degrees > 0
    factor = quantile(None if noise.all_given else degrees) if known else np.nan
    half_widths = factor * identification.deviations
    wide = {key.key: NO_BETTER for key, half in zip(keys, half_widths, strict=True) if half > 1.0}
    identification = identification.without(keys, wide)
    drawn = None
    if options.bootstrap:
        determined = [known and key.key not in identification.reasons for key in keys]
        drawn = bootstrap(problem, noise, best, determined, options)
    rough = {key.key: JUMP for key, change in zip(keys, changes, strict=True) if change > JUMPS}
    identification = identification.without(keys, rough)
    if not known:
        unknown = np.full_like(identification.covariance, np.nan)
        identification = identification._replace(covariance=unknown)
    limit = misfit_of_noise(len(keys), None if noise.all_given else degrees) if known else -np.inf
    same, others = _grouped(Search(problem, 1.0 / noise.sigma), best, found, limit)
    finding = finding_of(problem, best, len(same), found, [problem.values(o.x) for o in others])
    statistics = _statistics(problem, noise, best, degrees)
    chi = float(np.sum((problem.residuals(best.x) / noise.sigma) ** 2)) if noise.all_given else None
    model, values = problem.model(best.x), problem.values(best.x)
    errors: dict[str, float | None] = {}
    intervals: dict[str, tuple[float, float] | None] = {}
    for key, x, scaled in zip(keys, best.x.tolist(), identification.deviations, strict=True):
        has_error = bool(np.isfinite(scaled))
        errors[key.key] = float(scaled) * key.derivative(x) if has_error else None
        intervals[key.key] = interval(key, x, factor * float(scaled)) if has_error else None
    warnings = [
        *([] if known else [NO_SCATTER]),
        *([finding.sentence] if finding.kind == OUT_OF_REACH else []),
        *([finding.also] if finding.also else []),
        *([f"self-audit of the fitted run failed: {model.doubt}"] if model.doubt else []),
        *run_warnings(model, len(problem.data.runs)),
        *residual_warnings(statistics, chi, degrees),
    ]
    return FitOutcome(
        fitted=problem.scenario.replace(expanded(values)),
        keys=keys,
        data=problem.data,
        values=values,
        standard_errors=errors,
        intervals=intervals,
        correlations=identification.correlations,
        not_identified=identification.reasons,
        residuals=statistics,
        chi_squared=chi,
        degrees=degrees,
        status=DONE if best.converged else STOPPED,
        reason="" if best.converged else f"limit of {MAX_ITERATIONS} iterations reached",
        finding=finding,
        starts=[start_of(problem, end) for end in found],
        warnings=tuple(warnings),
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


def _reweighed(problem: FitProblem, noise: Noise, best: Minimum) -> Minimum:
    """Return the minimum weighted by the noise estimated from its residuals."""
    for _ in range(REWEIGHTED):
        if noise.estimate(problem.residuals(best.x), len(problem.keys)) < SAME_NOISE:
            break
        best = Search(problem, 1.0 / noise.sigma).minimum(best.x)
    return best


def _identified(
    problem: FitProblem, noise: Noise, best: Minimum
) -> "tuple[Minimum, Identification, Array]":
    """Return the minimum, the keys identified there, and the changes (keys,) of derivatives.

    Keys that nothing changes with have their starts, if this is no worse.
    """
    keys, solver = problem.keys, problem.scenario.solver
    accuracy = 0.0 if problem.scenario.pair.fixed_step else solver.rtol
    task = Search(problem, 1.0 / noise.sigma)
    jacobian, changes = task.checked_jacobian(best.x)

    def identified() -> Identification:
        scaled = jacobian / (noise.sigma * task.weights)[:, None]
        spread = noise.spread / noise.sigma
        return identify(keys, best.x, scaled, spread, task.step, accuracy)

    first, x = identified(), best.x.copy()
    for j, key in enumerate(keys):
        if first.reasons.get(key.key) == NO_CHANGE:
            x[j] = key.scaled(key.start)
    if task.cost(x) <= best.cost * (1.0 + SAME_COST):
        best = best._replace(x=x)
    # The rank gives the degrees of freedom, and these the noise.
    noise.estimate(problem.residuals(best.x), first.rank)
    return best, identified(), changes


def _grouped(
    task: Search, best: Minimum, found: list[Minimum], limit: float
) -> tuple[list[Minimum], list[Minimum]]:
    """Return the searches that found the best minimum, and other minima within its noise.

    Chi squared at the latter exceeds the least one by no more than a limit, or they give the data
    exactly. Two ends are different minima where the data fit worse half way between them.
    """
    problem, least = task.problem, found[0].cost

    def are_different(one: Minimum, other: Minimum) -> bool:
        middle = 0.5 * (one.x + other.x)
        if np.max(np.abs(one.x - other.x)) <= APART:
            return False
        highest = max(task.cost(one.x), task.cost(other.x))
        fits = problem.model(middle).values is not None and problem.is_exact(middle)
        return not fits and task.cost(middle) > highest * (1.0 + SAME)

    same, others = [], list[Minimum]()
    for end in found:
        if not are_different(found[0], end):
            same += [end] if end.cost <= least * (1.0 + SAME) + ROUNDED else []
        elif all(are_different(other, end) for other in others):
            excess = 2.0 * (task.cost(end.x) - task.cost(best.x))
            fits = problem.model(end.x).values is not None and problem.is_exact(end.x)
            others += [end] if end.converged and (excess <= limit or fits) else []
    return same, others


def _statistics(
    problem: FitProblem, noise: Noise, best: Minimum, degrees: int
) -> tuple[TargetResiduals, ...]:
    statistics, start, residuals = [], 0, problem.residuals(best.x)
    for target in problem.data.targets:
        rows = slice(start, start + target.values.size)
        values, start = residuals[rows], rows.stop
        has_sigma = target.sigma is not None
        series = target.kind == "channel" and values.size >= MIN_SERIES
        statistics.append(
            TargetResiduals(
                name=target.name,
                unit=problem.units[target.name],
                column=target.column,
                data_unit=target.data_unit or problem.units[target.name],
                values=values,
                fitted=target.values - values,
                rms=float(np.sqrt(np.mean(values**2))),
                largest=float(np.max(np.abs(values))),
                sigma=float(np.mean(noise.sigma[rows])) if has_sigma or degrees else None,
                sigma_given=has_sigma,
                worst=float(np.max(np.abs(values / noise.sigma[rows]))) if has_sigma else None,
                autocorrelation=autocorrelation(values) if series else None,
            )
        )
    return tuple(statistics)


def bootstrap(
    problem: FitProblem, noise: Noise, best: Minimum, determined: list[bool], options: FitOptions
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
        searches.append((Search(problem, 1.0 / noise.sigma, resampled), best.x))
    problem.compile(best.x, EVALUATIONS_OF_A_KEY * len(problem.keys) * options.bootstrap)
    ends = minima(searches)
    places = [end.x for end in ends if end.converged]
    values = [
        [key.value(x) for key, x in zip(problem.keys, place, strict=True)] for place in places
    ]
    table = np.array(values).reshape(-1, len(problem.keys))
    intervals: dict[str, tuple[float, float] | None] = {}
    for key, column, is_determined in zip(problem.keys, table.T, determined, strict=True):
        has_interval = is_determined and len(table) > 1
        low, high = np.percentile(column, (2.5, 97.5)) if has_interval else (0.0, 0.0)
        intervals[key.key] = (float(low), float(high)) if has_interval else None
    return Bootstrap(len(table), len(ends) - len(table), intervals, table)
