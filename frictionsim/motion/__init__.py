"""Mechanisms in motion: the parts of a drawing and where they are over time.

A motion is data: plots draw its frames with matplotlib, reports draw them in the browser. Each kind
of mechanism has a function `motion` that makes the motion of a result, or of one of its samples,
whose number is the second argument: a kind of this program in the module of its name here. A kind
of another package may have one in its module; without one its results are shown without a drawing.
"""

from collections.abc import Callable, Sequence
from importlib import import_module
from typing import TYPE_CHECKING

from frictionsim.motion.parts import Motion
from frictionsim.scenario.kinds import KINDS, mechanism_module

if TYPE_CHECKING:
    from frictionsim.results import Record


def motion_of(result: "Record", sample: int | None = None, reduction: float = 1.0) -> Motion | None:
    """Return the mechanism of a result in motion; None if there is no drawing of its kind.

    Parameters
    ----------
    sample : int, optional
        The only one that is drawn; what is counted or measured from the start of the run still is.
    reduction : float
        How much smaller travels are drawn at least, of a kind whose motions have a reduction.
    """
    kind = result.attributes["kind"]
    module = import_module(f"{__name__}.{kind}") if kind in KINDS else mechanism_module(kind)
    function: Callable[..., Motion] | None = getattr(module, "motion", None)
    if function is None:
        return None
    more = {} if reduction <= 1.0 else {"reduction": reduction}
    return function(result, sample, **more)


def motions_compared(
    results: "Sequence[Record]", motions: Sequence[Motion | None]
) -> list[Motion | None]:
    """Return motions of results on one scale of lengths, forces and travels; None stays None."""
    drawn = [motion for motion in motions if motion is not None]
    if len(drawn) < 2:
        return list(motions)
    most = max(motion.reduction for motion in drawn)
    same = [
        motion if motion is None or motion.reduction == most else motion_of(result, None, most)
        for result, motion in zip(results, motions, strict=True)
    ]
    drawn = [motion for motion in same if motion is not None]
    left, right, bottom, top = zip(*(motion.bounds for motion in drawn), strict=True)
    bounds = (min(left), max(right), min(bottom), max(top))
    scale = min((motion.scale for motion in drawn if motion.scale), default=0.0)
    return [
        None if each is None else each._replace(bounds=bounds, scale=scale if each.scale else 0.0)
        for each in same
    ]
