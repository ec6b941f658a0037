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

from collections.abc import Iterable
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import SolverError
from frictionsim.fitting.problem import FitProblem, latin_hypercube

if TYPE_CHECKING:
    from frictionsim.results import Array

FAILED = 1e6  # residual of a failed run, in units of the spread of the data
SCANNED = 12  # points for each start
APART = 0.1  # of the bounds: least distance of starts
MIN_STEP, MAX_STEP = 3e-4, 1e-2  # of differences, as a part of the bounds
FIXED_STEP = 3e-3  # where the error of the runs is not known from a tolerance
TOLERANCE = 1e-10  # relative change of the places, and of the sum of squares, at the end
NO_SLOPE = 1e-15  # of the gradient: the data do not change with any key
MAX_ITERATIONS = 60
SHORTER = (0.25, 0.0625)  # steps of differences, in a check of the derivatives
DISAGREE = 0.1  # relative
JUMPS = 0.5  # relative: the run jumps or kinks between the steps
RESOLVED = 1e-12  # of the distance of the ends of a bracket
EDGE = 1e-9  # of the bounds: resolution of the edge of failing runs
MAX_BISECTIONS, MAX_BRACKETS = 100, 4
MAX_THREADS = 64  # each has address space for a stack of its own


class Start(NamedTuple):
    """A local search.

    A cost is half the weighted sum of squares.
    """

    first: dict[str, float]  # the values of the keys where it started
    last: dict[str, float]  # and where it ended
    first_cost: float
    cost: float
    converged: bool


class Minimum(NamedTuple):
    """The end of a local search."""

    x: "Array"  # scaled place (keys,)
    cost: float  # half the weighted sum of squares
    converged: bool
    # Values of the scenario on both sides, if it jumps over a single value there.
    jump: tuple[float, float] | None = None


class _Failed(Exception):
    """A run within a bracket failed."""


