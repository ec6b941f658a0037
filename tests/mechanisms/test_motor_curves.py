"""Motor curves and sums of signals of pulley and lift, and an inertia that masses alone give.

A pulley on which a torque or forces act is a body on a shaft with couples and cords, for which
there is an independent program: each term of a sum is a load of its own there. A lift whose ropes
stay taut is one coordinate, which SciPy's DOP853 integrates between its events here.
"""

from math import hypot, pi
from random import Random
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import frictionsim as fs
from tests.support.cases import one_in
from tests.support.scenarios import Scenario, pulley, shipped, simulate, sound
from tests.support.shaft_reference import size_of, solution
from tests.support.shaft_scenarios import ramp, signal, sine

TIME, ANGLE = 1e-9, 1e-8  # s, rad: rtol 1e-11 over some hundred steps


def motor(rng: Random, size: float) -> Scenario:
    """Return a motor curve, whose torque falls with the speed."""
    falls = [size, 0.8 * size, 0.3 * size, -0.5 * size, -size]
    return {"speed": [-6.0, -1.0, rng.choice([0.0, 0.4]), 3.0, 8.0], "value": falls}


def drawn_pulley(number: int) -> tuple[Scenario, Scenario]:
    """Return a pulley with a sum as its drive, and the same as a body on a shaft."""
    rng = Random(number)
    arm, load = rng.uniform(0.1, 0.3), rng.uniform(50.0, 200.0)
    by_torque = number % 3 != 0
    size, mean = (arm * load, arm * load) if by_torque else (load, load)
    terms: list[Any] = [mean, signal(rng, size), sine(0.0, 0.4 * size, rng.uniform(0.5, 3.0))]
    if by_torque:
        terms[rng.randrange(3)] = motor(rng, size)
        terms += [ramp(0.2, 0.0, 0.5, 0.5 * size, 1.5, -size)][: number % 2]
    mu = rng.uniform(0.1, 0.5)
    effects = {
        "shaft_friction": {"shaft_radius": 0.4 * arm, "mu_s": 1.3 * mu, "mu_k": mu},
        "viscous_damping": {"coefficient": rng.uniform(0.0, 0.5)},
    }
    mechanism = {"inertia": rng.uniform(0.5, 3.0)}
    common = {"effects": effects, "solver": {"duration": 2.0, "rtol": 1e-11, "atol": 1e-13}}
    drive: Scenario = {"torque" if by_torque else "force": terms}
    down = {"direction": [0.0, -1.0]}
    forces = [{"name": "load", "size": load, "cord_radius": -arm, **down}]
    named = [{"name": f"t{i}", "size": term} for i, term in enumerate(terms)]
    if not by_torque:
        forces += [{**each, "cord_radius": arm, **down} for each in named]
    body = {"forces": forces, "couples": named if by_torque else [], "mechanism": mechanism}
    hung = {"mechanism": {"cord_radius": arm, "load": load, **mechanism}, "drive": drive}
    return {"kind": "pulley", **hung, **common}, {"kind": "shaft", **body, **common}


@pytest.mark.parametrize("number", one_in(10, range(100)))
def test_a_drawn_sum_moves_a_pulley_as_its_terms_move_a_body_on_a_shaft(number: int) -> None:
    data, body = drawn_pulley(number)
    done, wanted = sound(data), solution(body)
    events = [(e.time, e.mode_from, e.mode_to) for e in done.transitions]
    assert [e[1:] for e in events] == [tuple(e[1:3]) for e in wanted["events"]]
    times = [e[0] for e in wanted["events"]]
    assert [e[0] for e in events] == pytest.approx(times, abs=TIME)
    final = [done.channels[name][-1] for name in ("angle", "angular_velocity")]
    assert final == pytest.approx(wanted["final"], abs=ANGLE)


