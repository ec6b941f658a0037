"""What a fit found, as plain data."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.results import finite

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.parameter_study.fit_data import Measured
    from frictionsim.parameter_study.fit_keys import FreeKey
    from frictionsim.parameter_study.fit_search import Start
    from frictionsim.scenario.settings import Scenario

    Array = npt.NDArray[np.float64]

DONE, STOPPED = "done", "stopped"
REACHED, OUT_OF_REACH, FLAT, PLATEAU = "reached", "out_of_reach", "flat", "plateau"
EQUAL_MINIMA, MINIMUM = "equal_minima", "minimum"


class Finding(NamedTuple):
    """What kind of estimate a search has found.

    Attributes
    ----------
    kind : str
        `reached`: the fit gives the data exactly. `out_of_reach`: no run within the bounds gives
        the single value of the data. `flat`: the data do not change with any key. `plateau`: they
        do not near the estimate. `equal_minima`: several searches ended elsewhere with the same
        residual. Else `minimum`.
    sentence : str
    reachable : (float, float) or None
        The least and the largest value that runs gave, of a fit to a single value.
    """

    kind: str
    sentence: str
    reachable: tuple[float, float] | None = None


class TargetResiduals(NamedTuple):
    """The residuals of a channel or quantity: data minus fit.

    Attributes
    ----------
    name, unit : str
    column : str, int or None
        Of the data; None of a value that was given.
    data_unit : str
        The unit that the data were read in.
    values : (n,)
    fitted : (n,)
        What the fitted scenario gives.
    rms, largest : float
        Root mean square and largest magnitude, in the unit.
    sigma : float or None
        Standard deviation of the data, given (the mean of several) or estimated; None if it cannot
        be estimated.
    sigma_given : bool
    worst : float or None
        The largest magnitude over its sigma, where that was given.
    autocorrelation : float or None
        Of neighbouring residuals of a time series.
    """

    name: str
    unit: str
    column: str | int | None
    data_unit: str
    values: "Array"
    fitted: "Array"
    rms: float
    largest: float
    sigma: float | None
    sigma_given: bool
    worst: float | None
    autocorrelation: float | None


class Bootstrap(NamedTuple):
    """Bootstrap resamples of a fit.

    Attributes
    ----------
    done : int
        Fits that ended.
    failed : int
    intervals : dict of (float, float) or None
        From the 2.5 to the 97.5 percentile, by key; None where it is not identified.
    values : (done, keys)
    """

    done: int
    failed: int
    intervals: dict[str, tuple[float, float] | None]
    values: "Array"


class Outcome(NamedTuple):
    """What a fit found.

    Attributes
    ----------
    fitted : Scenario
        The scenario with the estimates.
    keys : tuple of FreeKey
    data : Measured
    values : dict of float
        The estimates.
    standard_errors : dict of float or None
        None where a key is not identified.
    intervals : dict of (float, float) or None
        95 %.
    correlations : (keys, keys)
        NaN where a key is not identified.
    not_identified : dict of str
        Why, by key.
    residuals : tuple of TargetResiduals
    chi_squared : float or None
        Sum of the squared residuals over their sigma; None unless every sigma was given.
    degrees : int
        Values minus what was determined from them.
    status : str
        `done`, or `stopped` where the search reached its limit of iterations.
    reason : str
    finding : Finding
    starts : list of Start
        By their costs.
    warnings : tuple of str
    bootstrap : Bootstrap or None
    runs : int
    """

    fitted: "Scenario"
    keys: "tuple[FreeKey, ...]"
    data: "Measured"
    values: dict[str, float]
    standard_errors: dict[str, float | None]
    intervals: dict[str, tuple[float, float] | None]
    correlations: "Array"
    not_identified: dict[str, str]
    residuals: tuple[TargetResiduals, ...]
    chi_squared: float | None
    degrees: int
    status: str
    reason: str
    finding: Finding
    starts: "list[Start]"
    warnings: tuple[str, ...]
    bootstrap: Bootstrap | None
    runs: int

    @property
    def reduced_chi_squared(self) -> float | None:
        """chi_squared over the degrees of freedom; None where either is not there."""
        if self.chi_squared is None or not self.degrees:
            return None
        return self.chi_squared / self.degrees


def outcome_json(found: Outcome, source: str, overrides: Mapping[str, Any]) -> dict[str, Any]:
    """Return the JSON object of a fit.

    Parameters
    ----------
    found : Outcome
    source : str
        Path of the scenario.
    overrides : mapping
        Of its keys, without those that were fitted.
    """
    bootstrap = found.bootstrap
    return {
        "scenario": source,
        "overrides": dict(overrides),
        "kind": found.fitted.kind,
        "status": found.status,
        "reason": found.reason,
        "finding": found.finding.kind,
        "sentence": found.finding.sentence,
        "reachable": None if found.finding.reachable is None else list(found.finding.reachable),
        "keys": {key.key: _key_json(found, key) for key in found.keys},
        "correlations": [[finite(float(c)) for c in row] for row in found.correlations],
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
            for r in found.residuals
        },
        "chi_squared": finite(found.chi_squared),
        "reduced_chi_squared": finite(found.reduced_chi_squared),
        "degrees_of_freedom": found.degrees,
        "starts": [start._asdict() for start in found.starts],
        "bootstrap": None
        if bootstrap is None
        else {"done": bootstrap.done, "failed": bootstrap.failed},
        "runs": found.runs,
        "warnings": list(found.warnings),
    }


def _key_json(found: Outcome, key: "FreeKey") -> dict[str, Any]:
    name, bootstrap = key.key, found.bootstrap
    interval = found.intervals[name]
    drawn = None if bootstrap is None else bootstrap.intervals[name]
    return {
        "value": found.values[name],
        "standard_error": found.standard_errors[name],
        "interval": None if interval is None else list(interval),
        "bootstrap_interval": None if drawn is None else list(drawn),
        "unit": key.unit,
        "bounds": [key.low, key.high],
        "start": key.start,
        "not_identified": found.not_identified.get(name),
    }
