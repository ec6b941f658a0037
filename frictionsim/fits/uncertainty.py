"""Standard errors and correlations of fitted keys, from the derivatives of the residuals.

Near the estimate the residuals are assumed to be linear in the keys. Their derivatives J, each
residual divided by its standard deviation, give the covariance (J^T J)^-1. A key along which no
residual changes, keys of which only a combination changes them, a key at its bound, and one that
the data determine no better than its bounds do, are not identified: they have no standard error.
"""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frictionsim.fits.data import Target
from frictionsim.fits.problem import FitProblem, FreeKey
from frictionsim.fits.search import difference_step, edges

if TYPE_CHECKING:
    from frictionsim.results import Array

CONFIDENCE = 0.95
AT_BOUND = 1e-4  # of the bounds
MIN_SINGULAR = 1e-4  # of derivatives scaled to length 1: smaller ones may be errors of differences
MIN_COMPONENT = 0.1  # of a unit vector: a smaller component is no part of a combination
NO_CHANGE = "the data do not change with it"
NOT_REACHED = "no run within the bounds reaches the data"
NO_DERIVATIVE = "runs fail on both sides of its estimate"
NO_BETTER = "the data determine it no better than its bounds do"
JUMP = "the run jumps or kinks at the estimate; a bootstrap needs no derivatives"
ROUNDING = 1e-7  # of the spread of the data
JUMPS = 0.5  # relative change of derivatives with their step
SIDES = {-1: ("lower", "below"), 1: ("upper", "above")}
SINGLE = "single quantities"
LEAST_SIGMA = 1e-9  # of the spread: least standard deviation


class Noise:
    """The standard deviations of the data, given or estimated."""

    def __init__(self, targets: Iterable[Target]) -> None:
        targets = list(targets)
        # Of each value (n,).
        self.spread = np.concatenate([t.scale for t in targets])
        self.sigma = np.concatenate([t.scale if t.sigma is None else t.sigma for t in targets])
        # Single quantities without sigma, whose errors are relative, have one noise level.
        groups = [t.name if t.column is not None else SINGLE for t in targets]
        of_targets = zip(targets, groups, strict=True)
        names = [group if t.sigma is None else "" for t, group in of_targets for _ in t.values]
        groups = [name for name in dict.fromkeys(names) if name]
        self.groups = [np.array([n == name for n in names]) for name in groups]
        self.all_given = not self.groups
        self.is_to_be_balanced = len(dict.fromkeys(names)) > 1

    def estimate(self, residuals: "Array", determined: int) -> float:
        """Estimate the standard deviations that were not given; return their relative change.

        `determined` is the number of values determined from the data.
        """
        change, share = 0.0, max(1.0 - determined / residuals.size, 0.0)
        for group in self.groups:
            relative = residuals[group] / self.spread[group]
            size = np.sqrt(np.mean(relative**2) / share) if share else np.sqrt(np.mean(relative**2))
            sigma = self.spread[group] * max(float(size), LEAST_SIGMA)
            change = max(change, abs(float(sigma[0] / self.sigma[group][0]) - 1.0))
            self.sigma[group] = sigma
        return change


