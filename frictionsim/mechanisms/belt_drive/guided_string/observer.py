"""What is seen of a guided string: the channels of a belt, with its points as bodies."""

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.errors import Diverged
from frictionsim.mechanisms.belt_drive.kernels.layout import (
    ARC_LENGTH,
    ARC_START,
    MIDDLE,
    POSITION,
    PULLEY_RADIUS,
    RADIUS,
    TENSION,
    VELOCITY,
)
from frictionsim.mechanisms.belt_drive.sampling import Observer, adhesion

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.composition import BeltModel
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

    Array = npt.NDArray[np.float64]


# Of the pretension: a belt whose tension is above mass_per_length times speed squared by less than
# that is about to lift off. Its friction fades before it does.
LIGHT = 0.02


class StringObserver(Observer):
    """Samples of a guided string."""

    def __init__(self, scenario: "BeltDriveScenario", model: "BeltModel") -> None:
        super().__init__(scenario, model)
        self._pretension = float(np.mean(model.equilibrium.tension))
        self._path = scenario.mechanism.path()

    def check_belt(self, stepper: Any) -> None:
        """Stop where points have passed each other.

        Raises
        ------
        Diverged
        """
        position = self._kinematics(stepper.interpolate(stepper.t))[POSITION]
        spacing = np.diff(position, append=position[0] + self._path.length)
        if np.min(spacing) <= 0.0:
            raise Diverged(
                f"bodies {int(np.argmin(spacing))} and the next have passed each other at"
                f" t = {stepper.t:.9g} s: a belt without effects.contact does not sag, but is"
                " pressed together; raise mechanism.belt.pretension, or add [effects.contact]"
            )

    def _places(self, kinematics: "Array") -> dict[str, "Array"]:
        rounds = np.floor(kinematics[POSITION] / self._path.length)
        within = kinematics[POSITION] - rounds * self._path.length
        points = self._path.at(np.minimum(within, np.nextafter(self._path.length, 0.0)))
        return {
            "x": points.position[:, 0],
            "y": points.position[:, 1],
            "angle": points.angle + rounds * self._path.total_turning,
        }

    def _tension(self, kinematics: "Array") -> "Array":
        tension: Array = self._system.workspace[TENSION, : self._bodies].copy()
        return tension

    def _belt_speed(self, kinematics: "Array") -> float:
        return float(np.mean(kinematics[VELOCITY]))

    def _contact_counts(self, channels: dict[str, "Array"]) -> dict[str, "Array"]:
        """Return how many bodies' lengths are on each pulley, and on how many of them it sticks.

        They are exact: parts of lengths count as such. And over which angle, rad, they are hardly
        pressed on it.
        """
        middle, normal = self._system.workspace[MIDDLE], channels["normal_force"]
        contacts, length = self._system.contacts, self._system.chain.length
        radius = self._system.pulleys.table[PULLEY_RADIUS]
        touching, stuck, unpressed = np.zeros((3, len(radius)))
        for j, ends in enumerate(pairwise(contacts.offsets)):
            table = contacts.table[:, slice(*ends)]
            filled = table[RADIUS] > 0.0
            body = contacts.body[slice(*ends)][filled].astype(np.int64)
            start, arc = table[ARC_START, filled], table[ARC_LENGTH, filled]
            part = np.clip(middle[body + 1] - start, 0.0, arc)
            part -= np.clip(middle[body] - start, 0.0, arc)
            on = channels["pulley_index"][body] == j
            light = normal[body] * radius[j] < LIGHT * self._pretension * part
            touching[j] = np.sum(part[on]) / length
            stuck[j] = adhesion(channels, body[on], part[on]) / length
            unpressed[j] = np.sum(part[light]) / radius[j]
        return {"_touching": touching, "_sticking": stuck, "_unpressed": unpressed}
