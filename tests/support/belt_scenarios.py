"""Small belts that the tests of belts share."""

import tomllib
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import frictionsim as fs
from tests.support.belt_kernels import (
    BeltModel,
    PulleyCircle,
    assemble,
    belt_path,
    row,
    stepper_of,
)
from tests.support.belt_reference import Belt
from tests.support.scenarios import SCENARIOS, Scenario, changed
from tests.support.scenarios import shipped as as_shipped
from tests.support.second_way import signal as signal_over_time

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


def swinging() -> Scenario:
    """Return a belt that swings and hardly touches the roller with its back."""
    swing = {"sine": {"mean": 0.0, "amplitude": 16.0, "frequency_hz": 20.0}}
    data = trio(
        mechanism__belt__bodies=48,
        drive__driver={"torque": swing},
        drive__roller=None,
        effects__patch=None,
        effects__bending__damping=None,  # by the kernel of others
        solver={"backend": "moreau", "duration": 0.1, "step": 1e-5},
        output__interval=5e-4,
    )
    data["mechanism"]["pulleys"][1]["center"] = [0.2, -0.128]
    return data


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
    stepper = stepper_of(model, scenario)
    stepper.start()
    end = scenario.solver.duration
    while stepper.t < end * (1.0 - 1e-12):
        stepper.advance(end, np.inf, 1_000_000)
    return Stepped(stepper.interpolate(end).copy(), model, stepper)


def kick(speed: float) -> Disturb:
    """Return a kick: body velocities along a wave as long as the belt, m/s."""

    def disturb(model: BeltModel) -> None:
        width, n = model.belt.width, model.belt.n
        phase = 2.0 * np.pi * np.arange(n) / n
        for k in (3, 4):
            model.state[k * width : k * width + n] += speed * np.sin(phase + k)

    return disturb


def distance(a: Stepped, b: Stepped) -> float:
    """Return how far two ends are apart, at most, in sizes of the states."""
    return float(np.max(np.abs(a.state - b.state) / a.model.error_scales))


def scenario_of(data: Scenario) -> Any:
    return fs.load(data, folder=SCENARIOS)


def kinematics(state: Array, model: BeltModel) -> list[Array]:
    """Return x, y, phi, vx, vy, w of the bodies and theta, omega of the pulleys in a state."""
    n, width = model.belt.n, model.belt.width
    pul, free = model.belt.pul, model.belt.free
    m = pul.shape[1]
    motion = state[: 6 * width].reshape(6, width)[:, :n]
    omega = pul[row.SPEED].copy()
    omega[free] = state[6 * width + m : 6 * width + m + len(free)]
    return [*(each.copy() for each in motion), state[6 * width : 6 * width + m].copy(), omega]


def reference(scenario: fs.Scenario, body_length: float, tau: float = 1e-5) -> Belt:
    """Return the scenario as the reference program takes it; friction at rest is given per run."""
    data = scenario.to_dict()
    belt, pulleys = data["mechanism"]["belt"], data["mechanism"]["pulleys"]
    effects, drive = data["effects"], data["drive"]
    contact, axial = effects["contact"], effects.get("axial_damping")
    bending = effects.get("bending", {"rigidity": 0.0})
    law = effects.get("belt_friction", {"law": "set-valued", "mu_s": 0.0, "mu_k": 0.0})
    share = contact.get("reference_bodies", belt["bodies"]) / belt["bodies"]

    def per_pulley(key: str) -> Array:
        """Return a number of the contact with each pulley, its own where it has one."""
        own = [contact["pulleys"].get(p["name"], {}) for p in pulleys]
        return np.array([{**contact, **numbers}[key] for numbers in own])

    return Belt(
        n=belt["bodies"],
        l=body_length,
        rho=belt["mass_per_length"],
        EA=belt["axial_rigidity"],
        centres=np.array([p["center"] for p in pulleys]),
        radii=np.array([p["radius"] for p in pulleys]),
        inertias=np.array([p["inertia"] for p in pulleys]),
        c1=per_pulley("c1") * share,
        c2=per_pulley("c2") * share,
        b_c=per_pulley("damping") * share,
        p_max=per_pulley("p_max"),
        b_joint=axial["coefficient"] if axial and axial["basis"] == "joint" else None,
        b_section=axial["coefficient"] if axial else 0.0,
        EI=bending["rigidity"],
        b_tor=bending.get("damping", 0.0) / body_length,
        wrap=belt["wrap"] == "corrected",
        gravity=(0.0, -effects["gravity"]["g"]) if "gravity" in effects else (0.0, 0.0),
        law=law["law"],
        tau=tau,
        mu_s=law["mu_s"],
        mu_k=law["mu_k"],
        dv=law.get("transition_speed", 1.0),
        delta_max=law.get("maximum_creep", 1.0),
        torque=lambda t, theta, omega: torques(data, t, omega),
        prescribed={
            j: partial(slope, drive[p["name"]]["speed"])
            for j, p in enumerate(pulleys)
            if "speed" in drive.get(p["name"], {})
        },
    )


def path_of(scenario: fs.Scenario) -> Any:
    """Return the line of the ideal belt of a scenario."""
    pulleys = scenario.to_dict()["mechanism"]["pulleys"]
    return belt_path(
        [PulleyCircle(p["name"], tuple(p["center"]), p["radius"], p["side"]) for p in pulleys]
    )


def names_of(scenario: fs.Scenario) -> list[str]:
    """Return the names of the pulleys, in their order."""
    return [p["name"] for p in scenario.to_dict()["mechanism"]["pulleys"]]


def terms_of(signals: Any) -> list[Any]:
    """Return the signals that add to one."""
    return list(signals) if isinstance(signals, list | tuple) else [signals]


def slope(table: Any, t: float) -> float:
    """Return the derivative of a signal over time, or of several that add."""
    if isinstance(table, list | tuple):
        return sum(slope(term, t) for term in table)
    if isinstance(table, int | float):
        return 0.0
    if "sine" in table:
        s, omega = table["sine"], 2.0 * np.pi * table["sine"]["frequency_hz"]
        phase = np.radians(s.get("phase_deg", 0.0))
        return float(omega * s["amplitude"] * np.cos(omega * t + phase))
    if "smooth_step" in table:
        s = table["smooth_step"]
        duration = s["stop"] - s["start"]
        x = np.clip((t - s["start"]) / duration, 0.0, 1.0)
        return float(6.0 * x * (1.0 - x) * (s["to"] - s["from"]) / duration)
    times, values = table["time"], table["value"]
    k = int(np.searchsorted(times, t, side="right"))
    inside = 0 < k < len(times)
    return (values[k] - values[k - 1]) / (times[k] - times[k - 1]) if inside else 0.0


def torques(data: Scenario, t: float, omega: Array) -> Array:
    """Return the torques of the drive on the pulleys of a loaded scenario, as data."""
    values = np.zeros(len(omega))
    for j, pulley in enumerate(data["mechanism"]["pulleys"]):
        for table in terms_of(data["drive"].get(pulley["name"], {}).get("torque", [])):
            if isinstance(table, dict) and "speed" in table:
                values[j] += np.interp(omega[j], table["speed"], table["value"])
            else:
                values[j] += float(signal_over_time(table, np.array(t)))
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
