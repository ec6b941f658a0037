"""The search of a fit: a scan of the bounds, least squares from its best points.

Stick-slip puts kinks into the residual: a sample changes its slope where a breakaway passes its
time, and the sum of squares has several minima. So the bounds are scanned first, and the local
search (`scipy.optimize.least_squares`, trust region reflective) starts from several points. Keys
are scaled to their bounds. Derivatives are central differences whose step is far above the
tolerance of the runs, and short against what moves an event from one sample to the next.

A failed run has a residual much larger than the data, so that the search turns back.

A single value that the local searches have not reached is bracketed: between two places whose
residuals differ in sign, Brent's method finds the place at which the scenario gives the value, or
jumps over it.
"""

import multiprocessing
from collections.abc import Iterator, Sequence
from concurrent.futures import BrokenExecutor
from itertools import pairwise
from math import ceil
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import SolverError
from frictionsim.fits.problem import FitProblem, Model, latin_hypercube
from frictionsim.sweeps.workers import available_cores, process_pool

if TYPE_CHECKING:
    from frictionsim.results import Array

FAILED = 1e6  # residual of a failed run, in units of the spread or the size of the data
SCANNED = 12  # points for each start
APART = 0.1  # of the bounds: least distance of starts
MIN_STEP, MAX_STEP = 3e-4, 1e-2  # of differences, as a part of the bounds
FIXED_STEP = 3e-3  # where the error of the runs is not known from a tolerance
SHORTER = (0.25, 0.0625)  # steps of differences, in a check of the derivatives
DISAGREE = 0.1  # relative: derivatives of a shorter step are taken
TOLERANCE = 1e-10  # relative change of the places, and of the sum of squares, at the end
NO_SLOPE = 1e-15  # of the gradient: the data do not change with any key
MAX_ITERATIONS = 60
EVALUATIONS_OF_A_KEY = 10  # in a local search: some five derivatives by two evaluations each
RESOLVED = 1e-12  # of the distance of the ends of a bracket
EDGE = 1e-9  # of the bounds: resolution of the edge of failing runs
MAX_BISECTIONS, MAX_BRACKETS = 100, 4
SECONDS_THAT_PAY = 2.0  # of searches, for a pool of processes
PARTS = 8  # of the searches of a process, for the balance of their times


class Minimum(NamedTuple):
    """The end of a local search; a cost is half the weighted sum of squares."""

    start: "Array"  # place (keys,)
    x: "Array"  # place of the end
    first_cost: float
    cost: float
    converged: bool = True
    # Values of the scenario on both sides, if it jumps over a single value there.
    jump: tuple[float, float] | None = None


class _Failed(Exception):
    """A run within a bracket failed."""


