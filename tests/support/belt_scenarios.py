"""Small belts that the tests of belts share."""

import tomllib
from collections.abc import Callable
from importlib import import_module
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from frictionsim.mechanisms.belt_drive.model import BeltModel, assemble
from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario
from frictionsim.scenario.loading import validate
from frictionsim.scenario.signal_tables import SpeedTable, signal_from
from tests.support.belt_reference import Belt
from tests.support.scenarios import SCENARIOS, Scenario, changed
from tests.support.scenarios import shipped as as_shipped

Array = NDArray[np.float64]

# Two pulleys, every effect but gravity. Of few long and heavy bodies, so that steps are long: the
# waves run at 141 m/s and turn the bodies with 12 000 rad/s, the contacts swing with 3000 rad/s.
PAIR = """
kind = "belt_drive"
[mechanism]
belt = { bodies = 24, mass_per_length = 0.5, axial_rigidity = 1e4, pretension = 200.0 }
pulleys = [
    { name = "driver", center = [0.0, 0.0], radius = 0.08, inertia = 2e-3 },
    { name = "driven", center = [0.25, 0.0], radius = 0.08, inertia = 2e-3 },
]
[drive]
driver = { torque = { time = [0.0, 0.02], value = [0.0, -5.0] } }
driven = { torque = { speed = [-20.0, 20.0], value = [5.0, -5.0] } }
[effects]
contact = { c1 = 1e7, c2 = 2e5, damping = 20.0, p_max = 1e-3 }
belt_friction = { mu_s = 0.6, mu_k = 0.6 }
axial_damping = { coefficient = 2.0 }
bending = { rigidity = 0.02 }
[solver]
duration = 0.05
rtol = 1e-4
[output]
interval = 1e-3
"""

# Every effect there is: a roller on the back of the belt, a speed that is prescribed, torques over
# time and speed, gravity, friction that differs by pulley, at rest and on a part of the belt.
TRIO = """
kind = "belt_drive"
[mechanism]
belt = { bodies = 60, mass_per_length = 0.5, axial_rigidity = 1e4, pretension = 200.0 }
pulleys = [
    { name = "driver", center = [0.0, 0.0], radius = 0.08, inertia = 2e-3 },
    { name = "roller", center = [0.2, -0.055], radius = 0.06, inertia = 5e-4, side = "outside" },
    { name = "driven", center = [0.4, 0.01], radius = 0.07, inertia = 2e-3 },
]
[drive]
driver = { speed = { sine = { mean = 0.0, amplitude = 8.0, frequency_hz = 20.0 } } }
roller.torque.sine = { mean = 0.1, amplitude = 0.2, frequency_hz = 50.0, phase_deg = 30.0 }
driven = { torque = { speed = [-20.0, 20.0], value = [5.0, -5.0] } }
[effects]
contact = { c1 = 1e7, c2 = 2e5, damping = 20.0, p_max = 1e-3, reference_bodies = 50 }
belt_friction = { mu_s = 0.6, mu_k = 0.5, pulleys = { roller = { mu_s = 0.4, mu_k = 0.3 } } }
patch = { from = 0.3, to = 0.6, mu_s = 0.25, mu_k = 0.2 }
axial_damping = { coefficient = 0.1, basis = "section" }
bending = { rigidity = 0.02, damping = 1e-5 }
gravity = { g = 9.81 }
[solver]
duration = 0.05
rtol = 1e-4
[output]
interval = 1e-3
"""


def pair(**changes: Any) -> Scenario:
    """Return the belt on two pulleys as data, with keys changed as `conftest.changed` has it."""
    return changed(tomllib.loads(PAIR), **changes)


def every_effect(**changes: Any) -> Scenario:
    """Return the belt on three pulleys as data."""
    return changed(tomllib.loads(TRIO), **changes)


def trio(**changes: Any) -> Scenario:
    """Return it without gravity, so that the kernels of the pair and of shipped belts serve it."""
    return every_effect(**{"effects__gravity": None, **changes})


