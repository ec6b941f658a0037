"""The parts of a motion, and where they are over time; lengths in m, angles in rad.

Positions and angles between two frames are linear in time, states (`sticking`, `visible`) are those
of the frame before. What is carried round a centre has a `carrier`, so that it stays on its circle
between frames. Whoever draws a motion looks up colours by the name of a `role`.
"""

from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

import numpy as np

from frictionsim.display import CONTACT_WORDS

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    import numpy.typing as npt

    Array = npt.NDArray[np.floating[Any]]
    Bools = npt.NDArray[np.bool_]
    Numbers = npt.NDArray[np.int64]
    Bounds = tuple[float, float, float, float]


ForceRole = Literal["force", "force-2", "force-3", "force-4"]
Role = (
    ForceRole
    | Literal["fixed", "still", "moving", "marked", "load", "path", "friction", "paper", "cut"]
)
"""The role of a part, which gives its colour: a shaft or hinge; a wheel that stands still; one
that moves; what the eye follows, as a mark on a wheel; what hangs, rolls or is carried; a path; a
friction force; a hole, or a line on something dark; the outline of what is beyond the picture;
applied forces and couples, of which each of several has its own."""
FORCE_ROLES: tuple[ForceRole, ...] = get_args(ForceRole)


class Disc(NamedTuple):
    """A disc or, if it is open, a circle, in the coordinates of its body."""

    x: float
    y: float
    radius: float
    role: Role
    open: bool = False


class Line(NamedTuple):
    """Straight lines through points (n, 2), in the coordinates of their body."""

    points: "Array"
    role: Role
    closed: bool = False
    """Closed lines are filled."""


class Body(NamedTuple):
    """A rigid body that turns and moves.

    Attributes
    ----------
    name : str
        For the key; empty if it is not in it.
    shapes : tuple of Disc and Line
        From back to front.
    x, y : (frames,), m
        Position of the origin of its coordinates.
    angle : (frames,), rad
        Counter-clockwise, from the horizontal.
    visible : (frames,) of bool, optional
    carrier : (frames,), rad, optional
        Angle by which x and y are turned about the origin, as by a crank or gear.
    label : bool
        Whether the name stands at its origin, not in the key.
    """

    name: str
    shapes: tuple[Disc | Line, ...]
    x: "Array"
    y: "Array"
    angle: "Array"
    visible: "Bools | None" = None
    carrier: "Array | None" = None
    label: bool = False


class Band(NamedTuple):
    """A belt or cord: a line through n points, coloured by a value.

    Attributes
    ----------
    name : str
    x, y : (frames, n), m
    closed : bool
        Its last point is joined to its first one.
    value : (frames, n) or None
        Of the piece from point i - 1 to point i, as the channel `tension` of joints.
    quantity, unit : str
        What the value is, for the scale of colours.
    touching, sticking : (frames, n) of bool, or None
        Which points touch a pulley, and which of these stick.
    marks : (m,) of int, or None
        Numbers of points that are marked, so that the eye sees the belt run.
    patch : (n,) of bool, or None
        Which points have a friction of their own.
    travel : (frames,), m, or None
        How far a cord has run along its line, which itself may stand still: it is drawn with marks
        at distances `spacing` that run so far.
    spacing : float, m
    role : Role or None
        Of a line that is no cord, as the arc of a torque.
    """

    name: str
    x: "Array"
    y: "Array"
    closed: bool
    value: "Array | None" = None
    quantity: str = ""
    unit: str = ""
    touching: "Bools | None" = None
    sticking: "Bools | None" = None
    marks: "Numbers | None" = None
    patch: "Bools | None" = None
    travel: "Array | None" = None
    spacing: float = 0.0
    role: Role | None = None


class Trail(NamedTuple):
    """The path of a point, drawn stronger behind the point than ahead of it.

    Attributes
    ----------
    name : str
    time : (n,), s
        Its own, finer than the frames where the path needs it.
    x, y : (n,), m
    """

    name: str
    time: "Array"
    x: "Array"
    y: "Array"


class Arrow(NamedTuple):
    """A force: an arrow from a point, as long as the scale of the motion says.

    Attributes
    ----------
    name : str
    x, y : (frames,), m
        Where it begins.
    dx, dy : (frames,), m
        To its tip.
    role : Role
    """

    name: str
    x: "Array"
    y: "Array"
    dx: "Array"
    dy: "Array"
    role: Role


Part = Body | Band | Trail | Arrow


class Readout(NamedTuple):
    """A number beside the drawing, such as an angle or a force.

    Attributes
    ----------
    name : str
    unit : str
    value : (frames,)
    channel, member : str
        The recorded channel that it is, and of which member of its axis; empty for none. A page
        shows it as its charts do, from all samples.
    words : dict of str
        What is shown instead of a number: what a contact does.
    """

    name: str
    unit: str
    value: "Array"
    channel: str = ""
    member: str = ""
    words: "Mapping[int, str]" = {}  # noqa: RUF012  the fields of a NamedTuple are read only


class Detail(NamedTuple):
    """A part of the drawing that is shown larger: its name and its bounds, as of a motion."""

    name: str
    bounds: "Bounds"


class Motion(NamedTuple):
    """A mechanism in motion.

    Attributes
    ----------
    time : (frames,), s
        Increasing.
    parts : tuple of Part
        From back to front.
    bounds : tuple of float, m
        Of the drawing: left, right, bottom, top.
    state : (frames,) of int or None
        Of a mechanism with one contact: 0 sticks, 1 and -1 slip. What several contacts do is in
        `readouts`.
    readouts : tuple of Readout
    details : tuple of Detail
        What is shown larger beside the whole.
    """

    time: "Array"
    parts: tuple[Part, ...]
    bounds: "Bounds"
    state: "Numbers | None" = None
    readouts: tuple[Readout, ...] = ()
    details: tuple[Detail, ...] = ()


class Moment(NamedTuple):
    """A time of a motion: the frame before it, and how far it is from it to the next one."""

    frame: int
    fraction: float

    def of(self, values: Any) -> Any:
        """Return values per frame at this time, linear between frames."""
        here = values[self.frame]
        return here + self.fraction * (values[self.frame + 1] - here) if self.fraction else here


def moment_of(times: "Array", time: float) -> Moment:
    """Return the place of a time among increasing times; times outside are at the ends."""
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


def path_until(trail: "Trail", time: float) -> Any:
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
    return readout.words.get(int(readout.value[moment.frame]), "")


def decimals_of(values: Any) -> int:
    """Return the number of decimals of a read-out: four digits of its largest number."""
    largest = float(np.max(np.abs(values), initial=0.0))
    return max(0, 3 - int(np.floor(np.log10(largest)))) if largest > 0.0 else 3


def state_word(motion: "Motion", moment: Moment) -> str:
    """Return the mode of the one contact of a mechanism; empty if there is none or several."""
    if motion.state is None:
        return ""
    return CONTACT_WORDS.get(int(motion.state[moment.frame]), "")
