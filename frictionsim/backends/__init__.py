"""The ways to solve a scene, by the name that a scenario gives as `solver.backend`.

A backend is solve(mechanism, settings, recording, poll): it steps the mechanism to
settings.duration, fills the recording with samples, transitions and counts, and calls poll(t)
along the way. It raises SolverError where it cannot go on.
"""

from collections.abc import Callable
from importlib import import_module
from typing import Any

BACKENDS = {
    "events": "frictionsim.backends.events",
    "rkf45": "frictionsim.backends.rkf45",
    "published": "frictionsim.backends.published",
}


# Takes over from each of them where the drive prescribes the velocity.
PRESCRIBED = "frictionsim.backends.prescribed"


def solver_of(name: str, prescribed: bool = False) -> Callable[..., None]:
    """Import a backend and return its `solve`; the others stay unloaded."""
    solve: Callable[..., Any] = import_module(PRESCRIBED if prescribed else BACKENDS[name]).solve
    return solve
