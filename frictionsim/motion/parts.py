"""The parts of a mechanism in motion, frame by frame; lengths in m, angles in rad.

A frame is a sample of the result. Who draws a motion shows one frame after the other and looks up
colours by the name of a `role` in `frictionsim.display.ROLES`.
"""

from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    import numpy.typing as npt

    Array = npt.NDArray[np.floating[Any]]
    Bools = npt.NDArray[np.bool_]
    Integers = npt.NDArray[np.int64]
    Bounds = tuple[float, float, float, float]

ForceRole = Literal["force", "force-2", "force-3", "force-4"]
Role = (
    ForceRole
    | Literal["fixed", "still", "moving", "marked", "load", "path", "friction", "paper", "cord"]
)
"""What a part is, which gives its colour: a shaft or hinge; a wheel that stands still; one that
moves; what the eye follows, as a mark on a wheel; what hangs, rolls or is carried; a path; a
friction force or reaction; a hole, or a line on something dark; a cord, belt or spring; applied
forces and couples, of which each of several has its own."""
FORCE_ROLES: tuple[ForceRole, ...] = get_args(ForceRole)


class Disc(NamedTuple):
    """A disc or, if it is open, a circle, in the coordinates of its body."""

    x: float
    y: float
    radius: float
    role: Role
    open: bool = False


class Outline(NamedTuple):
    """Straight lines through points (n, 2), in the coordinates of their body; filled if closed."""

    points: "Array"
    role: Role
    closed: bool = False


class Body(NamedTuple):
    """A rigid body that turns and moves.

    Attributes
    ----------
    name : str
        For the key; empty if it is not in it.
    shapes : tuple of Disc and Outline
        From back to front.
    x, y : (frames,), m
        Position of the origin of its coordinates.
    angle : (frames,), rad
        Counter-clockwise, from the horizontal.
    visible : (frames,) of bool, optional
    label : bool
        The name stands at the origin, not in the key.
    """

    name: str
    shapes: tuple[Disc | Outline, ...]
    x: "Array"
    y: "Array"
    angle: "Array"
    visible: "Bools | None" = None
    label: bool = False


class Line(NamedTuple):
    """A belt, cord, spring, path, or the arc of a couple: a line through n points.

    Attributes
    ----------
    name : str
    points : (frames, n, 2), m
        Or (1, n, 2) of a line that stands still.
    role : Role
    closed : bool
        Its last point is joined to its first one.
    value : (frames, n), optional
        Of the piece from point i - 1 to point i, by which it is coloured.
    quantity, unit : str
        What the value, or the size, is.
    stuck : (frames, n) of int, optional
        1 where a point sticks to a pulley, 0 where it slips on one, -1 where it touches none.
    patch : (n,) of bool, optional
        Which points have a friction of their own.
    travel : (frames,), m, optional
        How far a cord has run along its line, which itself may stand still: marks at distances
        `spacing` from its first point run so far.
    spacing : float, m
        From mark to mark; the marks of a closed line stand at its own points, and run with it.
    size : (frames,), optional
        Of a couple of which the line is the arc, N m, positive counter-clockwise.
    """

    name: str
    points: "Array"
    role: Role
    closed: bool = False
    value: "Array | None" = None
    quantity: str = ""
    unit: str = ""
    stuck: "Integers | None" = None
    patch: "Bools | None" = None
    travel: "Array | None" = None
    spacing: float = 0.0
    size: "Array | None" = None


class Arrow(NamedTuple):
    """A force, or bars for the forces on many points.

    Attributes
    ----------
    name : str
    foot : (frames, 2) or (frames, n, 2), m
        Where it begins; n points for bars.
    vector : like foot
        In `unit`; its length in a drawing is that times the scale of the motion.
    role : Role
    unit : str
    """

    name: str
    foot: "Array"
    vector: "Array"
    role: Role
    unit: str = "N"

    @property
    def is_bars(self) -> bool:
        """Whether these are bars, which have no heads."""
        return self.foot.ndim > 2


Part = Body | Line | Arrow


class Readout(NamedTuple):
    """A number beside the drawing, such as an angle, or a word, such as what a contact does.

    Attributes
    ----------
    name, unit : str
    value : (frames,)
    words : mapping
        What is shown instead of a number.
    """

    name: str
    unit: str
    value: "Array"
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
    scale : float, m/N
        Length of an arrow or bar.
    readouts : tuple of Readout
    details : tuple of Detail
        What is shown larger below the whole.
    reduction : float
        How much smaller than the mechanism its travels are drawn.
    """

    time: "Array"
    parts: tuple[Part, ...]
    bounds: "Bounds"
    scale: float = 0.0
    readouts: tuple[Readout, ...] = ()
    details: tuple[Detail, ...] = ()
    reduction: float = 1.0
