"""The noise of measured data: standard deviations that were given, or are estimated."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.parameter_study.fit_data import Target

    Array = npt.NDArray[np.float64]

EXACT = 1e-9  # of the spread: data are not taken to be more exact


class Noise:
    """The standard deviations of the data, given or estimated.

    Attributes
    ----------
    sigma : (n,)
    spread : (n,)
        Of the data.
    """

    def __init__(self, targets: "Iterable[Target]") -> None:
        targets = list(targets)
        self.spread = np.concatenate([t.scale for t in targets])
        self.sigma = np.concatenate([t.scale if t.sigma is None else t.sigma for t in targets])
        names = [t.group if t.sigma is None else "" for t in targets for _ in t.values]
        groups = [name for name in dict.fromkeys(names) if name]
        self.groups = [np.array([n == name for n in names]) for name in groups]
        self.all_given = not self.groups
        self.is_to_be_balanced = len(dict.fromkeys(names)) > 1

    def estimate(self, residuals: "Array", determined: int) -> float:
        """Estimate the standard deviations that were not given; return their relative change.

        Parameters
        ----------
        residuals : (n,)
        determined : int
            How many values were determined from the data.
        """
        change, left = 0.0, max(1.0 - determined / residuals.size, 0.0)
        for group in self.groups:
            relative = residuals[group] / self.spread[group]
            size = np.sqrt(np.mean(relative**2) / left) if left else np.sqrt(np.mean(relative**2))
            sigma = self.spread[group] * max(float(size), EXACT)
            change = max(change, abs(float(sigma[0] / self.sigma[group][0]) - 1.0))
            self.sigma[group] = sigma
        return change