def shipped(name: str, **changes: Any) -> Scenario:
    return as_shipped(name, **{"solver__backend": "moreau", **changes})


# A belt that is guided on its pitch line.
NO_MOTION_ACROSS = {"effects__contact": None, "effects__bending": None, "effects__gravity": None}
# The resistance of `belt_drive.toml`, linear throughout.
CONTINUED = {"speed": [-251.327412, 251.327412], "value": [150.0, -150.0]}


def mirrored(data: Scenario) -> Scenario:
    """Return a belt turned over about the y axis; what ran round one way runs round the other."""
    image = changed(data)
    for pulley in image["mechanism"]["pulleys"]:
        pulley["center"][0] *= -1.0
    for drive in image["drive"].values():
        for signal in drive.values():
            sine = signal.get("sine", {})
            for key in {"mean", "amplitude"} & sine.keys():
                sine[key] *= -1.0
            if "time" in signal:  # loads over the speed are odd
                signal["value"] = [-value for value in signal["value"]]
    return image


class Stepped(NamedTuple):
    """Where a backend got to, without samples on the way."""

    state: Array
    model: BeltModel
    stepper: Any


Disturb = Callable[[BeltModel], None]


def stepped(data: Scenario, disturb: Disturb | None = None) -> Stepped:
    """Step a scenario to the end of its duration, from its start or what `disturb` makes of it."""
    scenario = scenario_of(data)
    model = assemble(scenario)
    if disturb is not None:
        disturb(model)
    stepper = import_module(scenario.pair.module).STEPPER(model, scenario.solver)
    stepper.start()
    end = scenario.solver.duration
    while stepper.t < end * (1.0 - 1e-12):
        stepper.advance(end, np.inf, 1_000_000)
    return Stepped(stepper.interpolate(end).copy(), model, stepper)


def kick(speed: float) -> Disturb:
    """Return a kick: body velocities along a wave as long as the belt, m/s."""

    def disturb(model: BeltModel) -> None:
        width, n = model.system.layout.width, model.system.chain.bodies
        phase = 2.0 * np.pi * np.arange(n) / n
        for row in (3, 4):
            model.state[row * width : row * width + n] += speed * np.sin(phase + row)

    return disturb


def distance(a: Stepped, b: Stepped) -> float:
    """Return how far two ends are apart, at most, in sizes of the states."""
    return float(np.max(np.abs(a.state - b.state) / a.model.error_scales))


def scenario_of(data: Scenario) -> BeltDriveScenario:
    scenario = validate(data, SCENARIOS)
    assert isinstance(scenario, BeltDriveScenario)
    return scenario


def kinematics(state: Array, model: BeltModel) -> list[Array]:
    """Return x, y, phi, vx, vy, w of the bodies and theta, omega of the pulleys in a state."""
    n, width = model.system.chain.bodies, model.system.layout.width
    table, free = model.system.pulleys.table, model.system.pulleys.free
    m = table.shape[1]
    motion = state[: 6 * width].reshape(6, width)[:, :n]
    omega = table[4].copy()
    omega[free] = state[6 * width + m : 6 * width + m + len(free)]
    return [*(row.copy() for row in motion), state[6 * width : 6 * width + m].copy(), omega]


