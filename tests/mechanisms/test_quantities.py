"""Quantities of a run, read a second time from its channels, its events and its scenario.

Statics are in the tests of their kinds. An integral over samples is known to the error of
trapezoids, `second_way.integral`.
"""

from math import inf, pi
from typing import Any

import numpy as np
import pytest

from frictionsim.results import Record
from tests.support.scenarios import Scenario, changed, scenario_run, shipped, sound
from tests.support.second_way import Seen, closed, integral, plus
from tests.support.shaft_forces import drawn_shaft

SWING = {"sine": {"mean": 2.0, "amplitude": 4.0, "frequency_hz": 0.7}}
RUNS: dict[str, Scenario] = {
    **{name: shipped(name) for name in ("pulley", "pulley_horizontal", "pulley_return")},
    "pulley by a torque": shipped("pulley", drive={"torque": 140.0}),
    "pulley of given speed": shipped("pulley", drive={"speed": SWING}),
    **{name: shipped(name) for name in ("marble_machine", "hard/motor_runs_back")},
    **{name: shipped(name) for name in ("epicyclic", "epicyclic_ring", "epicyclic_dwell")},
    "published gear": shipped(
        "epicyclic",
        mechanism__formulation="published",
        effects__hinge_friction={"torque_static": 0.15, "torque_kinetic": 0.15},
    ),
    **{name: shipped(name) for name in ("shaft", "hoist_drum", "swing_door", "stick_slip")},
    **{f"drawn shaft {n}": drawn_shaft(n) for n in (2, 5, 7)},
}


def inertia_of(data: Scenario) -> float:
    """Return the moment of inertia about the axis of the coordinate."""
    m, effects = data["mechanism"], data["effects"]
    if data["kind"] == "marble_machine":
        marbles = m["slots"] // 2 * m["marble_mass"] * m["marble_circle_radius"] ** 2
        motor = effects.get("motor_inertia", {"inertia": 0.0})["inertia"]
        return float(m["gear_inertia"] + marbles + m["gear_ratio"] ** 2 * motor)
    if data["kind"] == "epicyclic":
        inside = m.get("mesh") == "internal"
        length = m["sun_radius"] + (-1.0 if inside else 1.0) * m["planet_radius"]
        # A rod about its end, and a disc that rolls on the crank.
        planet = m["planet_mass"] * (length**2 + 0.5 * length**2)
        return float(m["crank_mass"] * length**2 / 3.0 + planet)
    eccentric = effects.get("eccentric_mass", {"mass": 0.0, "radius": 0.0})
    return float(m["inertia"] + eccentric["mass"] * eccentric["radius"] ** 2)