class Search:
    """Weighted residuals and their derivatives, of the data or of values that replace them (n,)."""

    def __init__(
        self, problem: FitProblem, weights: "Array", measured: "Array | None" = None
    ) -> None:
        self.problem, self.weights, self.model = problem, weights, problem.model
        targets = problem.data.targets
        self.measured = (
            np.concatenate([t.values for t in targets]) if measured is None else measured
        )
        self._failed = weights * np.concatenate([t.scale for t in targets]) * FAILED
        self.step = difference_step(problem)

    def residual(self, x: "Array") -> "Array":
        """Return the weighted residuals at a scaled place; large ones of a failed run."""
        model = self.model(x).values
        if model is None:
            return self._failed
        return np.asarray((model - self.measured) * self.weights)

    def cost(self, x: "Array") -> float:
        """Return half the weighted sum of squares."""
        return 0.5 * float(np.sum(self.residual(x) ** 2))

    def jacobian(self, x: "Array", step: float | None = None) -> "Array":
        """Return the derivatives (n, keys) of the weighted residuals by the scaled places.

        Central differences; one-sided of second order at a bound, of first order next to a failed
        run.
        """
        h = self.step if step is None else step
        return np.array([self._column(x, j, h) for j in range(len(x))]).T

    def checked_jacobian(self, x: "Array") -> "tuple[Array, Array, Array]":
        """Return the derivatives, and their relative differences from those of another step.

        Where a step passes a jump or a kink, such as an appearing event, shorter ones are tried.

        Returns
        -------
        (n, keys), (keys,), (keys,)
            The last is the longest step whose derivatives differ by more than `JUMPS`, as a part
            of the bounds; 0 if there is none.
        """
        columns, differences, jumps = [], [], []
        for j in range(len(x)):
            column, step, jump = self._column(x, j, self.step), self.step, 0.0
            for part in SHORTER:
                shorter = self._column(x, j, part * self.step)
                size = max(np.linalg.norm(column), np.linalg.norm(shorter))
                difference = float(np.linalg.norm(shorter - column) / size) if size else 0.0
                if difference <= DISAGREE:
                    break
                jump = jump or (step if difference > JUMPS else 0.0)
                column, step = shorter, part * self.step
            columns.append(column)
            differences.append(difference)
            jumps.append(jump)
        return np.array(columns).T, np.array(differences), np.array(jumps)

    def _column(self, x: "Array", j: int, h: float) -> "Array":
        def values_at(distance: float) -> "Array | None":
            place = x.copy()
            place[j] += distance
            return self.model(place).values

        here = self.model(x).values
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

    def minimum(self, x: "Array") -> Minimum:
        """Return the local minimum of the least squares that start at a scaled place."""
        from scipy.optimize import least_squares  # imported here because SciPy takes 0.3 s

        solution: Any = least_squares(
            self.residual,
            np.clip(x, 0.0, 1.0),
            jac=self.jacobian,
            bounds=(0.0, 1.0),
            method="trf",
            ftol=TOLERANCE,
            xtol=TOLERANCE,
            gtol=NO_SLOPE,
            max_nfev=MAX_ITERATIONS,
        )
        return Minimum(np.asarray(solution.x), float(solution.cost), solution.status > 0)

    def root_between(self, first: "Array", last: "Array") -> Minimum | None:
        """Return the place between two others that gives a single value, by Brent's method.

        The residual of the value differs in sign at these scaled places. Of a jump over the value,
        the nearer side is returned; None if a run in between fails.
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
        return Minimum(x, self.cost(x), True, jump)


def minima(
    problem: FitProblem, searches: "Iterable[tuple[Search, Array]]", count: int
) -> list[Minimum]:
    """Return the minima of a number of searches, each from its start."""
    return [search.minimum(start) for search, start in searches]


def difference_step(problem: FitProblem) -> float:
    """Return the step of differences as a part of the bounds.

    The cube root of the error of the runs gives the least error of a central difference.
    """
    solver = problem.scenario.solver
    if problem.scenario.pair.fixed_step:
        return FIXED_STEP
    return float(min(max(np.cbrt(solver.rtol), MIN_STEP), MAX_STEP))


def search(
    problem: FitProblem, weights: "Array", starts: int, seed: int
) -> tuple[Minimum, list[Start]]:
    """Return the least minimum, and all local searches in the order of their costs.

    A single search starts from the starts of the keys, without a scan. The seed draws the scanned
    points.
    """
    task, keys = Search(problem, weights), problem.keys
    initial = np.array([key.scaled(key.start) for key in keys])
    points = [initial]
    if starts > 1:
        rng = np.random.default_rng(seed)
        points += list(latin_hypercube(SCANNED * starts, len(keys), rng))
    # Before any scan, so that an unknown channel or quantity is reported at once.
    works = _that_work(problem, points)
    if not works and problem.data.size == 1:
        points += list(_grid())
        works = _that_work(problem, points)
    if not works:
        all_failed = f"all {len(points)} runs of the fit failed; that of the start"
        failure = "the run of the fit failed" if len(points) == 1 else all_failed
        raise SolverError(f"{failure}: {problem.model(points[0]).reason}")
    chosen = _choose(works, task, starts)
    ends = minima(problem, ((task, first) for first in chosen), len(chosen))
    searches = [_local_search(task, *pair) for pair in zip(chosen, ends, strict=True)]
    if problem.data.size == 1 and not any(problem.is_exact(last.x) for last, _ in searches):
        searches = [*_bracketed_searches(task), *searches]
    searches.sort(key=lambda one: one[0].cost)
    return searches[0][0], [start for _, start in searches]


def _that_work(problem: FitProblem, points: "list[Array]") -> "list[Array]":
    """Return the scaled places at which the runs succeed."""
    models = problem.models(points)
    return [point for point, model in zip(points, models, strict=True) if model.values is not None]


def _grid() -> "Array":
    """Return equidistant scaled places of a single key, with its bounds (n, 1)."""
    return np.linspace(0.0, 1.0, SCANNED + 1)[:, None]


def _local_search(task: Search, first: "Array", last: Minimum) -> tuple[Minimum, Start]:
    values = task.problem.values
    return last, Start(values(first), values(last.x), task.cost(first), last.cost, last.converged)


def _bracketed_searches(task: Search) -> list[tuple[Minimum, Start]]:
    """Return the searches for a single value between places whose residuals differ in sign.

    A single value has a single key. Without such places the nearest of all runs is returned.
    """
    problem, wanted = task.problem, task.measured[0]
    for point in _grid():
        problem.model(point)
    pairs = list(pairwise(sorted(problem.evaluations, key=lambda pair: float(pair[0][0]))))
    brackets = [
        (a, b)
        for (a, below), (b, above) in pairs
        if below is not None and above is not None and (below - wanted) * (above - wanted) < 0.0
    ]
    if not brackets:
        for (a, left), (b, right) in pairs:
            if (left is None) != (right is None):
                brackets += _edge_bracket(task, *((b, a) if left is None else (a, b)))
    searches = []
    for first, last in brackets[:MAX_BRACKETS]:
        end = task.root_between(first, last)
        searches += [] if end is None else [_local_search(task, first, end)]
    if not searches:
        distances = [
            (abs(value - wanted), x) for x, value in problem.evaluations if value is not None
        ]
        _, x = min(distances, key=lambda pair: pair[0])
        searches.append(_local_search(task, x, Minimum(x, task.cost(x), True)))
    return searches


def _edge_bracket(task: Search, good: "Array", failed: "Array") -> "list[tuple[Array, Array]]":
    """Return the bracket between a place and one at which the run fails; empty if there is none.

    Places are bisected up to the edge of failing runs, such as those of a pulley that does not
    break away, so that a value reached near this edge is not missed.
    """
    side = task.residual(good)[0]
    for _ in range(MAX_BISECTIONS):
        middle = 0.5 * (good + failed)
        if task.problem.model(middle).values is None:
            failed = middle
        elif task.residual(middle)[0] * side < 0.0:
            return [(good, middle)]
        else:
            good = middle
        if abs(float(failed[0] - good[0])) < EDGE:
            break
    return []


def _choose(points: "list[Array]", task: Search, starts: int) -> "list[Array]":
    """Return the best points that are at least `APART` from each other."""
    chosen: list[Array] = []
    for point in sorted(points, key=task.cost):
        if all(np.max(np.abs(point - other)) >= APART for other in chosen):
            chosen.append(point)
        if len(chosen) == starts:
            break
    return chosen