class Identification(NamedTuple):
    """The identified keys, and the covariance of their places."""

    reasons: dict[str, str]  # why a key is not identified, by key
    # For residuals of standard deviation 1.
    covariance: "Array"  # (keys, keys), of places; NaN of a key that is not identified
    rank: int  # number of keys, or combinations of them, that the data determine
    rough: Mapping[str, str] = {}  # further reasons, which do not concern a bootstrap

    @property
    def deviations(self) -> "Array":
        """The standard errors of the places (keys,); NaN of a key that is not identified."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def correlations(self) -> "Array":
        """The correlations (keys, keys); NaN where a key is not identified."""
        matrix = self.covariance / np.outer(self.deviations, self.deviations)
        np.fill_diagonal(matrix, np.where(np.isfinite(self.deviations), 1.0, np.nan))
        return np.asarray(np.clip(matrix, -1.0, 1.0))

    def without(self, keys: tuple[FreeKey, ...], reasons: Mapping[str, str]) -> "Identification":
        """Return the identification without further keys, given by the reasons to exclude them."""
        reasons = {**reasons, **self.reasons}
        unknown = np.array([key.key in reasons for key in keys])
        covariance = np.where(unknown | unknown[:, None], np.nan, self.covariance)
        return self._replace(reasons=reasons, covariance=covariance)


def identify(problem: FitProblem, x: "Array", jacobian: "Array", spread: "Array") -> Identification:
    """Return the keys identified at a place.

    The derivatives (n, keys) of the residuals, and the spread (n,) of the data, are over the
    standard deviations.
    """
    keys, step = problem.keys, difference_step(problem)
    tolerance = 0.0 if problem.scenario.pair.fixed_step else problem.scenario.solver.rtol
    error = 10.0 * tolerance / step  # of derivatives, relative to the spread
    at_edges = {
        number: f"its estimate is at the edge of valid values,"
        f" {keys[number].value(float(x[number])):.6g}; {SIDES[side][1]} it, {fault}"
        for number, side, fault in edges(problem, x)
    }
    reasons: dict[str, str] = {}
    for j, key in enumerate(keys):
        if np.isnan(jacobian[:, j]).any():
            reasons[key.key] = at_edges.get(j, NO_DERIVATIVE)
        elif np.max(np.abs(jacobian[:, j]) / spread) <= max(ROUNDING, error):
            reasons[key.key] = NO_CHANGE
        elif x[j] < AT_BOUND or x[j] > 1.0 - AT_BOUND:
            side, bound = ("lower", key.low) if x[j] < 0.5 else ("upper", key.high)
            reasons[key.key] = f"its estimate is at the {side} bound {bound:g}; widen the bounds"
        elif j in at_edges:
            reasons[key.key] = at_edges[j]
    active = [j for j, key in enumerate(keys) if key.key not in reasons]
    covariance = np.full((len(keys), len(keys)), np.nan)
    if not active:
        return Identification(reasons, covariance, 0)
    lengths = np.linalg.norm(jacobian[:, active], axis=0)
    _, singular, right = np.linalg.svd(jacobian[:, active] / lengths, full_matrices=False)
    determined = singular > max(MIN_SINGULAR, 10.0 * step**2, error) * singular[0]
    for vector in right[~determined]:
        parts = {
            j: part for j, part in zip(active, vector, strict=True) if abs(part) > MIN_COMPONENT
        }
        sign = "-" if np.prod(list(parts.values())) < 0.0 else ""
        correlation = f" (correlation {sign}1.000)" if len(parts) == 2 else ""
        for j in parts:
            others = " and ".join(keys[i].key for i in parts if i != j)
            reasons[keys[j].key] = (
                f"the data determine only a combination of it and {others}{correlation}; fix one"
            )
    directions = right[determined] / singular[determined, None]
    covariance[np.ix_(active, active)] = directions.T @ directions / np.outer(lengths, lengths)
    return Identification({}, covariance, int(np.sum(determined))).without(keys, reasons)


def misfit_of_noise(keys: int, degrees: int | None) -> float:
    """Return by how much chi squared may exceed its least value within the 95 % region of keys.

    None means given standard deviations; else they were estimated with these degrees of freedom.
    For one key it is the square of the half width of its interval, over the standard error.
    """
    from scipy import special  # imported here: a fit alone needs it

    if degrees is None:
        return float(special.chdtri(keys, 1.0 - CONFIDENCE))
    return keys * float(special.fdtri(keys, degrees, CONFIDENCE))


def autocorrelation(residuals: "Array") -> float:
    """Return the correlation of neighbouring residuals."""
    total = float(np.sum(residuals**2))
    return float(np.sum(residuals[1:] * residuals[:-1])) / total if total > 0.0 else 0.0
