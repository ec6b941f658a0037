"""The search of a fit: a scan of the bounds, least squares from its best points.

Stick-slip puts kinks into the residual: a sample changes its slope where a breakaway passes its
time, and the sum of squares has several minima. So the bounds are scanned first, and the local
search (`scipy.optimize.least_squares`, trust region reflective) starts from several points. Keys
are scaled to their bounds. Derivatives are central differences whose step is far above the
tolerance of the runs, and short against what moves an event from one sample to the next.

A place at which runs fail stands for the last one with runs on the way to it from the start of the
search, so that the search may go along such an edge.

A single value that the local searches have not reached is bracketed: between two places whose
residuals differ in sign, bisection finds the place at which the scenario gives the value, or jumps
over it.
"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from itertools import pairwise, product
from math import ceil
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import SolverError, WorkerDied
from frictionsim.fits.problem import FitProblem, Model, bisected
from frictionsim.sweeps.workers import SECONDS_BETWEEN_TICKS, available_cores, process_pool

if TYPE_CHECKING:
    from frictionsim.results import Array

    Function = Callable[[Array], Array]

SCANNED = 12  # points for each start
GRID = np.linspace(0.0, 1.0, SCANNED + 1)[:, None]  # of a single key
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
RESOLVED = 1e-12  # of the bounds: the distance of the ends of a bracket
AT_EDGE = 1e-4  # of the bounds: the distance of a place that is at an edge
MAX_DESCENTS, NO_GAIN = 10, 1e-6  # along edges, and the relative gain of one that is none
BEYOND = 4.0  # steps of differences: where a search along an edge begins
MAX_BRACKETS = 4
LONG = 2.0  # s, of searches, from which on a pool of processes makes them
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


def edges(problem: FitProblem, x: "Array") -> Iterator[tuple[int, int, str]]:
    """Yield the keys by number beside whose values runs fail, the side (1 or -1) and the fault."""
    for j, side in product(range(len(x)), (-1, 1)):
        place = x.copy()
        place[j] += side * AT_EDGE
        if 0.0 <= place[j] <= 1.0 and not problem.works(place):
            yield j, side, problem.model(place).fault


def difference_step(problem: FitProblem) -> float:
    """Return the step of differences, as a part of the bounds.

    The cube root of the error of the runs gives the least error of a central difference.
    """
    if problem.scenario.pair.fixed_step:
        return FIXED_STEP
    return min(max(float(np.cbrt(problem.scenario.solver.rtol)), MIN_STEP), MAX_STEP)


def derivatives(values_at: "Callable[[Array], Array | None]", x: "Array", step: float) -> "Array":
    """Return the derivatives (n, keys) of values that are None where a run fails.

    Central differences; one-sided of second order at a bound or beside a failed run. NaN where the
    runs on both sides fail.
    """

    def at(j: int, distance: float) -> "Array | None":
        place = x.copy()
        place[j] += distance
        return values_at(place) if 0.0 <= place[j] <= 1.0 else None

    here: Any = values_at(x)
    columns = []
    for j in range(len(x)):
        below, above = at(j, -step), at(j, step)
        if below is not None and above is not None:
            columns.append((above - below) / (2.0 * step))
            continue
        side, near = (step, above) if below is None else (-step, below)
        further = at(j, 2.0 * side)
        if near is None:
            columns.append(np.full(here.size, np.nan))
        elif further is None:
            columns.append((near - here) / side)
        else:
            columns.append((4.0 * near - further - 3.0 * here) / (2.0 * side))
    return np.array(columns).T


def checked_derivatives(problem: FitProblem, x: "Array", sigma: "Array") -> "tuple[Array, Array]":
    """Return the derivatives of values over their sigma, and their changes (keys,) with the step.

    The changes are relative. Where a step passes a jump or a kink, such as an appearing event,
    shorter ones are tried.
    """

    def values_at(place: "Array") -> "Array | None":
        values = problem.model(place).values
        return None if values is None else values / sigma

    step = difference_step(problem)
    jacobian, changes = derivatives(values_at, x, step), np.full(len(x), np.inf)
    for part in SHORTER:
        shorter = derivatives(values_at, x, part * step)
        size = np.maximum(np.linalg.norm(jacobian, axis=0), np.linalg.norm(shorter, axis=0))
        change = np.linalg.norm(shorter - jacobian, axis=0) / np.where(size > 0.0, size, 1.0)
        changes = np.where(changes > DISAGREE, change, changes)
        if (changes <= DISAGREE).all():
            break
        jacobian = np.where(changes > DISAGREE, shorter, jacobian)
    return jacobian, changes


class Search(NamedTuple):
    """A local search from a place: least squares of the data, or of resampled values.

    The minimum of resampled values is located to a part of the standard errors, with one over the
    standard deviations as weights. So few runs suffice: the derivatives at the start, which all
    resamples share, are corrected by the change of the values over each step.
    """

    problem: FitProblem
    weights: "Array"
    start: "Array"
    resampled: "Array | None" = None

    def minimum(self) -> Minimum:
        """Return the local minimum of the least squares.

        At an edge the derivatives are those of one side at most. So a further search begins beyond
        it, where a place and all others on its way from the start stand for one.
        """
        problem, start, has_failed = self.problem, np.clip(self.start, 0.0, 1.0), False
        measured = problem.data.values if self.resampled is None else self.resampled

        def inside(x: "Array") -> "Array":
            nonlocal has_failed
            if problem.works(x):
                return x
            has_failed = True
            return problem.last_good(start, x)

        def residual(x: "Array") -> "Array":
            return np.asarray((problem.fitted(inside(x)) - measured) * self.weights)

        step = difference_step(problem)

        def jacobian(x: "Array") -> "Array":
            return derivatives(residual, x, step)

        def descent(first: "Array") -> Any:
            from scipy.optimize import least_squares  # imported here because SciPy takes 0.3 s

            options: dict[str, Any] = {"jac": jacobian, "ftol": TOLERANCE, "xtol": TOLERANCE}
            if self.resampled is not None:
                # A step of a part of the standard error changes the sum of squares, about one for
                # each value, by the square of that part.
                options = {"ftol": LOCATED**2 / measured.size, "xtol": TOLERANCE_OF_RESAMPLES}
                options["jac"] = _corrected(residual, jacobian)
            options |= {"gtol": NO_SLOPE, "max_nfev": MAX_ITERATIONS}
            return least_squares(residual, first, bounds=(0.0, 1.0), method="trf", **options)

        first_cost = 0.5 * float(np.sum(residual(start) ** 2))
        end = descent(start)
        for _ in range(MAX_DESCENTS if len(start) > 1 else 0):
            x = inside(end.x)
            way = x - start
            if not (has_failed and way.any() and any(edges(problem, x))):
                break
            beyond = x + BEYOND * step * way / np.max(np.abs(way))
            further = descent(np.clip(beyond, 0.0, 1.0))
            if further.cost >= end.cost * (1.0 - NO_GAIN):
                break
            end = further
        return Minimum(start, inside(end.x), first_cost, float(end.cost), end.status > 0)


def _corrected(residual: "Function", derivatives_at: "Function") -> "Function":
    """Return the function that gives derivatives for a descent, most of them without runs.

    They are corrected by Broyden's formula, and found anew where they predicted another change.
    """
    before: tuple[Array, Array, Array] | None = None  # the place, its residuals, derivatives

    def jacobian(x: "Array") -> "Array":
        nonlocal before
        values, found = residual(x), None
        if before is not None:
            step, predicted = x - before[0], before[2] @ (x - before[0])
            missed = values - before[1] - predicted
            size = max(float(np.linalg.norm(predicted)), LOCATED)
            if np.linalg.norm(missed) <= CURVED * size:
                found = before[2] + np.outer(missed, step) / (step @ step)
        found = derivatives_at(x) if found is None else found
        before = x.copy(), values, found
        return found

    return jacobian


def minima(searches: Sequence[Search]) -> list[Minimum]:
    """Return the minima of searches of one problem.

    They go over the cores where they are expected to take seconds; the minima and the number of
    runs do not depend on that.
    """
    problem = searches[0].problem
    evaluations = EVALUATIONS_OF_A_KEY * len(problem.keys) * len(searches)
    is_long = evaluations * problem.seconds_each > LONG
    workers = min(available_cores(), len(searches)) if is_long else 1
    size, ends = ceil(len(searches) / (PARTS * workers)), list[Minimum]()
    parts = [searches[first : first + size] for first in range(0, len(searches), size)]
    with process_pool(workers) as pool:
        try:
            with pool.reporting_deaths():
                futures = [pool.submit(_apart, part) for part in parts]
                waiting = {*futures}
                while waiting:
                    done, waiting = wait(waiting, SECONDS_BETWEEN_TICKS, FIRST_COMPLETED)
                    runs = sum(number for future in done for _, number, _ in future.result())
                    if workers > 1:
                        problem.on_runs(runs)
        except WorkerDied as died:
            raise SolverError(f"{died}; nothing of the fit is kept") from None
    for future in futures:
        for minimum, number, models in future.result():
            ends.append(minimum)
            problem.runs += number
            problem.models |= models
    return ends


def _apart(searches: Sequence[Search]) -> list[tuple[Minimum, int, dict[bytes, Model]]]:
    """Return minima as another process may find them, their runs and, of a single value, models."""
    found = []
    for search in searches:
        problem = search.problem.apart()
        minimum = search._replace(problem=problem).minimum()
        found.append((minimum, problem.runs, problem.models if problem.data.size == 1 else {}))
    return found


def search(problem: FitProblem, weights: "Array", starts: int, seed: int) -> list[Minimum]:
    """Return the minima of all local searches in the order of their costs.

    A single search starts from the starts of the keys, without a scan. The seed draws the scanned
    points.
    """
    points = [np.array([key.scaled(key.start) for key in problem.keys])]
    if starts > 1:  # a Latin hypercube
        rng, count = np.random.default_rng(seed), SCANNED * starts
        places = np.array([rng.permutation(count) for _ in problem.keys]).T
        points += [*((places + rng.random(places.shape)) / count)]
    working = [point for point in points if problem.works(point)]
    if not working and problem.data.size == 1:
        points += [*GRID]
        working = [point for point in points if problem.works(point)]
    if not working:
        all_failed = f"all {len(points)} runs of the fit failed; that of the start"
        failure = "the run of the fit failed" if len(points) == 1 else all_failed
        raise SolverError(f"{failure}: {problem.model(points[0]).fault}")
    chosen: list[Array] = []
    for point in sorted(working, key=lambda x: problem.cost(x, weights)):
        if len(chosen) < starts and all(np.max(np.abs(point - one)) >= APART for one in chosen):
            chosen.append(point)
    found = minima([Search(problem, weights, start) for start in chosen])
    if problem.data.size == 1 and not any(problem.is_exact(end.x) for end in found):
        found = [*_bracketed(problem, weights), *found]
    return sorted(found, key=lambda end: end.cost)


def _bracketed(problem: FitProblem, weights: "Array") -> list[Minimum]:
    """Return the ends of searches for a single value between places whose residuals differ in sign.

    A single value has a single key. Of a jump over the value, the end is the nearer side. Without
    such places the end is the nearest of all runs.
    """
    wanted = float(problem.data.values[0])
    for place in GRID:
        problem.model(place)

    def end(start: "Array", x: "Array", jump: tuple[float, float] | None = None) -> Minimum:
        return Minimum(start, x, problem.cost(start, weights), problem.cost(x, weights), jump=jump)

    found = list[Minimum]()
    for (first, left), (last, right) in pairwise(problem.single_values()):
        if (left - wanted) * (right - wanted) >= 0.0 or len(found) == MAX_BRACKETS:
            continue

        def is_on_the_left(x: "Array", side: float = left - wanted) -> bool:
            value = problem.single(x)
            return value is not None and (value - wanted) * side > 0.0

        ends = bisected(is_on_the_left, first, last, RESOLVED)
        nearest = min(ends, key=lambda x: problem.cost(x, weights))
        low, high = (problem.single(x) for x in ends)
        jump = None
        if low is not None and high is not None and not problem.is_exact(nearest):
            jump = min(low, high), max(low, high)
        found.append(end(first, nearest, jump))
    if not found:
        nearest = min((x for x, _ in problem.single_values()), key=lambda x: end(x, x).cost)
        found = [end(nearest, nearest)]
    return found
