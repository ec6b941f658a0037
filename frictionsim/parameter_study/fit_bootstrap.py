"""The bootstrap of a fit: intervals from fits to data drawn anew, without linearisation."""

from collections.abc import Mapping

import numpy as np

from frictionsim.parameter_study.fit_noise import Noise
from frictionsim.parameter_study.fit_outcome import Bootstrap
from frictionsim.parameter_study.fit_problem import FitProblem, residuals_of
from frictionsim.parameter_study.fit_search import Minimum, Search


def bootstrap(
    problem: FitProblem,
    noise: Noise,
    best: Minimum,
    reasons: Mapping[str, str],
    seed: int,
    fits: int,
) -> Bootstrap:
    """Fit to data drawn anew: the fit plus normal deviations where sigma is given, else residuals.

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