def reference(scenario: BeltDriveScenario, body_length: float, tau: float = 1e-5) -> Belt:
    """Return the scenario as the reference program takes it; friction at rest is given per run."""
    belt, effects, pulleys = scenario.mechanism.belt, scenario.effects, scenario.mechanism.pulleys
    contact, axial, bending = effects.contact, effects.axial_damping, effects.bending
    share = (contact.reference_bodies or belt.bodies) / belt.bodies
    law = effects.belt_friction

    def per_pulley(key: str) -> Array:
        """Return a number of the contact with each pulley, its own where it has one."""
        own = [getattr(contact.pulleys.get(p.name), key, None) for p in pulleys]
        return np.array([getattr(contact, key) if one is None else one for one in own])

    return Belt(
        n=belt.bodies,
        l=body_length,
        rho=belt.mass_per_length,
        EA=belt.axial_rigidity,
        centres=np.array([p.center for p in pulleys]),
        radii=np.array([p.radius for p in pulleys]),
        inertias=np.array([p.inertia for p in pulleys]),
        c1=per_pulley("c1") * share,
        c2=per_pulley("c2") * share,
        b_c=per_pulley("damping") * share,
        p_max=per_pulley("p_max"),
        b_joint=axial.coefficient if axial and axial.basis == "joint" else None,
        b_section=axial.coefficient if axial else 0.0,
        EI=bending.rigidity if bending else 0.0,
        b_tor=bending.damping / body_length if bending else 0.0,
        wrap=belt.wrap == "corrected",
        gravity=(0.0, -effects.gravity.g) if effects.gravity else (0.0, 0.0),
        law=law.law if law else "set-valued",
        tau=tau,
        mu_s=law.mu_s if law else 0.0,
        mu_k=law.mu_k if law else 0.0,
        dv=(law.transition_speed if law else None) or 1.0,
        delta_max=(law.maximum_creep if law else None) or 1.0,
        torque=lambda t, theta, omega: torques(scenario, t, omega),
        prescribed={
            j: lambda t, terms=scenario.drive[p.name].terms: sum(
                signal_from(term).derivative(t) for term in terms
            )
            for j, p in enumerate(pulleys)
            if p.name in scenario.drive and scenario.drive[p.name].speed is not None
        },
    )


def torques(scenario: BeltDriveScenario, t: float, omega: Array) -> Array:
    values = np.zeros(len(omega))
    for j, name in enumerate(scenario.mechanism.names):
        drive = scenario.drive.get(name)
        for table in drive.terms if drive is not None and drive.speed is None else ():
            if isinstance(table, SpeedTable):
                values[j] += np.interp(omega[j], table.speed, table.value)
            else:
                values[j] += signal_from(table)(t)
    return values


# What the pair needs to stay smooth: kicked gently, its contacts stay closed.
GENTLY = 2e-3  # m/s
NO_FRICTION = {"mu_s": 0.0, "mu_k": 0.0}
MUCH_FRICTION = {"mu_s": 50.0, "mu_k": 50.0}  # nothing ever slides
SHORT = 2.048e-3  # s
# So large that errors of the fifth order stand above the rounding, 2e-11, over a decade of steps;
# no contact opens.
RISING = {"smooth_step": {"from": 0.0, "to": -40.0, "start": 0.0, "stop": SHORT}}


def orders(data: Scenario, steps: list[float], key: str, disturb: Disturb | None) -> list[float]:
    """Return the orders that follow from ends at steps, each half of the one before."""
    ends = [stepped(changed_step(data, key, step), disturb) for step in steps]
    errors = [distance(*two) for two in pairwise(ends)]
    return [float(np.log2(a / b)) for a, b in pairwise(errors)]


def changed_step(data: Scenario, key: str, step: float) -> Scenario:
    return {**data, "solver": {**data["solver"], key: step}}


def halved(step: float, times: int) -> list[float]:
    return [step / 2**k for k in range(times)]


# A start from rest where all sticks: there is no slip at first that a step would take away.
SMOOTH = {
    "without friction": pair(effects__belt_friction=NO_FRICTION, solver__duration=SHORT),
    "sticking": pair(
        effects__belt_friction=MUCH_FRICTION, drive__driver__torque=RISING, solver__duration=SHORT
    ),
}
STARTS = {"without friction": kick(GENTLY), "sticking": None}
COMPILED = {
    "rkf45": trio(),
    "moreau": trio(solver__backend="moreau"),
    "moreau, stiff damping": pair(
        solver__backend="moreau", effects__axial_damping__coefficient=2000.0
    ),
}
STEPS = 12  # slots are dealt a second time after 8