class Search:
    """Weighted residuals and their derivatives, of the data or of values that replace them (n,)."""

    def __init__(
        self, problem: FitProblem, weights: "Array", measured: "Array | None" = None
    ) -> None:
        self.problem, self.weights = problem, weights
        self.measured = problem.data.values if measured is None else measured
        solver = problem.scenario.solver
        # The cube root of the error of the runs gives the least error of a central difference.
        step = min(max(float(np.cbrt(solver.rtol)), MIN_STEP), MAX_STEP)
        self.step = FIXED_STEP if problem.scenario.pair.fixed_step else step

    def residual(self, x: "Array") -> "Array":
        """Return the weighted residuals at a place; large ones of a failed run."""
        model = self.problem.model(x).values
        if model is None:
            size = np.maximum(self.problem.data.scale, np.abs(self.measured))
            return np.asarray(self.weights * size * FAILED)
        return np.asarray((model - self.measured) * self.weights)

    def cost(self, x: "Array") -> float:
        """Return half the weighted sum of squares."""
        return 0.5 * float(np.sum(self.residual(x) ** 2))

    def jacobian(self, x: "Array", step: float | None = None) -> "Array":
        """Return the derivatives (n, keys) of the weighted residuals by the places.

        Central differences; one-sided of second order at a bound, of first order next to a failed
        run.
        """
        return np.array([self._slope(x, j, step or self.step) for j in range(len(x))]).T

    def checked_jacobian(self, x: "Array") -> "tuple[Array, Array]":
        """Return the derivatives, and their relative changes (keys,) with the step.

        Where a step passes a jump or a kink, such as an appearing event, shorter ones are tried.
        """
        jacobian, changes = self.jacobian(x), np.full(len(x), np.inf)
        for part in SHORTER:
            shorter = self.jacobian(x, part * self.step)
            size = np.maximum(np.linalg.norm(jacobian, axis=0), np.linalg.norm(shorter, axis=0))
            change = np.linalg.norm(shorter - jacobian, axis=0) / np.where(size > 0.0, size, 1.0)
            changes = np.where(changes > DISAGREE, change, changes)
            if (changes <= DISAGREE).all():
                break
            jacobian = np.where(changes > DISAGREE, shorter, jacobian)
        return jacobian, changes

    def _slope(self, x: "Array", j: int, h: float) -> "Array":
        def values_at(distance: float) -> "Array | None":
            place = x.copy()
            place[j] += distance
            return self.problem.model(place).values

        here = self.problem.model(x).values
        h = -h if x[j] > 0.5 else h  # away from the nearer bound
        far, near = values_at(h), values_at(-h) if 0.0 <= x[j] - h <= 1.0 else None
        slope = np.zeros(self.measured.size)
        if far is not None and near is not None:
            slope = (far - near) / (2.0 * h)
        elif far is not None and here is not None:
            further = values_at(2.0 * h)
            slope = (far - here) / h
            if further is not None:
                slope = (4.0 * far - further - 3.0 * here) / (2.0 * h)
        elif near is not None and here is not None:
            slope = (here - near) / h
        return np.asarray(slope * self.weights)

    def minimum(self, start: "Array") -> Minimum:
        """Return the local minimum of the least squares that start at a place."""
        from scipy.optimize import least_squares  # imported here because SciPy takes 0.3 s

        solution: Any = least_squares(
            self.residual,
            np.clip(start, 0.0, 1.0),
            jac=self.jacobian,
            bounds=(0.0, 1.0),
            method="trf",
            ftol=TOLERANCE,
            xtol=TOLERANCE,
            gtol=NO_SLOPE,
            max_nfev=MAX_ITERATIONS,
        )
        x, cost = np.asarray(solution.x), float(solution.cost)
        return Minimum(start, x, self.cost(start), cost, solution.status > 0)

    def alone(self, start: "Array") -> tuple[Minimum, int, dict[bytes, Model]]:
        """Return the minimum from a start, as another process may find it.

        Second and third are the number of runs and, of a single value, the models.
        """
        problem = self.problem.apart(start, 2.0 * self.step)
        minimum = Search(problem, self.weights, self.measured).minimum(start)
        return minimum, problem.runs, problem.models if problem.data.size == 1 else {}

    def root_between(self, first: "Array", last: "Array") -> Minimum | None:
        """Return the place between two others that gives a single value, by Brent's method.

        The residual of the value differs in sign at these places. Of a jump over the value, the
        nearer side is returned; None if a run in between fails.
        """
        from scipy.optimize import brentq

        problem, wanted = self.problem, self.measured[0]
        # Brent's last bracket: the part of the distance and the residual of the last run below the
        # value, and of the last one above it.
        ends: dict[bool, tuple[float, float]] = {}

        def residual(part: float) -> float:
            model = problem.model(first + part * (last - first)).values
            if model is None:
                raise _Failed
            excess = float(model[0] - wanted)
            ends[excess > 0.0] = part, excess
            return excess

        try:
            root = float(
                brentq(residual, 0.0, 1.0, xtol=RESOLVED, maxiter=MAX_BISECTIONS, disp=False)
            )
        except _Failed:
            return None
        residual(root)
        part, _ = min(ends.values(), key=lambda end: abs(end[1]))
        x = first + part * (last - first)
        jump = None
        if not problem.is_exact(x):
            jump = wanted + ends[False][1], wanted + ends[True][1]
        return Minimum(first, x, self.cost(first), self.cost(x), jump=jump)


def minima(searches: "Sequence[tuple[Search, Array]]") -> list[Minimum]:
    """Return the minima of searches of one problem, each from its start.

    They go over the cores where they are expected to take seconds; the minima and the number of
    runs do not depend on that.
    """
    problem = searches[0][0].problem
    evaluations = EVALUATIONS_OF_A_KEY * len(problem.keys) * len(searches)
    pays = evaluations * problem.seconds_each > SECONDS_THAT_PAY
    # A process of a pool that is not ours may have none of its own.
    pays = pays and not multiprocessing.current_process().daemon
    workers = min(available_cores(), len(searches)) if pays else 1
    size, ends = ceil(len(searches) / (PARTS * workers)), []
    try:
        with process_pool(workers) as pool:
            parts = [searches[first : first + size] for first in range(0, len(searches), size)]
            for future in [pool.submit(_alone, part) for part in parts]:
                for minimum, runs, models in future.result():
                    ends.append(minimum)
                    problem.runs += runs
                    problem.models |= models
                    if workers > 1:
                        problem.on_runs(runs)
    except BrokenExecutor:
        raise SolverError(
            "a process of the fit was ended from outside, as where the memory is short; nothing of"
            " the fit is kept"
        ) from None
    return ends


