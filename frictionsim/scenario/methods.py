"""The ways to solve a scenario, by the name that a scenario gives as `solver.backend`.

Which of them can do a scenario is the matter of its kind (`BACKENDS` of
its model). Those for mechanisms of
one coordinate have solution(mechanism, settings, recording), which returns a `Solution`: its run
steps the mechanism to settings.duration, fills the recording with samples and transitions, and
calls on_step along the way.
"""

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    pass


class Backend(NamedTuple):
    """Where a backend is, and what is particular to it.

    Attributes
    ----------
    module : str
    fixed_step : bool
        It takes steps of a given length, `solver.step`.
    regularised : bool
        It smooths dry friction over `solver.transition_speed`.
    integrator : str
        The class of SciPy that steps it; empty for our own integrator.
    implicit : bool
        Stiffness does not shorten its steps.
    """

    module: str
    fixed_step: bool = False
    regularised: bool = False
    integrator: str = ""
    implicit: bool = False

    @property
    def tells_rejected(self) -> bool:
        """Whether its rejected steps are known; SciPy's implicit methods do not tell."""
        return not self.implicit


_REGULARISED = "frictionsim.solvers.regularised"

BACKENDS = {
    "events": Backend("frictionsim.solvers.event_driven"),
    "rkf45": Backend("frictionsim.solvers.set_valued"),
    "published": Backend("frictionsim.solvers.published_pulley", fixed_step=True),
    "moreau": Backend("frictionsim.mechanisms.belt_drive.steppers.moreau", fixed_step=True),
    "regularised": Backend(_REGULARISED, regularised=True),
    "rk45": Backend(_REGULARISED, regularised=True, integrator="RK45"),
    "dop853": Backend(_REGULARISED, regularised=True, integrator="DOP853"),
    "radau": Backend(_REGULARISED, regularised=True, integrator="Radau", implicit=True),
    "bdf": Backend(_REGULARISED, regularised=True, integrator="BDF", implicit=True),
    "lsoda": Backend(_REGULARISED, regularised=True, integrator="LSODA", implicit=True),
}

# Those that solve a mechanism of one coordinate.
SINGLE_DOF = (
    *("events", "rkf45", "published"),
    *("regularised", "rk45", "dop853", "radau", "bdf", "lsoda"),
)

# Those that can do a belt drive: modules with a class `Stepping`.
BELT = {
    "rkf45": "frictionsim.mechanisms.belt_drive.steppers.rkf45",
    "moreau": "frictionsim.mechanisms.belt_drive.steppers.moreau",
    **{
        name: "frictionsim.mechanisms.belt_drive.steppers.scipy"
        for name, b in BACKENDS.items()
        if b.integrator
    },
}
