"""What acts in a belt drive, as one argument of the kernels."""

from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.mechanisms.belt_drive.kernels.layout import StateLayout

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.effects.base import Chain
    from frictionsim.mechanisms.belt_drive.kernels.signals import Signals

    Array = npt.NDArray[np.float64]
    Indices = npt.NDArray[np.int64]


class Pulleys(NamedTuple):
    """The pulleys: the indices of those whose speed is free, and of those where it is prescribed.

    `table` is (8, pulleys), with the rows of `layout`.
    """

    free: "Indices"
    prescribed: "Indices"
    table: "Array"


class WrapFactors(NamedTuple):
    """The wrap factors of a state.

    Attributes
    ----------
    factor : (contacts,)
        kappa of the body of each candidate.
    mass_ratio : (contacts,)
        1/kappa^2, of the mass that yields to friction over that of the body.
    """

    factor: "Array"
    mass_ratio: "Array"


class Contacts(NamedTuple):
    """The candidates for a contact, bodies near pulleys.

    Those of pulley j are offsets[j] to offsets[j + 1] - 1, in blocks of neighbours: each block is a
    vector of the rows over bodies. Those of no radius, which touch nothing, fill the blocks up, so
    that loops over contacts have no branch.

    `offsets` is (pulleys + 1,), `body` (contacts,), `table` (21, contacts) with the rows of
    `layout`; `saved_modes`, (2, width), has mode and sticking of the bodies during a new search;
    `release`, (1,), is the most by which a body let go below its static limit, over that limit;
    `wrap` has the wrap factors, None where the slip is that of the bodies' centres.
    """

    offsets: "Indices"
    body: "npt.NDArray[np.uint64]"
    table: "Array"
    saved_modes: "Array"
    release: "Array"
    wrap: WrapFactors | None


class FrictionCoefficients(NamedTuple):
    """Coefficients of friction of every body at every pulley, (pulleys, n): static and kinetic."""

    static: "Array"
    kinetic: "Array"


class Plane(NamedTuple):
    """Bodies that move in the plane: those nearer to a rim than `skin`, m, may touch it."""

    skin: float


class PitchLine(NamedTuple):
    """The line that a guided string moves along.

    Attributes
    ----------
    length : float, m
    starts, arcs : (pulleys,), m
        Where the arc of each pulley begins, from where the belt leaves the first pulley, and its
        length.
    senses : (pulleys,)
        +1 where the belt passes a pulley counter-clockwise, else -1.
    runs : (4, runs)
        Runs of candidates, with the rows of `kernels.string`.
    run_count : (1,)
    """

    length: float
    starts: "Array"
    arcs: "Array"
    senses: "Array"
    runs: "Indices"
    run_count: "Indices"


class System(NamedTuple):
    """A belt drive as its kernels see it.

    Attributes
    ----------
    layout : StateLayout
    chain : Chain
        What the bodies have in common.
    effects : named tuple
        The parameters of each effect by its name, None where the scenario lacks it: a kernel that
        finds None is compiled to nothing at all.
    friction : FrictionCoefficients or None
    signals : Signals
        What drives the pulleys.
    workspace : (8, width), of a guided string (3, width)
    contacts : Contacts
    pulleys : Pulleys
    kinematics : Plane or PitchLine
        How the belt can move: kernels of this argument differ by its class.
    """

    layout: StateLayout
    chain: "Chain"
    effects: Any
    friction: FrictionCoefficients | None
    signals: "Signals"
    workspace: "Array"
    contacts: Contacts
    pulleys: Pulleys
    kinematics: Any