def drawn_lift(number: int, *, is_massless: bool) -> Scenario:
    """Return a lift on ropes under a motor curve and more, whose torques leave the ropes taut."""
    rng = Random(number)
    r, car = rng.uniform(0.1, 0.4), rng.uniform(50.0, 500.0)
    counterweight = car * rng.uniform(0.8, 1.25)
    mass, mu = car + counterweight, rng.uniform(0.05, 0.3)
    size = 0.15 * mass * 9.81 * r
    balance = (car - counterweight) * 9.81 * r
    terms = [balance, motor(rng, size), sine(0.0, size, rng.uniform(0.3, 2.0), 90.0)]
    effects: Scenario = {"hanging_masses": {"car": car, "counterweight": counterweight}}
    effects["shaft_friction"] = {"shaft_radius": 0.2 * r, "mu_s": 1.2 * mu, "mu_k": mu}
    if number % 2:
        effects["viscous_damping"] = {"coefficient": 0.05 * mass * r * r}
    inertia = 0.0 if is_massless else mass * r * r * rng.uniform(0.05, 1.0)
    return {
        "kind": "pulley",
        "mechanism": {"cord_radius": r, "inertia": inertia},
        "drive": {"torque": terms},
        "effects": effects,
        "solver": {"duration": 2.0, "rtol": 1e-11, "atol": 1e-13},
    }


class TautLift:
    """A lift with taut ropes, from the laws of Newton and Euler of pulley and masses together."""

    def __init__(self, data: Scenario) -> None:
        masses, effects = data["effects"]["hanging_masses"], data["effects"]
        self.m1, self.m2 = masses["car"], masses["counterweight"]
        self.r, self.inertia = data["mechanism"]["cord_radius"], data["mechanism"]["inertia"]
        self.sizes = [size_of(term) for term in data["drive"]["torque"]]
        self.b = effects.get("viscous_damping", {"coefficient": 0.0})["coefficient"]
        shaft = effects["shaft_friction"]
        self.r_s, self.r_k = (
            shaft["shaft_radius"] * shaft[mu] / hypot(1.0, shaft[mu]) for mu in ("mu_s", "mu_k")
        )
        corners = {k for size in self.sizes if size.over == "speed" for k in size.knots}
        self.corners = sorted(corners)

    def torque(self, t: float, w: float) -> float:
        return sum(float(s.value(t if s.over == "time" else w)) for s in self.sizes)

    def margin(self, t: float) -> float:
        """Return how far the moment at rest is above the limit; the sign is its direction."""
        moment = (self.m2 - self.m1) * 9.81 * self.r + self.torque(t, 0.0)
        return abs(moment) - self.r_s * (self.m1 + self.m2) * 9.81

    def slope(self, t: float, w: float, s: int) -> float:
        """Return w' of three equations for w', T1 and T2."""
        r, r_k = self.r, s * self.r_k
        left = np.array([[1.0, 0.0, -self.m1 * r], [0.0, 1.0, self.m2 * r],
                         [r + r_k, r_k - r, self.inertia]])  # fmt: skip
        right = [self.m1 * 9.81, self.m2 * 9.81, self.torque(t, w) - self.b * w]
        return float(np.linalg.solve(left, right)[2])

    def run(self, end: float) -> tuple[list[tuple[float, int, int]], float, float]:
        """Return events and the final angle and velocity."""
        t, q, w, s, events = 0.0, 0.0, 0.0, 0, list[tuple[float, int, int]]()
        while t < end:
            if s == 0:
                grid = np.linspace(t, end, 4000)
                over = [i for i, at in enumerate(grid) if self.margin(float(at)) > 1e-9]
                if not over:
                    break
                if over[0]:
                    at = float(grid[over[0] - 1]), float(grid[over[0]])
                    t = float(brentq(self.margin, *at, xtol=1e-15))
                moment = (self.m2 - self.m1) * 9.81 * self.r + self.torque(t, 0.0)
                s = 1 if moment > 0.0 else -1
                events.append((t, 0, s))
                continue
            levels = [0.0, *[c for c in self.corners if c]]
            stops = [_passes(c, t, s if abs(w - c) < 1e-12 else w - c) for c in levels]
            y = solve_ivp(
                lambda t, y, s=s: [y[1], self.slope(t, y[1], s)],
                (t, end),
                [q, w],
                method="DOP853",
                max_step=2e-3,  # so that none steps over a short rest
                rtol=1e-13,
                atol=1e-15,
                events=stops,
            )
            t, (q, w) = float(y.t[-1]), y.y[:, -1].tolist()
            if len(y.t_events[0]):
                events.append((t, s, 0 if self.margin(t) <= 0.0 else -s))
                w, s = 0.0, events[-1][2]
        return events, q, w


