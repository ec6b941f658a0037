"""The fit of free keys of a scenario to measured data: search, noise, uncertainty, bootstrap.

Residuals are divided by the standard deviation of the data. Where it is given, it is taken as it
is, and the standard errors follow from it. Where it is not, each channel or quantity has an unknown
one, which is estimated from its residuals; with several of them the fit is repeated with these
weights until they converge (iterated weighted least squares).

The bootstrap gives intervals from fits to data drawn again, without linearisation. Warnings are
about the last runs, their derivatives, and residuals that are too large.
"""

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frictionsim.errors import ArgumentError, counted
from frictionsim.parameter_study.fit_data import Noise
from frictionsim.parameter_study.fit_outcome import (
    DONE,
    EQUAL_MINIMA,
    FLAT,
    MINIMUM,
    OUT_OF_REACH,
    PLATEAU,
    REACHED,
    STOPPED,
    Bootstrap,
    Finding,
    Outcome,
    TargetResiduals,
)
from frictionsim.parameter_study.fit_problem import FitProblem, residuals_of
from frictionsim.parameter_study.fit_search import DISAGREE, MAX_ITERATIONS, Minimum, Search, search
from frictionsim.parameter_study.fit_uncertainty import (
    NO_CHANGE,
    Accuracy,
    Identified,
    autocorrelation,
    correlations,
    determine_no_better,
    identify,
    interval,
    quantile,
    without_jumps,
)
from frictionsim.parameter_study.keys import expanded

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from frictionsim.parameter_study.fit_keys import FreeKey
    from frictionsim.parameter_study.fit_outcome import TargetResiduals
    from frictionsim.parameter_study.fit_problem import FitProblem, Model
    from frictionsim.parameter_study.fit_search import Minimum, Start
    from frictionsim.parameter_study.fit_uncertainty import Identified

    Array = npt.NDArray[np.float64]


SIGNIFICANT = 4.0  # standard deviations
TOO_LARGE = 1e-2  # probability of a chi squared that is so large by chance
NUMBER = re.compile(r"-?\d[\d.]*(?:e[-+]?\d+)?")
UNLIKELY = 1e-3  # probability that one of many residuals is so large by chance
SAME = 1e-3  # relative: searches with such costs have found the same minimum
EXACT = 1e-12  # a cost: of data without noise it is a rounding
APART = 1e-2  # of the bounds: ends of searches at different values
MAX_VALUES = 4  # in a sentence


def finding(
    problem: "FitProblem", best: "Minimum", starts: "list[Start]", found: "Identified"
) -> Finding:
    """Return the kind of estimate that the searches have found, with a sentence.

    Parameters
    ----------
    problem : FitProblem
    best : Minimum
    starts : list of Start
        The searches by their costs.
    found : Identified
        Which keys are identified at the estimate.
    """
    names = " and ".join(key.key for key in problem.keys)
    still = all(found.reasons.get(key.key) == NO_CHANGE for key in problem.keys)
    if still:  # a search that did not move has seen the neighbourhood of its start only
        for end in (0.0, 1.0):
            problem.at(np.full(len(problem.keys), end))
    flat = still and bool((problem.largest - problem.least <= problem.accuracy).all())
    reached = problem.gives(best.x)
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
        on = "on a plateau"
        if len(places) > 1:
            on = f"on plateaus with equal residuals{_listed(problem, places)}"
        sentence = f"{exactly}{searches} ended {on}, where the data do not change with {names}"
        return Finding(PLATEAU, sentence, reachable)
    if len(places) > 1 and len(problem.keys) == 1:
        at = _listed(problem, places)
        sentence = f"{exactly}{searches} ended with equal residuals{at}: the data fit them as well"
        return Finding(EQUAL_MINIMA, sentence, reachable)
    if reached:
        return Finding(REACHED, f"{searches} reached the data exactly", reachable)
    return Finding(MINIMUM, f"{searches} found this minimum", reachable)


def _is_beyond_noise(problem: "FitProblem", best: "Minimum") -> bool:
    """Return whether the residual of a single value is larger than that of its sigma, if given."""
    sigma = problem.data.targets[0].sigma
    noise = 0.0 if sigma is None else SIGNIFICANT * float(sigma[0])
    return abs(float(residuals_of(problem, best.x)[0])) > noise


