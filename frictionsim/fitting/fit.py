"""The fit of free keys of a scenario to measured data: search, noise, uncertainty, bootstrap.

Residuals are divided by the standard deviation of the data. A given one is used unchanged, and the
standard errors follow from it. Otherwise that of each channel or quantity is estimated from its
residuals; with several of them the fit is repeated with these weights until they converge
(iterated weighted least squares).

The bootstrap gives intervals from fits to resampled data, without linearisation. Warnings concern
the last runs, their derivatives, and residuals that are too large.
"""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from frictionsim.errors import ArgumentError, counted
from frictionsim.fitting.data import FitOptions, Noise
from frictionsim.fitting.outcome import (
    DONE,
    OUT_OF_REACH,
    STOPPED,
    Bootstrap,
    FitOutcome,
    TargetResiduals,
    derivative_warnings,
    finding_of,
    residual_warnings,
    run_warnings,
)
from frictionsim.fitting.problem import FitProblem, residuals_of
from frictionsim.fitting.search import MAX_ITERATIONS, SCANNED, Minimum, Search, minima, search
from frictionsim.fitting.uncertainty import (
    NO_CHANGE,
    Accuracy,
    Identification,
    autocorrelation,
    correlations,
    identify,
    interval,
    quantile,
    without_jumps,
    without_wide_intervals,
)
from frictionsim.scenario.model_fields import expanded

if TYPE_CHECKING:
    from frictionsim.results import Array

REWEIGHTED = 20  # times at most
SAME_NOISE = 1e-3  # relative change of the estimated standard deviations
SAME_COST = 1e-9  # relative
EVALUATIONS_OF_A_KEY = 10  # in a local search: some five derivatives by two evaluations each
MIN_SERIES = 20  # values, for a meaningful correlation of neighbours
NO_SCATTER = (
    "no standard error is known: there are as many values as free keys, which leave no scatter;"
    " give sigma"
)


