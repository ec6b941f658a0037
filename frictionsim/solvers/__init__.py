"""The ways to integrate a mechanism of one coordinate.

Each module has solution(mechanism, settings, recording), which returns a `Solution`: its run steps
the mechanism to settings.duration, fills the recording with samples and transitions, and polls
along the way.
"""

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any

from frictionsim.scenario.methods import BACKENDS

if TYPE_CHECKING:
    from frictionsim.solvers.base import Solution


# Takes over from each of them where the drive prescribes the velocity.
PRESCRIBED = "frictionsim.solvers.prescribed_motion"


def solution_of(name: str, prescribed: bool = False) -> Callable[..., "Solution"]:
    """Import a backend and return its `solution`; the others stay unloaded."""
    module = PRESCRIBED if prescribed else BACKENDS[name].module
    solution: Callable[..., Any] = import_module(module).solution
    return solution
