"""Mechanisms in motion: the parts of a drawing and where they are over time.

A motion is data: plots draw its frames with matplotlib, reports draw them in the browser. Each kind
of mechanism has a function that makes the motion of a result; a kind that is not in MOTIONS may
have a function `motion` in its module, and without one its results are shown without a drawing.
"""

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import TYPE_CHECKING

from frictionsim.motion.parts import Motion
from frictionsim.scenario.kinds import mechanism_module

if TYPE_CHECKING:
    from frictionsim.results import Record

MOTIONS: Mapping[str, str] = {
    kind: f"frictionsim.motion.{kind}"
    for kind in ("pulley", "marble_machine", "epicyclic", "belt_drive", "shaft")
}
"""By kind the module whose function `motion` makes the motion of a result."""


def motion_of(result: "Record") -> Motion | None:
    """Return the mechanism of a result in motion; None if there is no drawing of its kind."""
    kind = result.attributes["kind"]
    module = import_module(MOTIONS[kind]) if kind in MOTIONS else mechanism_module(kind)
    function: Callable[[Record], Motion] | None = getattr(module, "motion", None)
    return None if function is None else function(result)
