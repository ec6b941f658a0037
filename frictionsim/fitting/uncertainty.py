"""Standard errors and correlations of fitted keys, from the derivatives of the residuals.

Near the estimate the residuals are assumed to be linear in the keys. Their derivatives J, each
residual divided by its standard deviation, give the covariance (J^T J)^-1. A key along which no
residual changes, keys of which only a combination changes them, a key at its bound, and one that
the data determine no better than its bounds do, are not identified: they have no standard error.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frictionsim.fitting.problem import FreeKey
from frictionsim.fitting.search import JUMPS

if TYPE_CHECKING:
    from frictionsim.results import Array

CONFIDENCE = 0.95
AT_BOUND = 1e-4  # of the bounds
MIN_SINGULAR = 1e-4  # of derivatives scaled to length 1: smaller ones may be errors of differences
MIN_COMPONENT = 0.1  # of a unit vector: a smaller component is no part of a combination
NO_CHANGE = "the data do not change with it"
ROUNDING = 1e-7  # of the spread of the data


class Identification(NamedTuple):
    """The identified keys, and the covariance of their scaled places."""

    reasons: dict[str, str]  # why a key is not identified, by key
    # For residuals of standard deviation 1.
    covariance: "Array"  # (keys, keys), of scaled places; NaN of a key that is not identified
    rank: int  # number of keys, or combinations of them, that the data determine


class Accuracy(NamedTuple):
    """The accuracy of the derivatives."""

    step: float  # of the differences, as a part of the bounds
    noise: float  # error of the runs, relative to the spread of the data

    @property
    def flat(self) -> float:
        """The limit, relative to the spread of the data, below which derivatives count as zero."""
        return max(ROUNDING, 10.0 * self.noise / self.step)

    @property
    def singular(self) -> float:
        """Singular values below which a direction is not determined."""
        return max(MIN_SINGULAR, 10.0 * self.step**2, 10.0 * self.noise / self.step)


def identify(
    keys: tuple[FreeKey, ...],
    x: "Array",
    jacobian: "Array",
    spread: "Array",
    accuracy: Accuracy,
) -> Identification:
    """Return the identified keys.

    Parameters
    ----------
    keys : tuple of FreeKey
    x : (keys,)
        The scaled estimates.
    jacobian : (n, keys)
        Derivatives of the residuals over their standard deviations.
    spread : (n,)
        Spread of the data over these standard deviations.
    accuracy : Accuracy
    """
    reasons: dict[str, str] = {}
    for j, key in enumerate(keys):
        if np.max(np.abs(jacobian[:, j]) / spread) <= accuracy.flat:
            reasons[key.key] = NO_CHANGE
        elif x[j] < AT_BOUND or x[j] > 1.0 - AT_BOUND:
            side, bound = ("lower", key.low) if x[j] < 0.5 else ("upper", key.high)
            reasons[key.key] = f"its estimate is at the {side} bound {bound:g}; widen the bounds"
    active = [j for j, key in enumerate(keys) if key.key not in reasons]
    covariance = np.full((len(keys), len(keys)), np.nan)
    if not active:
        return Identification(reasons, covariance, 0)
    lengths = np.linalg.norm(jacobian[:, active], axis=0)
    _, singular, right = np.linalg.svd(jacobian[:, active] / lengths, full_matrices=False)
    determined = singular > accuracy.singular * singular[0]
    for vector in right[~determined]:
        parts = [j for j, part in zip(active, vector, strict=True) if abs(part) > MIN_COMPONENT]
        signs = [part for part in vector if abs(part) > MIN_COMPONENT]
        for j in parts:
            others = " and ".join(keys[i].key for i in parts if i != j)
            sign = "-" if len(parts) == 2 and signs[0] * signs[1] < 0.0 else ""
            correlation = f" (correlation {sign}1.000)" if len(parts) == 2 else ""
            reasons[keys[j].key] = (
                f"the data determine only a combination of it and {others}{correlation}; fix one"
            )
    kept = right[determined] / singular[determined, None]
    inner = (kept.T @ kept) / np.outer(lengths, lengths)
    covariance[np.ix_(active, active)] = inner
    rank = int(np.sum(determined))
    return _without(Identification(reasons, covariance, rank), keys, {})


def _without(
    identification: Identification, keys: tuple[FreeKey, ...], reasons: dict[str, str]
) -> Identification:
    """Return the identification without further keys, given by the reasons to exclude them."""
    reasons = identification.reasons | {
        k: why for k, why in reasons.items() if k not in identification.reasons
    }
    covariance = identification.covariance.copy()
    for j, key in enumerate(keys):
        if key.key in reasons:
            covariance[j, :] = covariance[:, j] = np.nan
    return identification._replace(reasons=reasons, covariance=covariance)


def quantile(degrees: int | None) -> float:
    """Return the factor of the standard error for a 95 % interval.

    None means given standard deviations; else they were estimated with these degrees of freedom.
    """
    from scipy import special  # imported here: a fit alone needs it

    probability = 0.5 + 0.5 * CONFIDENCE
    if degrees is None:
        return float(special.ndtri(probability))
    return float(special.stdtrit(degrees, probability))


def without_wide_intervals(
    identification: Identification, keys: tuple[FreeKey, ...], factor: float
) -> Identification:
    """Return the identification without keys whose 95 % interval is wider than their bounds.

    The interval is the standard error times a factor.
    """
    why = "the data determine it no better than its bounds do"
    wide = factor * np.sqrt(np.diag(identification.covariance)) > 1.0  # False for NaN
    return _without(
        identification,
        keys,
        {key.key: why for key, is_wide in zip(keys, wide, strict=True) if is_wide},
    )


def without_jumps(
    identification: Identification, keys: tuple[FreeKey, ...], differences: "Array"
) -> Identification:
    """Return the identification without keys by which the run jumps or kinks at the estimate.

    The differences (keys,) are relative, from derivatives with another step.
    """
    reasons = {
        key.key: (
            "the run jumps or kinks at the estimate (its derivatives change by"
            f" {100.0 * difference:.0f} % with the step of their differences); a bootstrap does"
            " not need them"
        )
        for key, difference in zip(keys, differences, strict=True)
        if difference > JUMPS
    }
    return _without(identification, keys, reasons)


def correlations(covariance: "Array") -> "Array":
    """Return the correlations; NaN where a key is not identified."""
    errors = np.sqrt(np.diag(covariance))
    matrix = covariance / np.outer(errors, errors)
    np.fill_diagonal(matrix, np.where(np.isfinite(errors), 1.0, np.nan))  # without rounding
    return np.asarray(np.clip(matrix, -1.0, 1.0))


def interval(key: FreeKey, x: float, half_width: float) -> tuple[float, float]:
    """Return the interval of the value of a key about a scaled place; it may exceed the bounds."""
    if key.is_log:
        size = np.log(key.high / key.low)
        return tuple(  # type: ignore[return-value]
            float(key.low * np.exp(size * (x + s * half_width))) for s in (-1.0, 1.0)
        )
    size = key.high - key.low
    return key.low + size * (x - half_width), key.low + size * (x + half_width)


def autocorrelation(residuals: "Array") -> float:
    """Return the correlation of neighbouring residuals."""
    total = float(np.sum(residuals**2))
    return float(np.sum(residuals[1:] * residuals[:-1])) / total if total > 0.0 else 0.0