def _out_of_reach(problem: "FitProblem", best: "Minimum", names: str, flat: bool) -> str:
    (target,) = problem.data.targets
    unit = problem.units[target.name]
    unit = f" {unit}" if unit not in ("", "1") else ""
    least, largest, wanted = problem.least[0], problem.largest[0], target.values[0]
    begin = f"out of reach: {target.name} = {wanted:.6g}{unit}"
    if flat:
        return f"{begin}; it is {least:.6g}{unit} whatever {names} is within the bounds"
    reachable = f"{problem.runs} runs within the bounds gave {least:.6g} to {largest:.6g}{unit}"
    if best.jump is not None:
        below, above = best.jump
        at = problem.values(best.x)[names]
        jump = f"it jumps from {below:.6g} to {above:.6g}{unit} at {names} = {at:.6g}"
        return f"{begin}; {jump}; {reachable}"
    return f"{begin}; {reachable}"


def _places(problem: "FitProblem", starts: "list[Start]") -> list[dict[str, float]]:
    """Return the ends of searches that are apart from each other, as values by key."""
    found: list[dict[str, float]] = []
    for start in starts:
        if all(
            any(
                abs(k.scaled(start.last[k.key]) - k.scaled(other[k.key])) > APART
                for k in problem.keys
            )
            for other in found
        ):
            found.append(start.last)
    return found


def _listed(problem: "FitProblem", places: list[dict[str, float]]) -> str:
    """Return the values of a single key at some places."""
    if len(problem.keys) > 1:
        return " at different values"
    (key,) = problem.keys
    values = sorted(place[key.key] for place in places)
    more = ", ..." if len(values) > MAX_VALUES else ""
    return f" at {key.key} = {', '.join(f'{value:.6g}' for value in values[:MAX_VALUES])}{more}"