def fit(problem: FitProblem, options: FitOptions) -> FitOutcome:
    """Fit the free keys of a problem."""
    _check(problem)
    of_searches = EVALUATIONS_OF_A_KEY * len(problem.keys) * (options.starts + options.bootstrap)
    problem.expect(SCANNED * options.starts + of_searches)
    noise = Noise(problem.data.targets)
    best, starts = search(problem, 1.0 / noise.sigma, options.starts, options.seed)
    if noise.is_to_be_balanced:
        best = _reweigh(problem, noise, best)
    best, identification, rough = _identification(problem, noise, best)
    model = problem.model(best.x)
    degrees = problem.data.size - identification.rank
    reliable = noise.all_given or degrees > 0
    if reliable:
        factor = quantile(None if noise.all_given else degrees)
        identification = without_wide_intervals(identification, problem.keys, factor)
    else:
        unknown = np.full_like(identification.covariance, np.nan)
        identification, factor = identification._replace(covariance=unknown), 0.0
    drawn = None
    if options.bootstrap:
        known = [k.key for k in problem.keys if reliable and k.key not in identification.reasons]
        drawn = bootstrap(problem, noise, best, known, options.seed, options.bootstrap)
    identification = without_jumps(identification, problem.keys, rough[0])
    statistics = _statistics(problem, noise, best, degrees)
    finding = finding_of(problem, best, starts, identification)
    chi = float(np.sum((residuals_of(problem, best.x) / noise.sigma) ** 2))
    warnings = [
        *([] if reliable else [NO_SCATTER]),
        *([finding.sentence] if finding.kind == OUT_OF_REACH else []),
        *([f"self-audit of the fitted run failed: {model.doubt}"] if model.doubt else []),
        *run_warnings(model, len(problem.data.runs)),
        *derivative_warnings(problem.keys, *rough, identification),
        *residual_warnings(statistics, chi if noise.all_given else None, degrees),
    ]
    values = problem.values(best.x)
    errors, intervals = _errors_and_intervals(problem, best, identification, factor)
    return FitOutcome(
        fitted=problem.scenario.replace(expanded(values)),
        keys=problem.keys,
        data=problem.data,
        values=values,
        standard_errors=errors,
        intervals=intervals,
        correlations=correlations(identification.covariance),
        not_identified=identification.reasons,
        residuals=statistics,
        chi_squared=chi if noise.all_given else None,
        degrees=degrees,
        status=DONE if best.converged else STOPPED,
        reason="" if best.converged else f"limit of {MAX_ITERATIONS} iterations reached",
        finding=finding,
        starts=starts,
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
    alone = [] if data.over else [t for t in data.targets if t.kind == "quantity"]
    single = [target.name for target in alone if target.sigma is None]
    if single and any(target.kind == "channel" for target in data.targets):
        raise ArgumentError(
            "sigma",
            f"the quantity {single[0]} beside channels needs a standard deviation, as"
            f" {single[0]}=0.01",
        )


def _reweigh(problem: FitProblem, noise: Noise, best: Minimum) -> Minimum:
    """Return the minimum weighted by the noise estimated from its residuals."""
    for _ in range(REWEIGHTED):
        if noise.estimate(residuals_of(problem, best.x), len(problem.keys)) < SAME_NOISE:
            break
        best = Search(problem, 1.0 / noise.sigma).minimum(best.x)
    return best


def _identification(
    problem: FitProblem, noise: Noise, best: Minimum
) -> "tuple[Minimum, Identification, tuple[Array, Array]]":
    """Return the minimum, the keys identified there, and how rough the derivatives (keys) are."""
    keys, solver = problem.keys, problem.scenario.solver
    tolerance = 0.0 if problem.scenario.pair.fixed_step else solver.rtol
    task = Search(problem, 1.0 / noise.sigma)
    accuracy = Accuracy(task.step, tolerance)
    jacobian, *rough = task.checked_jacobian(best.x)
    identification = identify(keys, best.x, jacobian, noise.spread / noise.sigma, accuracy)
    best = _reset_free_keys(task, best, identification)
    # The rank gives the degrees of freedom, and these the noise.
    noise.estimate(residuals_of(problem, best.x), identification.rank)
    jacobian = jacobian / (noise.sigma * task.weights)[:, None]
    identification = identify(keys, best.x, jacobian, noise.spread / noise.sigma, accuracy)
    return best, identification, (rough[0], rough[1])


def _reset_free_keys(task: Search, best: Minimum, identification: Identification) -> Minimum:
    """Return the minimum with keys on which it does not depend reset to their starts."""
    x = best.x.copy()
    for j, key in enumerate(task.problem.keys):
        if identification.reasons.get(key.key) == NO_CHANGE:
            x[j] = key.scaled(key.start)
    return best._replace(x=x) if task.cost(x) <= best.cost * (1.0 + SAME_COST) else best


def _errors_and_intervals(
    problem: FitProblem, best: Minimum, identification: Identification, factor: float
) -> tuple[dict[str, float | None], dict[str, tuple[float, float] | None]]:
    """Return standard errors and intervals by key; None where they are not known."""
    errors: dict[str, float | None] = {}
    intervals: dict[str, tuple[float, float] | None] = {}
    for j, (key, x) in enumerate(zip(problem.keys, best.x, strict=True)):
        variance = identification.covariance[j, j]
        known = bool(np.isfinite(variance))
        scaled = float(np.sqrt(variance)) if known else 0.0
        errors[key.key] = scaled * key.derivative(float(x)) if known else None
        intervals[key.key] = interval(key, float(x), factor * scaled) if known else None
    return errors, intervals


def _statistics(
    problem: FitProblem, noise: Noise, best: Minimum, degrees: int
) -> tuple[TargetResiduals, ...]:
    statistics, start, residuals = [], 0, residuals_of(problem, best.x)
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
    problem: FitProblem,
    noise: Noise,
    best: Minimum,
    known: Sequence[str],
    seed: int,
    fits: int,
) -> Bootstrap:
    """Fit bootstrap resamples: the fit plus normal deviations where sigma is given, else residuals.

    The residuals of each group are drawn with replacement, from those about their mean, scaled to
    the estimated standard deviation. Each fit starts at the best one. Only keys whose uncertainty
    is known have intervals.
    """
    rng = np.random.default_rng([seed, 1])
    residuals = residuals_of(problem, best.x)
    measured = np.concatenate([t.values for t in problem.data.targets])
    fitted, values, failed = measured - residuals, [], 0
    weights = 1.0 / noise.sigma

    def resampled() -> "Iterator[tuple[Search, Array]]":
        for _ in range(fits):
            drawn = noise.sigma * rng.normal(size=residuals.size)
            for group in noise.groups:
                pool = residuals[group] / noise.sigma[group]
                pool = pool - np.mean(pool)
                size = np.sqrt(np.mean(pool**2)) or 1.0
                drawn[group] = noise.sigma[group] * rng.choice(pool / size, size=pool.size)
            yield Search(problem, weights, fitted + drawn), best.x

    problem.compile(best.x)
    for minimum in minima(problem, resampled(), fits):
        if minimum.converged:
            values.append([key.value(x) for key, x in zip(problem.keys, minimum.x, strict=True)])
        else:
            failed += 1
    table = np.array(values).reshape(-1, len(problem.keys))
    intervals: dict[str, tuple[float, float] | None] = {}
    for j, key in enumerate(problem.keys):
        has_interval = key.key in known and len(table) > 1
        low, high = np.percentile(table[:, j], (2.5, 97.5)) if has_interval else (0.0, 0.0)
        intervals[key.key] = (float(low), float(high)) if has_interval else None
    return Bootstrap(len(table), failed, intervals, table)
