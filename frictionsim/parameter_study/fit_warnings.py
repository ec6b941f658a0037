"""The warnings of a fit: about its last runs, its derivatives, and residuals that are too large."""

import re
from typing import TYPE_CHECKING

import numpy as np

from frictionsim.errors import counted
from frictionsim.parameter_study.fit_search import DISAGREE

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from frictionsim.parameter_study.fit_keys import FreeKey
    from frictionsim.parameter_study.fit_outcome import TargetResiduals
    from frictionsim.parameter_study.fit_problem import Model
    from frictionsim.parameter_study.fit_uncertainty import Identified

    Array = npt.NDArray[np.float64]

SIGNIFICANT = 4.0  # standard deviations
TOO_LARGE = 1e-2  # probability of a chi squared that is so large by chance
NUMBER = re.compile(r"-?\d[\d.]*(?:e[-+]?\d+)?")
UNLIKELY = 1e-3  # probability that one of many residuals is so large by chance


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