def _alone(
    searches: "Sequence[tuple[Search, Array]]",
) -> list[tuple[Minimum, int, dict[bytes, Model]]]:
    return [search.alone(start) for search, start in searches]


def search(problem: FitProblem, weights: "Array", starts: int, seed: int) -> list[Minimum]:
    """Return the minima of all local searches in the order of their costs.

    A single search starts from the starts of the keys, without a scan. The seed draws the scanned
    points.
    """
    task, keys = Search(problem, weights), problem.keys
    initial = np.array([key.scaled(key.start) for key in keys])
    points = [initial]
    if starts > 1:
        rng = np.random.default_rng(seed)
        points += list(latin_hypercube(SCANNED * starts, len(keys), rng))
    working = _that_work(problem, points)
    if not working and problem.data.size == 1:
        points += list(_grid())
        working = _that_work(problem, points)
    if not working:
        all_failed = f"all {len(points)} runs of the fit failed; that of the start"
        failure = "the run of the fit failed" if len(points) == 1 else all_failed
        raise SolverError(f"{failure}: {problem.model(initial).reason}")
    found = minima([(task, start) for start in _best_apart(working, task, starts)])
    if problem.data.size == 1 and not any(problem.is_exact(end.x) for end in found):
        found = [*_bracketed(task), *found]
    return sorted(found, key=lambda end: end.cost)


def _that_work(problem: FitProblem, points: "list[Array]") -> "list[Array]":
    """Return the places at which the runs succeed."""
    return [point for point in points if problem.model(point).values is not None]


def _grid() -> "Array":
    """Return equidistant places of a single key, with its bounds (n, 1)."""
    return np.linspace(0.0, 1.0, SCANNED + 1)[:, None]


def _best_apart(points: "list[Array]", task: Search, starts: int) -> "list[Array]":
    """Return the best points that are at least `APART` from each other."""
    chosen: list[Array] = []
    for point in sorted(points, key=task.cost):
        if all(np.max(np.abs(point - other)) >= APART for other in chosen):
            chosen.append(point)
        if len(chosen) == starts:
            break
    return chosen


def _bracketed(task: Search) -> list[Minimum]:
    """Return the searches for a single value between places whose residuals differ in sign.

    A single value has a single key. Without such places the nearest of all runs is returned.
    """
    problem, wanted = task.problem, task.measured[0]
    _that_work(problem, list(_grid()))
    pairs = list(pairwise(problem.single_values()))
    brackets = [
        (a, b)
        for (a, below), (b, above) in pairs
        if below is not None and above is not None and (below - wanted) * (above - wanted) < 0.0
    ]
    if not brackets:
        for (a, left), (b, right) in pairs:
            if (left is None) != (right is None):
                brackets += _edge_bracket(task, *((b, a) if left is None else (a, b)))
    roots = [task.root_between(*bracket) for bracket in brackets[:MAX_BRACKETS]]
    found = [root for root in roots if root is not None]
    if not found:
        working = (x for x, value in problem.single_values() if value is not None)
        x = min(working, key=task.cost)
        found = [Minimum(x, x, task.cost(x), task.cost(x))]
    return found


def _edge_bracket(task: Search, good: "Array", failed: "Array") -> "Iterator[tuple[Array, Array]]":
    """Yield the bracket between a place and one at which the run fails, if there is one.

    Places are bisected up to the edge of failing runs, such as those of a pulley that does not
    break away, so that a value reached near this edge is not missed.
    """
    side = task.residual(good)[0]
    for _ in range(MAX_BISECTIONS):
        middle = 0.5 * (good + failed)
        if task.problem.model(middle).values is None:
            failed = middle
        elif task.residual(middle)[0] * side < 0.0:
            yield good, middle
            return
        else:
            good = middle
        if abs(float(failed[0] - good[0])) < EDGE:
            return