def potential_of(data: Scenario, angle: float) -> float:
    """Return the potential energy at an angle."""
    m, effects = data["mechanism"], data["effects"]
    g = effects.get("gravity", {"g": 0.0})["g"]
    if data["kind"] == "pulley":
        return float(m["load"] * m["cord_radius"] * angle)
    if data["kind"] == "marble_machine":
        pitch, weight = 2.0 * pi / m["slots"], m["marble_mass"] * g * m["marble_circle_radius"]
        rising = angle % pitch + pitch * np.arange(m["slots"] // 2)
        start = np.sum(1.0 - np.cos(pitch * np.arange(m["slots"] // 2)))
        lifted = np.sum(1.0 - np.cos(rising)) + 2.0 * (angle // pitch)
        return float(weight * (lifted - start))
    if data["kind"] == "epicyclic":
        inside, twice = m.get("mesh") == "internal", m["formulation"] == "published"
        length = m["sun_radius"] + (-1.0 if inside else 1.0) * m["planet_radius"]
        mass = 0.5 * m["crank_mass"] + (1.0 + twice) * m["planet_mass"]
        return float(mass * g * length * np.sin(angle))
    eccentric = effects.get("eccentric_mass", {"mass": 0.0, "radius": 0.0, "azimuth_deg": 0.0})
    azimuth = angle + np.radians(eccentric["azimuth_deg"])
    spring = effects.get("torsion_spring", {"stiffness": 0.0, "free_angle_deg": 0.0})
    twist = angle - np.radians(spring["free_angle_deg"])
    height = eccentric["radius"] * np.sin(azimuth)
    return float(eccentric["mass"] * g * height + 0.5 * spring["stiffness"] * twist**2)


def input_power(data: Scenario, of: Any) -> Any:
    """Return the power of the drive; that of a shaft follows from the energy balance."""
    m, w = data["mechanism"], of["angular_velocity"]
    if "motor_torque" in of:
        return of["motor_torque"] * m["gear_ratio"] * w
    if "drive_force" in of:
        return of["drive_force"] * m["cord_radius"] * w
    return of["drive_torque"] * w


def seen(run: Record) -> dict[str, Seen]:
    """Return what a reader sees of the quantities."""
    data, of, time = scenario_run(run).to_dict(), run.channels, run.time
    w, q = of["angular_velocity"], of["angle"]
    kinetic, first = 0.5 * inertia_of(data) * w**2, potential_of(data, q[0])
    final = potential_of(data, q[-1])
    values = {
        "final_time": closed(float(time[-1])),
        "final_angle": closed(float(q[-1])),
        "final_angular_velocity": closed(float(w[-1])),
        "energy_kinetic": closed(float(kinetic[-1])),
    }
    if "energy_potential" in of:
        offset = of["energy_potential"][0] - first  # of marbles, which have no zero
        values["energy_potential"] = Seen(final + offset, 1e-11 * (abs(final) + abs(first) + 1.0))
    if data["kind"] != "shaft":
        values["energy_input"] = integral(time, input_power(data, of))
    if "energy_friction" in of:
        values["energy_friction"] = integral(time, -of["friction_torque"] * w)
    if "energy_damping" in of:
        drag = data["effects"]["viscous_damping"]["coefficient"]
        values["energy_damping"] = integral(time, drag * w**2)
    if "mode" in of and "speed" not in data.get("drive", {}):
        changes = [e for e in run.transitions if e.mode_from != e.mode_to]
        slips = [e.time for e in changes if e.mode_from == 0]
        rests = [e.time for e in changes if e.mode_to == 0]
        values["breakaway_time"] = Seen(slips[0] if slips else None)
        values["last_rest_time"] = Seen(rests[-1] if rests else None)
    if data["kind"] == "marble_machine":
        cell = q // (2.0 * pi / data["mechanism"]["slots"])
        values["marbles_delivered"] = closed(float(cell.max() - cell[0]))
        work: Any = values["energy_input"]
        values["motor_power_mean"] = Seen(work.value / time[-1], work.uncertainty / time[-1])
    return values


@pytest.mark.parametrize("name", RUNS)
def test_quantities_of_a_run_are_of_its_channels(name: str) -> None:
    run = sound(changed(RUNS[name], output__interval=1e-3, solver__rtol=1e-10))
    quantities = {n: run.quantities[n].value for n in seen(run)}
    wrong = {n: (quantities[n], s) for n, s in seen(run).items() if not s.agrees(quantities[n])}
    assert wrong == {}
    of, time = run.channels, run.time
    w = of["angular_velocity"]
    assert plus(float(of["angle"][0]), integral(time, w)).agrees(float(of["angle"][-1]))
    stops = any(e.contact == "stop" for e in run.transitions)  # whose impacts jump
    if not stops:
        gained = plus(float(w[0]), integral(time, of["angular_acceleration"]))
        assert gained.agrees(float(w[-1]))
    # Modes of samples follow from the events before them; at an event they may be of either side.
    if "mode" in of and not stops:
        changes = [e for e in run.transitions if e.mode_from != e.mode_to]
        first = changes[0].mode_from if changes else int(of["mode"][0])
        modes = np.array([first, *(e.mode_to for e in changes)])
        times = np.array([-inf, *(e.time for e in changes)])
        after = modes[np.searchsorted(times, time, side="right") - 1]
        before = modes[np.searchsorted(times, time, side="left") - 1]
        assert np.all((of["mode"] == after) | (of["mode"] == before))
        assert not np.any(w[of["mode"] == 0])
