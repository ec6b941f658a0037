"""Where the parts of a motion are at any time: what a drawing shows, as the scripts compute it."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.display import CONTACT_WORDS

if TYPE_CHECKING:
    from frictionsim.motion.parts import Array, Band, Body, Motion, Readout, Trail


class Moment(NamedTuple):
    """A time of a motion: the frame before it, and how far it is from it to the next one."""

    frame: int
    fraction: float

    def of(self, values: Any) -> Any:
        """Return values per frame at this time, linear between frames."""
        here = values[self.frame]
        return here + self.fraction * (values[self.frame + 1] - here) if self.fraction else here


def moment_of(times: "Array", time: float) -> Moment:
    """Return the place of a time among increasing times; what is outside is at the ends."""
    if time >= times[-1]:
        return Moment(len(times) - 1, 0.0)
    frame = max(int(np.searchsorted(times, time, side="right")) - 1, 0)
    fraction = (time - times[frame]) / (times[frame + 1] - times[frame])
    return Moment(frame, min(max(float(fraction), 0.0), 1.0))


def place_of(body: "Body", moment: Moment) -> tuple[float, float, float]:
    """Return the position of the origin of a body, m, and its angle, rad."""
    x, y, angle = (float(moment.of(values)) for values in (body.x, body.y, body.angle))
    if body.carrier is not None:
        turned = float(moment.of(body.carrier))
        cosine, sine = np.cos(turned), np.sin(turned)
        x, y = float(cosine * x - sine * y), float(sine * x + cosine * y)
    return x, y, angle


def is_visible(body: "Body", moment: Moment) -> bool:
    """Return whether a body is visible."""
    return body.visible is None or bool(body.visible[moment.frame])


def line_of(band: "Band", moment: Moment) -> Any:
    """Return the points of a belt or cord, (n, 2), m."""
    return np.column_stack([moment.of(band.x), moment.of(band.y)]).astype(float)


def behind(trail: "Trail", time: float) -> Any:
    """Return the path of a point up to a time, (n, 2), m."""
    moment = moment_of(trail.time, time)
    last = [[float(moment.of(trail.x)), float(moment.of(trail.y))]]
    points = np.column_stack([trail.x[: moment.frame + 1], trail.y[: moment.frame + 1]])
    return np.concatenate([points.astype(float), last])


def shown_value(readout: "Readout", moment: Moment) -> float:
    """Return the number of a read-out; a count is that of the frame before."""
    return float(readout.value[moment.frame] if readout.unit == "1" else moment.of(readout.value))


def shown_word(readout: "Readout", moment: Moment) -> str:
    """Return the word of a read-out that has words: that of the frame before."""
    return readout.words.get(str(int(readout.value[moment.frame])), "")


def decimals_of(values: Any) -> int:
    """Return how many decimals of a read-out are shown: four digits of the largest number."""
    largest = float(np.max(np.abs(values), initial=0.0))
    return max(0, 3 - int(np.floor(np.log10(largest)))) if largest > 0.0 else 3


def state_word(motion: "Motion", moment: Moment) -> str:
    """Return the mode of the one contact of a mechanism; empty if there is none or several."""
    if motion.state is None:
        return ""
    return CONTACT_WORDS.get(int(motion.state[moment.frame]), "")
