"""Mechanisms in motion: the parts of a drawing and where they are over time.

A motion is data: plots draw its frames with matplotlib, reports draw them in the browser. Each kind
of mechanism has a function `motion` that makes the motion of a result: a kind of this program in
the module of its name here. A kind of another package may have one in its module; without one its
results are shown without a drawing.
"""

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING

from frictionsim.motion.parts import Motion
from frictionsim.scenario.kinds import KINDS, mechanism_module

if TYPE_CHECKING:
    from frictionsim.results import Record


def motion_of(result: "Record") -> Motion | None:
    """Return the mechanism of a result in motion; None if there is no drawing of its kind."""
    kind = result.attributes["kind"]
    module = import_module(f"{__name__}.{kind}") if kind in KINDS else mechanism_module(kind)
    function: Callable[[Record], Motion] | None = getattr(module, "motion", None)
    return None if function is None else function(result)
