"""The ways to solve a scene, by the name that a scenario gives as `solver.backend`.

Which of them can do a scene is the matter of its kind (`Scene.BACKENDS`). Those for mechanisms of
one coordinate are solve(mechanism, settings, recording, poll): it steps the mechanism to
settings.duration, fills the recording with samples, transitions and counts, and calls poll(t)
along the way. It raises SolverError where it cannot go on.
"""

from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple


class Backend(NamedTuple):
    """Where a backend is, and whether it takes steps of a given length, `solver.step`."""

    module: str
    fixed_step: bool = False


BACKENDS = {
    "events": Backend("frictionsim.backends.events"),
    "rkf45": Backend("frictionsim.backends.rkf45"),
    "published": Backend("frictionsim.backends.published", fixed_step=True),
    "moreau": Backend("frictionsim.backends.belt_moreau", fixed_step=True),
}

# Those that can do a belt drive: modules with a class `Stepping`.
BELT = {
    "rkf45": "frictionsim.backends.belt_rkf45",
    "moreau": "frictionsim.backends.belt_moreau",
}

# Takes over from each of them where the drive prescribes the velocity.
PRESCRIBED = "frictionsim.backends.prescribed"


def solver_of(name: str, prescribed: bool = False) -> Callable[..., None]:
    """Import a backend and return its `solve`; the others stay unloaded."""
    module = PRESCRIBED if prescribed else BACKENDS[name].module
    solve: Callable[..., Any] = import_module(module).solve
    return solve
