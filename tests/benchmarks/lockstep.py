"""How many runs in lockstep go in a second, against the same runs one by one.

Run it with `python -m tests.benchmarks.lockstep`. Processor time of one core, the validation of the
scenarios apart; all ways take turns, so that a machine whose speed drifts treats them alike.
"""

import random
from collections.abc import Callable
from functools import partial
from statistics import median
from time import process_time

import frictionsim as fs
from frictionsim.parameter_study.combinations import Combinations
from frictionsim.scenario.settings import Scenario
from frictionsim.simulation import lockstep
from tests.support.lockstep import alone, content

BATCHES = (20, 100, 500, 1000, 2000, 4000)
ALONE, TURNS = 50, 5
WAYS = ("alone", "replace", "numbers")
KEYS = {"mechanism.load": (1800.0, 2500.0), "effects.shaft_friction.mu_k": (0.05, 0.15)}
NAMES = ("pulley", "pulley_return", "pulley_horizontal")


def drawn(base: Scenario, count: int) -> list[tuple[float, ...]]:
    """Return values of the keys."""
    rng = random.Random(1)
    return [tuple(rng.uniform(*span) for span in KEYS.values()) for _ in range(count)]


def seconds(call: Callable[[], object]) -> float:
    started = process_time()
    call()
    return process_time() - started


def measure(name: str) -> None:
    """Print a table for a scenario."""
    base = fs.load(fs.scenarios()[name]).replace({"solver.rtol": 1e-6})
    rows = drawn(base, max(BATCHES))
    make = Combinations(base, tuple(KEYS)).scenario
    scenarios = [make(values) for values in rows]
    some = scenarios[:ALONE]
    assert [*map(content, lockstep.run_lockstep(some))] == [content(alone(s)) for s in some]
    few = rows[:ALONE]
    times: dict[str | int, list[float]] = {way: [] for way in (*WAYS, *BATCHES)}
    for _ in range(TURNS):
        times["alone"].append(seconds(lambda: [alone(s) for s in some]) / ALONE)
        times["replace"].append(
            seconds(lambda: [base.replace(dict(zip(KEYS, v, strict=True))) for v in few]) / ALONE
        )
        times["numbers"].append(seconds(lambda: [make(values) for values in few]) / ALONE)
        for batch in BATCHES:
            times[batch].append(seconds(partial(run_batch, scenarios[:batch])) / batch)
    each = {way: median(found) for way, found in times.items()}
    print(f"{name}: a run alone {1e6 * each['alone']:.0f} us; a scenario by replace")
    print(f"{1e6 * each['replace']:.0f} us, by Combinations {1e6 * each['numbers']:.0f} us")
    print(f"{'runs at once':>12s} {'us a run':>9s} {'runs/s':>8s} {'ratio':>6s}")
    for batch in BATCHES:
        ratio = each["alone"] / each[batch]
        print(f"{batch:12d} {1e6 * each[batch]:9.0f} {1 / each[batch]:8.0f} {ratio:6.1f}")


def run_batch(scenarios: list[Scenario]) -> None:
    lockstep.BATCH = len(scenarios)
    lockstep.run_lockstep(scenarios)


def main() -> None:
    """Print the tables."""
    for name in NAMES:
        measure(name)


if __name__ == "__main__":
    main()
