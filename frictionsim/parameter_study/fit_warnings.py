"""What a fit says of itself: what kind of estimate it found, and its warnings.

These are about its last runs, its derivatives, and residuals that are too large.
"""

import re
from typing import TYPE_CHECKING

import numpy as np

from frictionsim.errors import counted
from frictionsim.parameter_study.fit_outcome import (
    EQUAL_MINIMA,
    FLAT,
    MINIMUM,
    OUT_OF_REACH,
    PLATEAU,
    REACHED,
    Finding,
)
from frictionsim.parameter_study.fit_problem import residuals_of
from frictionsim.parameter_study.fit_search import DISAGREE
from frictionsim.parameter_study.fit_uncertainty import NO_CHANGE

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
    """Return what kind of estimate the searches have found, with a sentence.

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
    """Return what the residuals show that noise of the given sigma does not have.

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
