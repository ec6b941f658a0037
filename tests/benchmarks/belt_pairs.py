"""Explicit Runge-Kutta pairs on belts: error over evaluations, energy, rejected steps.

Run it as `python -m tests.benchmarks.belt_pairs [CASE...]`. Each pair steps the same belts at a
ladder of tolerances, with its own longest stable step and one choice of steps for all. Compared are
Fehlberg's stages with y5 + s (y5 - y4) propagated for several s (s = 0: the solution of order 5),
and the classical method of order 4 with an embedded solution of order 3. Counts do not depend on
the machine; the steps are taken in Python, so that times say nothing.
"""

import sys
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.assembly import assemble
from frictionsim.mechanisms.belt_drive.belt_simulation import observer_of
from frictionsim.mechanisms.belt_drive.kernels.contacts import find_contact_candidates
from frictionsim.mechanisms.belt_drive.kernels.equations import prescribed_speeds, rhs
from frictionsim.mechanisms.belt_drive.kernels.jit import kernel
from frictionsim.mechanisms.belt_drive.kernels.layout import (
    DAMPING_HEAT,
    FRICTION_HEAT,
    INPUT_ENERGY,
    kinematics_of,
)
from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario
from frictionsim.mechanisms.belt_drive.steppers.rkf45 import STABILITY_MARGIN
from frictionsim.mechanisms.belt_drive.steppers.rkf45_state import CANDIDATE_UPDATE_INTERVAL
from tests.benchmarks.imaginary_axis import CLASSICAL, FEHLBERG, FEHLBERG_5, polynomial
from tests.support.belt_scenarios import Array, scenario_of, shipped

SAMPLES = 20
TOLERANCES = (1e-3, 1e-4, 1e-5, 2e-6, 1e-7)
REFERENCE = 1e-9
NO_DAMPER = {"effects__axial_damping": None, "effects__contact__damping": 0.0}
CASES: dict[str, dict[str, Any]] = {
    "150 bodies": {"solver__duration": 0.04},
    "150 bodies, no damper": {"solver__duration": 0.04, **NO_DAMPER},
    "60 bodies": {"mechanism__belt__bodies": 60, "solver__duration": 0.04},
    "400 bodies, no damper": {
        "mechanism__belt__bodies": 400,
        "solver__duration": 0.01,
        **NO_DAMPER,
    },
    "stiff dampers": {"effects__axial_damping__basis": "section", "solver__duration": 0.002},
    "guided": {"scenario": "belt_string", "solver__duration": 0.04},
}


class Pair(NamedTuple):
    """The stages of a pair, the weights that are propagated, and those of its error estimate.

    `order` is that of the estimate; one more weight of the error than stages is that of the rate at
    the end of the step.
    """

    name: str
    stages: Array
    weights: Array
    error: Array
    order: int


FEHLBERG_4 = np.array([25 / 216, 0, 1408 / 2565, 2197 / 4104, -1 / 5, 0])
PAIRS = [
    *(
        Pair(f"Fehlberg, s = {s:g}", FEHLBERG, FEHLBERG_5 + s * difference, difference, 5)
        for s in (0.0, 0.6, 0.8, 1.0)
        for difference in (FEHLBERG_5 - FEHLBERG_4,)
    ),
    Pair(
        "classical, 4(3)",
        CLASSICAL,
        np.array([1 / 6, 1 / 3, 1 / 3, 1 / 6]),
        np.array([0, 0, 0, 1 / 6, -1 / 6]),
        4,
    ),
]


@kernel
def search(t: float, system: Any, kinematics: Array) -> None:
    """Make candidates of the bodies near pulleys."""
    prescribed_speeds(t, system)
    find_contact_candidates(system, kinematics)


@kernel
def rates(t: float, h: float, state: Array, rate: Array, system: Any) -> None:
    """Write the rates of a state."""
    rhs(t, h, state, rate, system)


class Run(NamedTuple):
    """Speeds of the free pulleys at the samples, rad/s, the energy balance, and counts."""

    speeds: Array
    energy: float
    steps: int
    rejected: int
    evaluations: int