def _passes(level: float, begin: float, side: float) -> Any:
    """Return an event of SciPy, at which a speed comes to a level from a side, not at once."""

    def event(t: float, y: Any) -> float:
        return float(y[1] - level) if t > begin + 1e-9 else float(np.sign(side))

    event.terminal = True  # type: ignore[attr-defined]
    return event


@pytest.mark.parametrize("is_massless", [False, True])
@pytest.mark.parametrize("number", one_in(20, range(100)))
def test_a_drawn_motor_moves_a_lift_as_scipy_does(number: int, *, is_massless: bool) -> None:
    data = drawn_lift(number, is_massless=is_massless)
    done = sound(data)
    events, angle, velocity = TautLift(data).run(2.0)
    assert not [e for e in done.transitions if e.contact != "shaft"]
    assert [(e.mode_from, e.mode_to) for e in done.transitions] == [e[1:] for e in events]
    assert [e.time for e in done.transitions] == pytest.approx([e[0] for e in events], abs=TIME)
    assert done.channels["angle"][-1] == pytest.approx(angle, abs=ANGLE)
    assert done.channels["angular_velocity"][-1] == pytest.approx(velocity, abs=ANGLE)


def test_a_linear_motor_curve_runs_up_exponentially() -> None:
    """I w' = M - c w - W r - r_k W."""
    curve = {"speed": [-100.0, 100.0], "value": [200.0 + 300.0, 200.0 - 300.0]}
    done = sound(pulley(drive={"torque": curve}, effects__viscous_damping=None))
    r_k = 0.0254 * 0.1 / hypot(1.0, 0.1)
    final = (200.0 - 2224.1 * (0.0508 + r_k)) / 3.0
    wanted = final * (1.0 - np.exp(-3.0 / 1.355 * done.time))
    assert done.channels["angular_velocity"] == pytest.approx(wanted, rel=1e-8, abs=1e-9)
    torque = 200.0 - 3.0 * done.channels["angular_velocity"]
    assert done.channels["drive_torque"] == pytest.approx(torque, rel=1e-12)


def test_a_list_is_the_sum_of_its_terms() -> None:
    ramp_and_wave = [1000.0, ramp(0.0, 900.0, 0.8, 2100.0)]
    one = sound(pulley(drive__force=ramp(0.0, 1900.0, 0.8, 3100.0)))
    sum_of_two = sound(pulley(drive__force=ramp_and_wave))
    for name, values in one.channels.items():
        largest = max(1.0, float(np.max(np.abs(values))))
        assert sum_of_two.channels[name] == pytest.approx(values, abs=1e-9 * largest), name


def test_a_short_peak_of_a_sum_is_not_missed() -> None:
    """Two waves exceed the limit together for 2 ms in 10 s, and nothing else does."""
    limit = 2224.1 * (0.0508 + 0.0254 * 0.2 / hypot(1.0, 0.2))
    low, high = sine(limit - 3.0, 2.0, 0.05, 0.0), sine(0.0, 1.0 + 1e-6, 7.0, 90.0)
    data = pulley(drive={"torque": [low, high]}, solver__duration=10.0, output__interval=1.0)
    done = sound(data)
    first = done.transitions[0]
    # Both peaks coincide at 5 s: 1e-6 = 1/2 w^2 dt^2 of the fast one.
    early = np.sqrt(2e-6) / (2.0 * pi * 7.0)
    assert first.time == pytest.approx(5.0 - early, abs=3e-7)


def test_a_massless_atwood_machine_falls_as_in_the_textbook() -> None:
    effects = {"hanging_masses": {"car": 2.0, "counterweight": 3.0}}
    data = {"kind": "pulley", "mechanism": {"cord_radius": 0.1, "inertia": 0.0}}
    data |= {"drive": {"force": 0.0}, "effects": effects, "solver": {"duration": 1.0}}
    c = sound(data).channels
    assert c["car_acceleration"] == pytest.approx(9.81 / 5.0, rel=1e-14)
    tension = 2.0 * 2.0 * 3.0 * 9.81 / 5.0
    for side in ("car", "counterweight"):
        assert c[f"rope_tension_{side}"] == pytest.approx(tension, rel=1e-14)
    assert c["car_position"][-1] == pytest.approx(0.5 * 9.81 / 5.0, rel=1e-9)


