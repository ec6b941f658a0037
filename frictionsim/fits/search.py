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

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from itertools import pairwise, product
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
TOLERANCE_OF_RESAMPLES = 1e-8  # of the places
LOCATED = 0.1  # of the standard errors: the last step of a resample
CURVED = 0.25  # of a predicted change: derivatives that missed more are found anew
NO_SLOPE = 1e-15  # of the gradient: the data do not change with any key
MAX_ITERATIONS = 60
EVALUATIONS_OF_A_KEY = 10  # in a local search: some five derivatives by two evaluations each
RESOLVED = 1e-12  # of the distance of the ends of a bracket
EDGE = 1e-9  # of the bounds: resolution of the edge of failing runs
AT_EDGE = 1e-4  # of the bounds: the distance of a place that is at an edge
MAX_SLIDES = 10  # searches along an edge
NO_GAIN = 1e-6  # relative, of such a search
MAX_BISECTIONS, MAX_BRACKETS = 100, 4
SECONDS_BETWEEN_TICKS = 0.1
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


class Edge(NamedTuple):
    """An edge next to a place: the runs beyond it fail."""

    number: int  # of the key
    side: int  # 1 if they fail above it, -1 below
    fault: str  # of the run beyond
    is_valid: bool  # the scenario beyond


def edges(problem: "FitProblem | OnEdge", x: "Array") -> Iterator[Edge]:
    """Yield the edges at a place between the bounds, with the other keys at their values."""
    for j, side in product(range(len(x)), (-1, 1)):
        place = x.copy()
        place[j] += side * AT_EDGE
        beyond = problem.model(place) if 0.0 <= place[j] <= 1.0 else None
        if beyond is not None and beyond.fault:
            yield Edge(j, side, beyond.fault, beyond.is_valid)


def last_good(is_good: "Callable[[Array], bool]", good: "Array", bad: "Array") -> "Array":
    """Return the good place next to the edge between a good and a bad one."""
    while np.max(np.abs(bad - good)) > EDGE:
        middle = 0.5 * (good + bad)
        good, bad = (middle, bad) if is_good(middle) else (good, middle)
    return good


class OnEdge:
    """A problem of other keys, of which one stays at an edge wherever the others put this."""

    def __init__(self, problem: Any, edge: Edge, x: "Array") -> None:
        self.problem, self.data, self.scenario = problem, problem.data, problem.scenario
        self._number, self._side, self._last = edge.number, edge.side, float(x[edge.number])
        self._works = problem.works if edge.is_valid else problem.is_valid

    def place(self, others: "Array") -> "Array | None":
        """Return the place of all keys; None if the runs fail at any value of that at the edge."""

        def at(value: float) -> "Array":
            return np.insert(others, self._number, min(max(value, 0.0), 1.0))

        here, distance = at(self._last), AT_EDGE
        succeeds = self._works(here)
        outwards = self._side if succeeds else -self._side
        while True:
            there = at(self._last + outwards * distance)
            if self._works(there) != succeeds:
                return last_good(self._works, *((here, there) if succeeds else (there, here)))
            if there[self._number] in (0.0, 1.0):
                return there if succeeds else None
            here, distance = there, 4.0 * distance

    def is_valid(self, others: "Array") -> bool:
        """Return whether the other keys at a place have a valid value of that at the edge."""
        return self.place(others) is not None

    def works(self, others: "Array") -> bool:
        """Return whether the run with the other keys at a place succeeds."""
        return self.model(others).values is not None

    def model(self, others: "Array") -> Model:
        """Return the model with the other keys at a place."""
        place = self.place(others)
        return Model(None, "no value is valid") if place is None else self.problem.model(place)


class _Failed(Exception):
    """A run within a bracket failed."""


