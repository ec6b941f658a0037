"""One run: a scene goes in; courses, transitions, figures, checks and counts come out."""

from collections.abc import Mapping
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.errors import Interrupted, SolverError
from frictionsim.mechanisms import module_of
from frictionsim.quantities import Quantities
from frictionsim.series import Channel, Check, Transition

if TYPE_CHECKING:
    from collections.abc import Callable

    from frictionsim.parameters import Scenario
    from frictionsim.series import Array
    from frictionsim.simulation import Simulation


OUT_OF_RANGE = (
    "a number is beyond the range of double precision; is a force or an inertia far too large or"
    " too small?"
)


class Counts(NamedTuple):
    """What a run took."""

    steps: int
    rejected: int
    rhs_evaluations: int
    states: int
    wall_seconds: float


class Run(NamedTuple):
    """A run with its outcome, as plain data.

    Attributes
    ----------
    effects : tuple of str
        The effects that were simulated.
    channel_info : mapping of name to Channel
        For each course, and maybe for more.
    axes : mapping of name to tuple of str
        The names of the members of each axis that a channel may have.
    time : (n,), s
    courses : dict of (n,) or (n, members of the channel's axis)
        Those to record: all, or those of `output.channels` that the scene has.
    transitions : list of Transition
    quantities : Quantities
        The figures of the summary.
    checks : dict of Check
        The audit.
    status : str
        `done`, `failed` or `interrupted`.
    reason : str
        Why it is not done; empty if it is.
    exit_code : int
        Of the run itself, before any audit.
    remarks : tuple of str
        What a user should know before trusting the figures.
    """

    scene: "Scenario"
    effects: tuple[str, ...]
    channel_info: Mapping[str, Channel]
    axes: Mapping[str, tuple[str, ...]]
    time: "Array"
    courses: dict[str, "Array"]
    transitions: list[Transition]
    quantities: Quantities
    checks: dict[str, Check]
    counts: Counts
    status: str
    reason: str
    exit_code: int
    remarks: tuple[str, ...] = ()

    @property
    def missing_channels(self) -> list[str]:
        """The channels of `output.channels` that the scene has no course for."""
        return [name for name in self.scene.output.channels or () if name not in self.courses]


def run(scene: "Scenario", poll: "Callable[[float], Any]") -> Run:
    """Simulate a scene.

    Parameters
    ----------
    scene : Scenario
    poll : callable
        Called with the time after each step; it may show progress, or raise Interrupted.

    Returns
    -------
    Run
        Also of a run that failed or was interrupted, with the samples up to there.
    """
    simulation: Simulation = module_of(scene.kind).simulation(scene)
    status, reason, exit_code = "done", "", 0
    started = perf_counter()
    try:
        simulation.solve(poll)
    except Interrupted as stop:
        status, reason, exit_code = "interrupted", str(stop), stop.exit_code
    except SolverError as failure:
        status, reason, exit_code = "failed", str(failure), failure.exit_code
    except ArithmeticError:
        status, reason, exit_code = "failed", OUT_OF_RANGE, SolverError.exit_code
    wall_seconds = perf_counter() - started
    seen = simulation.observe()
    if seen.unsound:
        status, reason, exit_code = "failed", OUT_OF_RANGE, SolverError.exit_code
    wanted = scene.output.channels
    return Run(
        scene=scene,
        effects=simulation.effects,
        channel_info=simulation.channel_info,
        axes=simulation.axes,
        time=seen.time,
        courses={
            name: course
            for name, course in seen.courses.items()
            if wanted is None or name in wanted
        },
        transitions=seen.transitions,
        quantities=seen.quantities,
        checks=seen.checks,
        counts=Counts(*simulation.counts(), simulation.states, wall_seconds),
        status=status,
        reason=reason,
        exit_code=exit_code,
        remarks=seen.remarks,
    )