def test_a_massless_body_with_an_eccentric_mass_is_a_pendulum() -> None:
    """From 90 degrees: w^2 = 2 g/e sin(angle below)."""
    effects = {"gravity": {}, "eccentric_mass": {"mass": 2.0, "radius": 0.5}}
    data = {"kind": "shaft", "mechanism": {"inertia": 0.0}, "effects": effects}
    data |= {"solver": {"duration": 2.0, "rtol": 1e-11, "atol": 1e-13}}
    c = sound(data).channels
    energy = 2.0 * 9.81 / 0.5 * -np.sin(c["angle"])
    assert c["angular_velocity"] ** 2 == pytest.approx(energy, abs=1e-8)


@pytest.mark.parametrize("number", one_in(20, range(100)))
def test_a_drawn_massless_body_moves_as_newton_and_euler_say(number: int) -> None:
    rng = Random(500 + number)
    eccentric = {"mass": rng.uniform(1.0, 5.0), "radius": rng.uniform(0.2, 0.5)}
    effects = {
        "gravity": {"g": 9.81},
        "eccentric_mass": eccentric | {"azimuth_deg": rng.uniform(-180.0, 180.0)},
        "shaft_friction": {"shaft_radius": 0.05, "mu_s": 0.4, "mu_k": 0.25},
    }
    data = {
        "kind": "shaft",
        "mechanism": {"inertia": 0.0, "mass": 3.0},
        "couples": [{"name": "c", "size": signal(rng, 10.0)}],
        "effects": effects,
        "solver": {"duration": 1.0, "rtol": 1e-11, "atol": 1e-13},
    }
    done, wanted = sound(data), solution(data)
    assert [(e.mode_from, e.mode_to) for e in done.transitions] == [
        tuple(e[1:3]) for e in wanted["events"]
    ]
    times = [e[0] for e in wanted["events"]]
    assert [e.time for e in done.transitions] == pytest.approx(times, abs=TIME)
    final = [done.channels[name][-1] for name in ("angle", "angular_velocity")]
    assert final == pytest.approx(wanted["final"], abs=10.0 * ANGLE)


ROPES: Scenario = {"mechanism.inertia": 0.0, "effects.cord_friction": None}
UNDEFINED = [
    (pulley(), {"mechanism.inertia": 0.0}, "load is a force without inertia"),
    (shipped("lift"), {"mechanism.inertia": 0.0}, "a slipping cord gives none"),
    (shipped("lift"), ROPES | {"drive.torque": -6000.0}, "a slack rope gives none"),
    (
        shipped("lift"),
        ROPES | {"drive.torque": {"speed": [0.0, 9.0], "value": [0.0, 9000.0]}},
        "with this drive a tension may fall to ",
    ),
    (
        shipped("lift"),
        ROPES | {"drive.torque": 0.0, "effects.viscous_damping": {"coefficient": 1e3}}
        | {"mechanism.initial_angular_velocity": 50.0},
        "a slack rope gives none",
    ),
    (
        shipped("shaft"),
        {"mechanism.inertia": 0.0, "effects.eccentric_mass": None},
        "no eccentric mass beside the axis gives some",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("data", "changes", "message"), UNDEFINED)
def test_an_inertia_of_nothing_is_refused(data: Scenario, changes: Any, message: str) -> None:
    with pytest.raises(fs.ScenarioError) as error:
        fs.load(data, changes)
    (fault,) = error.value.faults
    assert "mechanism.inertia: 0" in fault
    assert message in fault


def test_a_motor_curve_is_over_the_speed_of_the_pulley_and_not_of_a_slipping_cord() -> None:
    curve = {"speed": [0.0, 4.0, 8.0], "value": [3000.0, 2000.0, -9000.0]}
    done = simulate(shipped("lift", drive={"torque": curve}, solver__duration=1.0))
    c = done.channels
    assert np.any(c["cord_mode"] != 0)
    torque = np.interp(c["angular_velocity"], curve["speed"], curve["value"])
    assert c["drive_torque"] == pytest.approx(torque, rel=1e-12)
    ratio = c["rope_tension_counterweight"] / c["rope_tension_car"]
    slipping = c["cord_mode"] == -1 if np.any(c["cord_mode"] == -1) else c["cord_mode"] == 1
    wanted = float(np.sign(c["cord_mode"][slipping][0])) * 0.116 * pi
    assert np.log(ratio[slipping]) == pytest.approx(wanted, rel=1e-12)
