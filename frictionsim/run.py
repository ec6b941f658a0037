"""One run: a scene goes in, sampled courses, transitions and counts come out."""

from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim import backends
from frictionsim.backends.base import Recording, SampleTimes
from frictionsim.errors import Interrupted, SolverError
from frictionsim.mechanisms import module_of
from frictionsim.series import Series

if TYPE_CHECKING:
    from collections.abc import Callable

    from frictionsim.mechanisms.base import Mechanism
    from frictionsim.parameters import Scenario


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
    """A run with its outcome.

    Attributes
    ----------
    status : str
        `done`, `failed` or `interrupted`.
    reason : str
        Why it is not done; empty if it is.
    exit_code : int
        Of the run itself, before any audit.
    """

    scene: "Scenario"
    mechanism: "Mechanism"
    series: Series
    counts: Counts
    status: str
    reason: str
    exit_code: int


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
    mechanism = module_of(scene.kind).build(scene)
    solve = backends.solver_of(scene.solver.backend, mechanism.prescribed)
    recording = Recording(SampleTimes(scene.solver.duration, scene.interval))
    status, reason, exit_code = "done", "", 0
    started = perf_counter()
    try:
        solve(mechanism, scene.solver, recording, poll)
    except Interrupted as stop:
        status, reason, exit_code = "interrupted", str(stop), stop.exit_code
    except SolverError as failure:
        status, reason, exit_code = "failed", str(failure), failure.exit_code
    except ArithmeticError:
        status, reason, exit_code = "failed", OUT_OF_RANGE, SolverError.exit_code
    wall_seconds = perf_counter() - started
    counts = Counts(
        recording.steps,
        recording.rejected,
        recording.evaluations,
        len(mechanism.initial_state),
        wall_seconds,
    )
    samples = _samples(mechanism, recording)
    unsound = np.flatnonzero(~np.isfinite(samples).all(axis=0))
    if unsound.size:  # the samples before the first that is not finite are good
        samples = samples[:, : unsound[0]]
        status, reason, exit_code = "failed", OUT_OF_RANGE, SolverError.exit_code
    series = _series(mechanism, samples, recording)
    return Run(scene, mechanism, series, counts, status, reason, exit_code)


def _samples(mechanism: "Mechanism", recording: Recording) -> Any:
    """Return the samples as an array, a row for each quantity."""
    width = Recording.COLUMNS + len(mechanism.ledger)
    return np.array(recording.rows).reshape(-1, width).T.copy()


def _series(mechanism: "Mechanism", columns: Any, recording: Recording) -> Series:
    time, drive, position, velocity, acceleration, friction, mode = columns[: Recording.COLUMNS]
    return Series(
        time,
        drive,
        position,
        velocity,
        acceleration,
        friction,
        mode,
        ledger=dict(zip(mechanism.ledger, columns[Recording.COLUMNS :], strict=True)),
        stores={
            name: np.asarray(energy(position, velocity))
            for name, energy in mechanism.stores.items()
        },
        transitions=recording.transitions,
    )