def longest_step(pair: Pair, eigenvalues: Any) -> float:
    """Return STABILITY_MARGIN of the longest stable step, s; of an unstable pair 3.6/omega."""
    fastest = float(np.max(np.abs(eigenvalues)))
    products = np.arange(0.02, 5.0, 0.02)
    if pair.name == "Fehlberg, s = 0":
        return 3.6 / fastest
    growth = np.abs(
        np.polyval(
            polynomial(pair.stages, pair.weights), 1.0 * np.outer(products, eigenvalues / fastest)
        )
    )
    return STABILITY_MARGIN * products[np.argmax(growth.max(axis=1) > 1.0 + 1e-9) - 1] / fastest


def combination(weights: Array, k: list[Array]) -> Array:
    """Return the sum of rates with these weights."""
    return sum((w * f for w, f in zip(weights, k, strict=False) if w), np.zeros_like(k[0]))


def run(pair: Pair, scenario: BeltDriveScenario, rtol: float) -> Run:
    """Step a belt with the choice of steps of Hairer, Norsett and Wanner (1993), II.4."""
    model = assemble(scenario)
    system, layout, y = model.system, model.system.layout, model.state.copy()
    observer, n = observer_of(scenario, model), scenario.mechanism.belt.bodies
    max_step, t, end = longest_step(pair, model.eigenvalues), 0.0, scenario.solver.duration
    h, fsal = 0.01 * max_step, len(pair.error) > len(pair.weights)
    k = [np.zeros_like(y) for _ in pair.error]
    steps = rejected = 0

    def energy() -> float:
        motion, free = kinematics_of(y, layout)[:, :n], y[layout.speeds : layout.energies]
        heats = y[layout.energies :][[FRICTION_HEAT, DAMPING_HEAT]]
        put_in = y[layout.energies + INPUT_ENERGY]
        return float(
            observer._kinetic_energy(motion, free)
            + observer._potential_energy(motion)
            + np.sum(heats)
            - put_in
        )

    start, speeds = energy(), []
    for sample in end * np.arange(1, SAMPLES + 1) / SAMPLES:
        while t < sample * (1.0 - 1e-12):
            if steps % CANDIDATE_UPDATE_INTERVAL == 0:
                search(t, system, kinematics_of(y, layout))
            rates(t, h, y, k[0], system)
            while True:
                step = min(h, max_step, sample - t)
                for i in range(1, len(pair.weights)):
                    inside = y + step * sum(
                        a * f for a, f in zip(pair.stages[i], k, strict=False) if a
                    )
                    rates(t + step * pair.stages[i].sum(), step, inside, k[i], system)
                new = y + step * combination(pair.weights, k)
                if fsal:
                    rates(t + step, step, new, k[-1], system)
                error = (
                    step
                    * sum(e * f for e, f in zip(pair.error, k, strict=True))
                    / model.error_scales
                )
                size = max(float(np.sum((error / rtol) ** 16) ** (1 / 16)), 1e-10)
                if size <= 1.0:
                    break
                rejected += 1
                h = step * max(0.2, 0.9 * size ** (-1 / pair.order))
            y, t, steps = new, t + step, steps + 1
            if step == min(h, max_step) or size > 0.5:
                h = min(step * min(5.0, 0.9 * size ** (-1 / pair.order)), max_step)
        speeds.append(y[layout.speeds : layout.energies].copy())
    stored = abs(observer._potential_energy(kinematics_of(model.state, layout)[:, :n]))
    used = abs(float(y[layout.energies + INPUT_ENERGY]))
    balance = abs(energy() - start) / max(used, 1e-3 * stored)
    stages = len(pair.weights)
    return Run(np.array(speeds), balance, steps, rejected, (steps + rejected) * stages)


def rows(name: str) -> Iterator[str]:
    """Yield the lines of a case."""
    changes = {"scenario": "belt_drive", **CASES[name]}
    data = shipped(changes.pop("scenario"), solver__backend="rkf45", **changes)
    scenario = scenario_of(data)
    reference = run(PAIRS[2], scenario, REFERENCE)
    for pair in PAIRS:
        for rtol in TOLERANCES:
            found = run(pair, scenario, rtol)
            error = np.max(np.abs(found.speeds - reference.speeds))
            yield (
                f"| {name} | {pair.name} | {rtol:g} | {found.evaluations} | {found.rejected}"
                f" | {error:.1e} | {found.energy:.1e} |"
            )


if __name__ == "__main__":
    print("| belt | pair | rtol | evaluations | rejected | speed error, rad/s | energy |")
    print("|---|---|---|---|---|---|---|")
    for case in sys.argv[1:] or CASES:
        for line in rows(case):
            print(line, flush=True)