class Search:
    """Weighted residuals and their derivatives, of the data or of values that replace them (n,)."""

    ftol = xtol = TOLERANCE

    def __init__(self, problem: Any, weights: "Array", measured: "Array | None" = None) -> None:
        self.problem, self.weights = problem, weights
        self.has_failed = False  # a run
        self.measured = problem.data.values if measured is None else measured
        solver = problem.scenario.solver
        # The cube root of the error of the runs gives the least error of a central difference.
        step = min(max(float(np.cbrt(solver.rtol)), MIN_STEP), MAX_STEP)
        self.step = FIXED_STEP if problem.scenario.pair.fixed_step else step

    def residual(self, x: "Array") -> "Array":
        """Return the weighted residuals at a place; large ones of a failed run."""
        model = self.problem.model(x).values
        if model is None:
            self.has_failed = True
            size = np.maximum(self.problem.data.scale, np.abs(self.measured))
            return np.asarray(self.weights * size * FAILED)
        return np.asarray((model - self.measured) * self.weights)

    def cost(self, x: "Array") -> float:
        """Return half the weighted sum of squares."""
        return 0.5 * float(np.sum(self.residual(x) ** 2))

    def jacobian(self, x: "Array", step: float | None = None) -> "Array":
        """Return the derivatives (n, keys) of the weighted residuals by the places.

        Central differences; one-sided of second order at a bound or next to a failed run. NaN where
        the runs on both sides fail.
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

        here, h = self.problem.model(x).values, -h if x[j] > 0.5 else h  # off the nearer bound
        far, near = values_at(h), values_at(-h) if 0.0 <= x[j] - h <= 1.0 else None
        if far is None:
            far, near, h = near, None, -h
        if far is not None and near is not None:
            slope = (far - near) / (2.0 * h)
        elif far is not None and here is not None:
            further = values_at(2.0 * h)
            slope = (far - here) / h
            if further is not None:
                slope = (4.0 * far - further - 3.0 * here) / (2.0 * h)
        elif here is not None and abs(h) > AT_EDGE:
            return self._slope(x, j, 0.25 * abs(h))
        else:
            return np.full(self.measured.size, np.nan)
        return np.asarray(slope * self.weights)

    def minimum(self, start: "Array") -> Minimum:
        """Return the local minimum of the least squares that start at a place.

        A step over an edge of failing runs is only shortened. So from an end at an edge a search
        of the other keys goes along it, which the least squares go on from.
        """
        end = self._descent(start)
        for _ in range(MAX_SLIDES if len(start) > 1 else 0):
            edge = next(edges(self.problem, end.x), None) if self.has_failed else None
            if edge is None:
                break
            place = self._along(edge, end.x)
            if place is None or self.cost(place) >= end.cost * (1.0 - NO_GAIN):
                break
            better = self._descent(place)
            end = better._replace(start=start, first_cost=end.first_cost)
        return end

    def _along(self, edge: "Edge", x: "Array") -> "Array | None":
        """Return the minimum along an edge."""
        problem = OnEdge(self.problem, edge, x)
        others = type(self)(problem, self.weights, self.measured)
        return problem.place(others.minimum(np.delete(x, edge.number)).x)

    def derivatives(self) -> "Callable[[Array], Array]":
        """Return the function of a place that gives the derivatives for a descent."""
        return lambda x: np.nan_to_num(self.jacobian(x))

    def _descent(self, start: "Array") -> Minimum:
        from scipy.optimize import least_squares  # imported here because SciPy takes 0.3 s

        solution: Any = least_squares(
            self.residual,
            np.clip(start, 0.0, 1.0),
            jac=self.derivatives(),
            bounds=(0.0, 1.0),
            method="trf",
            ftol=self.ftol,
            xtol=self.xtol,
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
        minimum = type(self)(problem, self.weights, self.measured).minimum(start)
        return minimum, problem.runs, problem.models if problem.data.size == 1 else {}

    def root_between(self, first: "Array", last: "Array") -> Minimum | None:
        """Return the place between two others that gives a single value, by Brent's method.

        The residual of the value differs in sign at these places. Of a jump over the value, the
        nearer side is returned; None if a run in between fails.
        """
        from scipy.optimize import brentq

        wanted = self.measured[0]
        # Brent's last bracket: the part of the distance and the residual of the last run below the
        # value, and of the last one above it.
        ends: dict[bool, tuple[float, float]] = {}

        def residual(part: float) -> float:
            model = self.problem.model(first + part * (last - first)).values
            if model is None:
                raise _Failed
            excess = float(model[0] - wanted)
            ends[excess > 0.0] = part, excess
            return excess

        try:
            residual(brentq(residual, 0.0, 1.0, xtol=RESOLVED, maxiter=MAX_BISECTIONS, disp=False))
        except _Failed:
            return None
        part, _ = min(ends.values(), key=lambda end: abs(end[1]))
        x = first + part * (last - first)
        jump = None
        if not self.problem.is_exact(x):
            jump = wanted + ends[False][1], wanted + ends[True][1]
        return Minimum(first, x, self.cost(first), self.cost(x), jump=jump)


class Resample(Search):
    """A search for resampled data, located to a part of the standard errors.

    The weights are one over the standard deviations. So few runs suffice: the derivatives at the
    start, which all resamples share, are corrected by the change of the values over each step
    (Broyden's formula), and found anew where they predicted another change.
    """

    xtol = TOLERANCE_OF_RESAMPLES

    def __init__(self, problem: Any, weights: "Array", measured: "Array") -> None:
        super().__init__(problem, weights, measured)
        # A step of a part of the standard error changes the sum of squares, about one for each
        # value, by the square of that part.
        self.ftol = LOCATED**2 / measured.size

    def derivatives(self) -> "Callable[[Array], Array]":
        """Return the function of a place that gives the derivatives for a descent."""
        before: tuple[Array, Array, Array] | None = None  # the place, its residuals, derivatives

        def derivatives_at(x: "Array") -> "Array":
            nonlocal before
            residual, jacobian = self.residual(x), None
            if before is not None:
                step, predicted = x - before[0], before[2] @ (x - before[0])
                missed = residual - before[1] - predicted
                size = max(float(np.linalg.norm(predicted)), LOCATED)
                if np.linalg.norm(missed) <= CURVED * size:
                    jacobian = before[2] + np.outer(missed, step) / (step @ step)
            if jacobian is None:
                jacobian = np.nan_to_num(self.jacobian(x))
            before = x.copy(), residual, jacobian
            return jacobian

        return derivatives_at


def minima(searches: "Sequence[tuple[Search, Array]]") -> list[Minimum]:
    """Return the minima of searches of one problem, each from its start.

    They go over the cores where they are expected to take seconds; the minima and the number of
    runs do not depend on that.
    """
    problem = searches[0][0].problem
    evaluations = EVALUATIONS_OF_A_KEY * len(problem.keys) * len(searches)
    pays = evaluations * problem.seconds_each > SECONDS_THAT_PAY
    workers = min(available_cores(), len(searches)) if pays else 1
    size, ends = ceil(len(searches) / (PARTS * workers)), list[Minimum]()
    parts = [searches[first : first + size] for first in range(0, len(searches), size)]
    with process_pool(workers) as pool:
        try:
            futures = [pool.submit(_alone, part) for part in parts]
            waiting = {*futures}
            while waiting:
                done, waiting = wait(waiting, SECONDS_BETWEEN_TICKS, FIRST_COMPLETED)
                runs = sum(number for future in done for _, number, _ in future.result())
                if workers > 1:
                    problem.on_runs(runs)
                pool.watch()
        except pool.deaths as error:
            pool.current_runs()  # which raises an error if no process could be started
            raise SolverError(f"{pool.death(error)}; nothing of the fit is kept") from None
    for future in futures:
        for minimum, number, models in future.result():
            ends.append(minimum)
            problem.runs += number
            problem.models |= models
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
    points = [np.array([key.scaled(key.start) for key in keys])]
    if starts > 1:
        points += [*latin_hypercube(SCANNED * starts, len(keys), np.random.default_rng(seed))]
    working = [point for point in points if problem.works(point)]
    if not working and problem.data.size == 1:
        points += [*_grid()]
        working = [point for point in points if problem.works(point)]
    if not working:
        all_failed = f"all {len(points)} runs of the fit failed; that of the start"
        failure = "the run of the fit failed" if len(points) == 1 else all_failed
        raise SolverError(f"{failure}: {problem.model(points[0]).reason}")
    chosen: list[Array] = []
    for point in sorted(working, key=task.cost):
        if len(chosen) < starts and all(np.max(np.abs(point - one)) >= APART for one in chosen):
            chosen.append(point)
    found = minima([(task, start) for start in chosen])
    if problem.data.size == 1 and not any(problem.is_exact(end.x) for end in found):
        found = [*_bracketed(task), *found]
    return sorted(found, key=lambda end: end.cost)


def _grid() -> "Array":
    """Return equidistant places of a single key, with its bounds (n, 1)."""
    return np.linspace(0.0, 1.0, SCANNED + 1)[:, None]


def _bracketed(task: Search) -> list[Minimum]:
    """Return the searches for a single value between places whose residuals differ in sign.

    A single value has a single key. Without such places those between a run that succeeds and one
    that fails are tried, up to the edge: the value may be reached near it, as that of a pulley that
    hardly breaks away. Else the nearest of all runs is returned.
    """
    problem, wanted = task.problem, task.measured[0]
    for place in _grid():
        problem.model(place)
    pairs = list(pairwise(problem.single_values()))

    def are_around(one: float | None, other: float | None) -> bool:
        return None not in (one, other) and (one - wanted) * (other - wanted) < 0.0

    brackets = [(a, b) for (a, left), (b, right) in pairs if are_around(left, right)]
    if not brackets:
        for (a, left), (b, right) in pairs:
            if (left is None) != (right is None):
                good, bad, value = (b, a, right) if left is None else (a, b, left)
                last = last_good(problem.works, good, bad)
                brackets += [(good, last)] if are_around(value, problem.single(last)) else []
    roots = [task.root_between(*bracket) for bracket in brackets[:MAX_BRACKETS]]
    found = [root for root in roots if root is not None]
    if not found:
        working = (x for x, value in problem.single_values() if value is not None)
        x = min(working, key=task.cost)
        found = [Minimum(x, x, task.cost(x), task.cost(x))]
    return found
