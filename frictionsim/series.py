"""What a run leaves: its samples as arrays over time, and the transitions of its contact."""

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    Array = npt.NDArray[np.float64]

STICK, FORWARD, BACKWARD = 0, 1, -1


class Transition(NamedTuple):
    """A contact goes over from one mode to another."""

    time: float
    contact: str
    mode_from: int
    mode_to: int
    position: float


class Series(NamedTuple):
    """The samples of a run as arrays over time, and its transitions.

    Attributes
    ----------
    time : (n,), s
    drive : (n,)
        Value of the drive, in its own unit.
    position, velocity, acceleration : (n,), rad, rad/s, rad/s^2
    friction : (n,), N m
    mode : (n,)
        0 sticking, +1 or -1 sliding.
    ledger : dict of (n,), J
        The energies that were integrated along: into the mechanism, and out of it as heat.
    stores : dict of (n,), J
        The energies that the state has.
    transitions : list of Transition
    """

    time: "Array"
    drive: "Array"
    position: "Array"
    velocity: "Array"
    acceleration: "Array"
    friction: "Array"
    mode: "Array"
    ledger: dict[str, "Array"]
    stores: dict[str, "Array"]
    transitions: list[Transition]
