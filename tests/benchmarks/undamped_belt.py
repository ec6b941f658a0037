"""Runge-Kutta steps of a fixed length on a fine belt that bends and has no dampers.

Every body gets a random kick, so that waves of all lengths run. A method that damps the whole of
its stretch of the imaginary axis takes energy out of the short ones; one that does not, puts it in.
`python -m tests.benchmarks.undamped_belt`
"""

from typing import Any, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.assembly import assemble
from frictionsim.mechanisms.belt_drive.kernels.contacts import find_contact_candidates
from frictionsim.mechanisms.belt_drive.kernels.equations import rhs
from frictionsim.mechanisms.belt_drive.kernels.jit import kernel
from frictionsim.mechanisms.belt_drive.kernels.layout import FRICTION_HEAT, kinematics_of
from frictionsim.mechanisms.belt_drive.sampling import Observer
from tests.support.belt_scenarios import Array, scenario_of, shipped

SEARCH_INTERVAL = 8  # steps
DURATION, KICK = 0.01, 0.02  # s, m/s


class Tableau(NamedTuple):
    """The coefficients of an explicit method, and the values of omega h to try."""

    name: str
    stages: tuple[tuple[float, ...], ...]
    weights: tuple[float, ...]
    omega_h: tuple[float, ...]


METHODS = (
    Tableau(
        "classical, order 4",
        ((), (0.5,), (0, 0.5), (0, 0, 1)),
        (1 / 6, 1 / 3, 1 / 3, 1 / 6),
        (2.75, 2.0),
    ),
    Tableau(
        "Fehlberg, order 5",
        (
            (),
            (1 / 4,),
            (3 / 32, 9 / 32),
            (1932 / 2197, -7200 / 2197, 7296 / 2197),
            (439 / 216, -8, 3680 / 513, -845 / 4104),
            (-8 / 27, 2, -3544 / 2565, 1859 / 4104, -11 / 40),
        ),
        (16 / 135, 0, 6656 / 12825, 28561 / 56430, -9 / 50, 2 / 55),
        (3.55, 1.5),
    ),
)


@kernel
def search(system: Any, kinematics: Array) -> None:
    """Make candidates of the bodies near pulleys."""
    find_contact_candidates(system, kinematics)


@kernel
def rates(t: float, h: float, state: Array, rate: Array, system: Any) -> None:
    """Write the rates of a state."""
    rhs(t, h, state, rate, system)


def run(method: Tableau, omega_h: float, bodies: int) -> str:
    """Step a kicked belt, and say what became of its energy."""
    scenario = scenario_of(
        shipped(
            "belt_drive",
            mechanism__belt__bodies=bodies,
            effects__contact__damping=0.0,
            effects__axial_damping=None,
            drive=None,
            solver__backend="rkf45",
        )
    )
    model = assemble(scenario)
    system, layout, state = model.system, model.system.layout, model.state.copy()
    observer, kinematics = Observer(scenario, model), kinematics_of(state, layout)[:, :bodies]
    rng = np.random.default_rng(1)
    kinematics[3:] += KICK * rng.standard_normal((3, bodies))
    kinematics[5] /= system.chain.length

    def energy() -> float:
        speeds = state[layout.speeds : layout.energies]
        moving = observer._kinetic_energy(kinematics, speeds)
        heat = float(state[layout.energies + FRICTION_HEAT])
        return moving + observer._potential_energy(kinematics) + heat

    h = omega_h / model.max_frequency_and_decay[0]
    steps, found = int(DURATION / h), [np.zeros_like(state) for _ in method.stages]
    before, kick = energy(), observer._kinetic_energy(kinematics, np.zeros(2))
    for step in range(steps):
        if step % SEARCH_INTERVAL == 0:
            search(system, kinematics_of(state, layout))
        for stage, rate in zip(method.stages, found, strict=True):
            inside = state + h * sum((c * f for c, f in zip(stage, found, strict=False)), 0.0 * h)
            rates(step * h, h, inside, rate, system)
        state += h * sum(w * f for w, f in zip(method.weights, found, strict=True))
    gained = energy() - before
    return (
        f"{bodies} bodies, {method.name}, omega h = {omega_h}: {steps * len(found)} evaluations,"
        f" energy and heat grew by {gained / kick:+.2g} of the kick"
    )


if __name__ == "__main__":
    for count in (300, 600):
        for tableau in METHODS:
            for value in tableau.omega_h:
                print(run(tableau, value, count), flush=True)