def run_warnings(model: "Model", rows: int) -> list[str]:
    """Return the warnings of the runs with the estimates, each once, with how many rows have it.

    Those that differ in their numbers only are one, with the numbers of the first row.
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
    keys: "Sequence[FreeKey]", differences: "Array", jumps: "Array", found: "Identified"
) -> list[str]:
    """Return the keys whose derivatives are not those of all that is within a standard error.

    Parameters
    ----------
    keys : sequence of FreeKey
    differences, jumps : (keys,)
        As of `Search.checked_jacobian`.
    found : Identified
    """
    warnings = []
    for j, key in enumerate(keys):
        if key.key in found.reasons:
            continue
        if differences[j] > DISAGREE:
            warnings.append(
                f"the derivatives by {key.key} change by {100.0 * differences[j]:.0f} % with the"
                " step of their differences, as where events pass samples: its standard error is"
                " rough; a bootstrap does not need them"
            )
        elif 0.0 < jumps[j] < np.sqrt(found.covariance[j, j]):
            warnings.append(
                f"the run jumps or kinks where {key.key} is less than its standard error from the"
                " estimate: that is rough; a bootstrap does not need derivatives"
            )
    return warnings


def residual_warnings(
    statistics: "Sequence[TargetResiduals]", chi: float | None, degrees: int
) -> list[str]:
    """Return warnings about residuals that noise of the given sigma does not explain.

    Parameters
    ----------
    statistics : sequence of TargetResiduals
    chi : float or None
        Chi squared; None unless every sigma was given.
    degrees : int
        Degrees of freedom.
    """
    alike = [_alike(part) for part in statistics if _is_alike(part)]
    return [*alike, *(_chi_warning(statistics, chi, degrees) or _outliers(statistics))]


def _is_alike(part: "TargetResiduals") -> bool:
    spread, near = float(np.std(part.values + part.fitted)), part.autocorrelation
    limit = SIGNIFICANT / np.sqrt(part.values.size)
    return near is not None and part.rms > 1e-6 * spread and near > limit


def _alike(part: "TargetResiduals") -> str:
    return (
        f"neighbouring residuals of {part.name} are alike (correlation {part.autocorrelation:.2f}):"
        " the scenario lacks something that the data show, or their noise is not white; the"
        " standard errors are too small"
    )


def _chi_warning(
    statistics: "Sequence[TargetResiduals]", chi: float | None, degrees: int
) -> list[str]:
    """Return that all residuals together are too large; nothing if they are not."""
    from scipy import special  # imported here: a fit alone needs it

    # Keys that jump cannot give as many values exactly: without degrees of freedom there may be
    # residuals, too, and they must not be larger than those of one.
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


def _outliers(statistics: "Sequence[TargetResiduals]") -> list[str]:
    """Return the channels and quantities with a residual that no noise of their sigma has."""
    from scipy import special

    found = []
    for part in statistics:
        # Of many values one may be beyond 4 sigma by chance.
        limit = max(SIGNIFICANT, -float(special.ndtri(0.5 * UNLIKELY / part.values.size)))
        if part.worst is not None and part.worst > limit:
            found.append(
                f"the residuals of {part.name} are up to {part.worst:.3g} times their sigma: the"
                " scenario cannot give the data, or sigma is too small"
            )
    return found


def bootstrap(
    problem: FitProblem,
    noise: Noise,
    best: Minimum,
    reasons: Mapping[str, str],
    seed: int,
    fits: int,
) -> Bootstrap:
    """Fit bootstrap resamples: the fit plus normal deviations where sigma is given, else residuals.

    The residuals of each group are drawn with replacement, from those about their mean, scaled to
    the estimated standard deviation.

    Parameters
    ----------
    problem : FitProblem
    noise : Noise
    best : Minimum
        Each fit starts there.
    reasons : mapping of str
        Keys that are not identified.
    seed, fits : int
    """
    rng = np.random.default_rng([seed, 1])
    residuals = residuals_of(problem, best.x)
    measured = np.concatenate([t.values for t in problem.data.targets])
    fitted, values, failed = measured - residuals, [], 0
    for _ in range(fits):
        drawn = noise.sigma * rng.normal(size=residuals.size)
        for group in noise.groups:
            pool = residuals[group] / noise.sigma[group]
            pool = pool - np.mean(pool)
            size = np.sqrt(np.mean(pool**2)) or 1.0
            drawn[group] = noise.sigma[group] * rng.choice(pool / size, size=pool.size)
        minimum = Search(problem, 1.0 / noise.sigma, fitted + drawn).minimum(best.x)
        if minimum.converged:
            values.append([key.value(x) for key, x in zip(problem.keys, minimum.x, strict=True)])
        else:
            failed += 1
    table = np.array(values).reshape(-1, len(problem.keys))
    intervals: dict[str, tuple[float, float] | None] = {}
    for j, key in enumerate(problem.keys):
        known = key.key not in reasons and len(table) > 1
        low, high = np.percentile(table[:, j], (2.5, 97.5)) if known else (0.0, 0.0)
        intervals[key.key] = (float(low), float(high)) if known else None
    return Bootstrap(len(table), failed, intervals, table)


REWEIGHTED = 20  # times at most
SAME_NOISE = 1e-3  # relative change of the estimated standard deviations
SAME_COST = 1e-9  # relative
MIN_SERIES = 20  # values, for a correlation of neighbours to mean something


class Settings(NamedTuple):
    """How a fit is done.

    Attributes
    ----------
    starts : int
        Local searches.
    seed : int
        Of the scan and of the bootstrap.
    bootstrap : int
        Number of bootstrap resamples.
    """

    starts: int = 3
    seed: int = 0
    bootstrap: int = 0


def fit(problem: FitProblem, settings: Settings) -> Outcome:
    """Fit the free keys of a problem."""
    _check(problem)
    noise = Noise(problem.data.targets)
    best, starts = search(problem, 1.0 / noise.sigma, settings.starts, settings.seed)
    if noise.is_to_be_balanced:
        best = _reweigh(problem, noise, best)
    best, found, rough = _identified(problem, noise, best)
    model = problem.at(best.x)
    degrees = problem.data.size - found.rank
    reliable = noise.all_given or degrees > 0
    if reliable:
        factor = quantile(None if noise.all_given else degrees)
        found = determine_no_better(found, problem.keys, factor)
    else:
        found, factor = _without_scatter(problem, found), 0.0
    drawn = None
    if settings.bootstrap:
        drawn = bootstrap(problem, noise, best, found.reasons, settings.seed, settings.bootstrap)
    found = without_jumps(found, problem.keys, rough[0])
    statistics = _statistics(problem, noise, best, degrees)
    told = finding(problem, best, starts, found)
    chi = float(np.sum((residuals_of(problem, best.x) / noise.sigma) ** 2))
    warnings = [
        *([told.sentence] if told.kind == OUT_OF_REACH else []),
        *([f"self-audit of the fitted run failed: {model.doubt}"] if model.doubt else []),
        *run_warnings(model, len(problem.data.runs)),
        *derivative_warnings(problem.keys, *rough, found),
        *residual_warnings(statistics, chi if noise.all_given else None, degrees),
    ]
    values = problem.values(best.x)
    errors, intervals = _errors_and_intervals(problem, best, found, factor)
    return Outcome(
        fitted=problem.scenario.replace(expanded(values)),
        keys=problem.keys,
        data=problem.data,
        values=values,
        standard_errors=errors,
        intervals=intervals,
        correlations=correlations(found.covariance),
        not_identified=found.reasons,
        residuals=statistics,
        chi_squared=chi if noise.all_given else None,
        degrees=degrees,
        status=DONE if best.converged else STOPPED,
        reason="" if best.converged else f"limit of {MAX_ITERATIONS} iterations reached",
        finding=told,
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
    alone = [] if data.over else [t for t in data.targets if t.of == "quantity"]
    single = [target.name for target in alone if target.sigma is None]
    if single and any(target.of == "channel" for target in data.targets):
        raise ArgumentError(
            "sigma",
            f"the quantity {single[0]} beside channels needs a standard deviation, as"
            f" {single[0]}=0.01",
        )


def _reweigh(problem: FitProblem, noise: Noise, best: Minimum) -> Minimum:
    """Return the minimum with weights by the noise that is left in it."""
    for _ in range(REWEIGHTED):
        if noise.estimate(residuals_of(problem, best.x), len(problem.keys)) < SAME_NOISE:
            break
        best = Search(problem, 1.0 / noise.sigma).minimum(best.x)
    return best


def _identified(
    problem: FitProblem, noise: Noise, best: Minimum
) -> "tuple[Minimum, Identified, tuple[Array, Array]]":
    """Return the minimum, what is identified there, and how rough the derivatives (keys) are."""
    keys, solver = problem.keys, problem.scenario.solver
    tolerance = 0.0 if problem.scenario.pair.fixed_step else solver.rtol
    task = Search(problem, 1.0 / noise.sigma)
    accuracy = Accuracy(task.step, tolerance)
    jacobian, *rough = task.checked_jacobian(best.x)
    found = identify(keys, best.x, jacobian, noise.spread / noise.sigma, accuracy)
    best = _with_starts_where_free(task, best, found)
    # How many values were determined decides how much of the noise is left in the residuals.
    noise.estimate(residuals_of(problem, best.x), found.rank)
    jacobian = jacobian / (noise.sigma * task.weights)[:, None]
    found = identify(keys, best.x, jacobian, noise.spread / noise.sigma, accuracy)
    return best, found, (rough[0], rough[1])


def _with_starts_where_free(task: Search, best: Minimum, found: Identified) -> Minimum:
    """Return the minimum with the starts of keys on which it does not depend."""
    x = best.x.copy()
    for j, key in enumerate(task.problem.keys):
        if found.reasons.get(key.key) == NO_CHANGE:
            x[j] = key.scaled(key.start)
    return best._replace(x=x) if task.cost(x) <= best.cost * (1.0 + SAME_COST) else best


def _without_scatter(problem: FitProblem, found: Identified) -> Identified:
    """Return that nothing is known of the uncertainty: as many values as keys, without sigma."""
    why = "there are as many values as free keys, which leave no scatter; give sigma"
    reasons = {key.key: found.reasons.get(key.key, why) for key in problem.keys}
    return found._replace(reasons=reasons, covariance=np.full_like(found.covariance, np.nan))


def _errors_and_intervals(
    problem: FitProblem, best: Minimum, found: Identified, factor: float
) -> tuple[dict[str, float | None], dict[str, tuple[float, float] | None]]:
    """Return standard errors and intervals by key; None where it is not identified."""
    errors: dict[str, float | None] = {}
    intervals: dict[str, tuple[float, float] | None] = {}
    for j, (key, x) in enumerate(zip(problem.keys, best.x, strict=True)):
        variance = found.covariance[j, j]
        known = bool(np.isfinite(variance))
        scaled = float(np.sqrt(variance)) if known else 0.0
        errors[key.key] = scaled * key.derivative(float(x)) if known else None
        intervals[key.key] = interval(key, float(x), factor * scaled) if known else None
    return errors, intervals


def _statistics(
    problem: FitProblem, noise: Noise, best: Minimum, degrees: int
) -> tuple[TargetResiduals, ...]:
    found, at, residuals = [], 0, residuals_of(problem, best.x)
    for target in problem.data.targets:
        here = slice(at, at + target.values.size)
        values, at = residuals[here], here.stop
        given = target.sigma is not None
        series = target.of == "channel" and values.size >= MIN_SERIES
        found.append(
            TargetResiduals(
                name=target.name,
                unit=problem.units[target.name],
                column=target.column,
                data_unit=target.data_unit or problem.units[target.name],
                values=values,
                fitted=target.values - values,
                rms=float(np.sqrt(np.mean(values**2))),
                largest=float(np.max(np.abs(values))),
                sigma=float(np.mean(noise.sigma[here])) if given or degrees else None,
                sigma_given=given,
                worst=float(np.max(np.abs(values / noise.sigma[here]))) if given else None,
                autocorrelation=autocorrelation(values) if series else None,
            )
        )
    return tuple(found)
