"""The part of a run that the means of a belt's summary are over.

With a patch the motion repeats as often as the belt goes round, with sines of one frequency as
often as they do: the means are over whole periods then. Else they are over the last fifth.
"""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.effects.patch import patch_bodies
from frictionsim.scenario.signal_tables import SineTable
from frictionsim.simulation.averages import (
    LAST_PART,
    last_part,
    last_periods,
    last_seconds,
    smooth_mean,
    time_mean,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.model import BeltModel
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

    Array = npt.NDArray[np.float64]


class Averaging(NamedTuple):
    """The samples that means are over.

    Attributes
    ----------
    samples : (n,) of bool
    periods : int
        How many whole periods they are; none for the last fifth.
    to_go : (n,) or None
        Periods from each sample to the end of the run, of a motion that has one.
    """

    samples: "npt.NDArray[np.bool_]"
    periods: int
    to_go: "Array | None"

    @property
    def words(self) -> str:
        """What they are, for messages."""
        if not self.periods:
            return f"the last {round(100.0 * LAST_PART)} % of the run"
        return f"the last {self.periods} whole period{'s' if self.periods > 1 else ''} of the run"

    def mean_speed(self, time: "Array", speed: "Array") -> Any:
        """Return the mean of speeds, (n, ...), whose ripple is not to be left over."""
        mean = time_mean if self.periods else smooth_mean
        return mean(time[self.samples], speed[self.samples])


def averaging_of(
    scenario: "BeltDriveScenario", model: "BeltModel", time: "Array", seen: "dict[str, Array]"
) -> Averaging:
    """Return what the means of a run are over."""
    to_go = _periods_to_go(scenario, model, time, seen)
    periods = 0 if to_go is None else last_periods(time, to_go)
    if to_go is None or periods == 0:
        return Averaging(last_part(time), 0, to_go)
    first = int(np.argmin(np.abs(to_go - periods)))
    return Averaging(last_seconds(time, time[-1] - time[first]), periods, to_go)


def _periods_to_go(
    scenario: "BeltDriveScenario", model: "BeltModel", time: "Array", seen: "dict[str, Array]"
) -> "Array | None":
    """Return the periods from each sample to the end; None of a motion that has not one period."""
    terms = [term for drive in scenario.drive.values() for term in drive.terms]
    sines = [term.sine for term in terms if isinstance(term, SineTable)]
    frequencies = {sine.frequency_hz for sine in sines if sine.amplitude}
    chain, speed = model.system.chain, seen["_belt_speed"]
    patched = bool(patch_bodies(scenario.effects.patch, chain).any())
    if len(frequencies) + patched != 1:
        return None
    if frequencies:
        return np.asarray((time[-1] - time) * frequencies.pop())
    stretch = float(np.mean(seen["_mean_tension"])) / scenario.mechanism.belt.axial_rigidity
    passed = np.append(0.0, np.cumsum(0.5 * np.diff(time) * (speed[1:] + speed[:-1])))
    return np.abs(passed[-1] - passed) / (chain.length * chain.bodies * (1.0 + stretch))
