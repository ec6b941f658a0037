"""The parts of a mechanism in motion, frame by frame; lengths in m, angles in rad.

A frame is a sample of the result. Who draws a motion shows one frame after the other and looks up
colours by the name of a `role` in `frictionsim.display.ROLES`.
"""

from math import floor, log10
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

import numpy as np

from frictionsim.display import unit_text, with_minus

if TYPE_CHECKING:
    from collections.abc import Mapping

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
    """A rigid body that turns and moves."""

    name: str  # for the key; empty if it is not in it
    shapes: tuple[Disc | Outline, ...]  # from back to front
    x: "Array"  # (frames,), m; position of the origin of its coordinates
    y: "Array"
    angle: "Array"  # (frames,), rad; counter-clockwise, from the horizontal
    visible: "Bools | None" = None  # (frames,) of bool
    label: bool = False  # the name stands at the origin, not in the key


class Line(NamedTuple):
    """A belt, cord, spring, path, or the arc of a couple: a line through n points."""

    name: str
    points: "Array"  # (frames, n, 2), m; or (1, n, 2) of a line that stands still
    role: Role
    closed: bool = False  # its last point is joined to its first one
    # (frames, n); of the piece from point i - 1 to point i, by which it is coloured.
    value: "Array | None" = None
    quantity: str = ""  # what the value, or the size, is
    unit: str = ""
    # (frames, n) of int; 1 where a point sticks to a pulley, 0 where it slips on one, -1 where it
    # touches none.
    stuck: "Integers | None" = None
    patch: "Bools | None" = None  # (n,) of bool; which points have a friction of their own
    # (frames,), m; how far a cord has run along its line, which itself may stand still: marks at
    # distances `spacing` from its first point run so far.
    travel: "Array | None" = None
    # m, from mark to mark; the marks of a closed line stand at its own points, and run with it.
    spacing: float = 0.0
    # (frames,); of a couple of which the line is the arc, N m, positive counter-clockwise.
    size: "Array | None" = None


class Arrow(NamedTuple):
    """A force, or bars for the forces on many points."""

    name: str
    foot: "Array"  # (frames, 2) or (frames, n, 2), m; where it begins; n points for bars
    vector: "Array"  # in `unit`; its length in a drawing is that times the scale of the motion
    role: Role
    unit: str = "N"

    @property
    def is_bars(self) -> bool:
        """Whether these are bars, which have no heads."""
        return self.foot.ndim > 2

    @property
    def size(self) -> "Array":
        """The size of the force, (frames,), or of each bar, (frames, n)."""
        return np.hypot(self.vector[..., 0], self.vector[..., 1])


Part = Body | Line | Arrow


ROUNDOFF = 1e-9  # of the largest number: what is smaller is shown as 0


def texts(values: Any, unit: str) -> list[str]:
    """Return numbers with their unit, with four digits of the largest; roundoff is 0."""
    largest = float(np.max(np.abs(values), initial=0.0))
    clean = np.where(np.abs(values) > ROUNDOFF * largest, values, 0.0).tolist()
    digits = 3 - floor(log10(largest)) if largest > 0.0 else 0
    code = "d" if unit == "1" else f".{max(digits, 0)}f" if -3 < digits < 8 else ".3e"
    ending = f" {unit_text(unit)}".rstrip()
    return [with_minus(f"{int(v) if code == 'd' else v:{code}}") + ending for v in clean]


class Readout(NamedTuple):
    """A number beside the drawing, such as an angle, or a word, such as what a contact does."""

    name: str
    unit: str
    value: "Array"  # (frames,)
    # What is shown instead of a number.
    words: "Mapping[int, str]" = {}  # noqa: RUF012  the fields of a NamedTuple are read only

    @property
    def texts(self) -> list[str]:
        """What stands beside the drawing at each frame."""
        if self.words:
            return [self.words.get(int(value), "") for value in self.value]
        return texts(self.value, self.unit)


class Detail(NamedTuple):
    """A part of the drawing that is shown larger: its name and its bounds, as of a motion."""

    name: str
    bounds: "Bounds"


class Motion(NamedTuple):
    """A mechanism in motion."""

    time: "Array"  # (frames,), s; increasing
    parts: tuple[Part, ...]  # from back to front
    bounds: "Bounds"  # m; of the drawing: left, right, bottom, top
    scale: float = 0.0  # m/N; length of an arrow or bar
    readouts: tuple[Readout, ...] = ()
    details: tuple[Detail, ...] = ()  # what is shown larger below the whole
    reduction: float = 1.0  # how much smaller than the mechanism its travels are drawn
