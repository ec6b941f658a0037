"""Hypothesis strategies for valid random scenarios, and the properties they must have."""

from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st

import frictionsim as fs
from frictionsim.results import Record
from tests.support.scenarios import Scenario, scenario_run, simulate, with_method

DURATION = 2.0
PUBLISHED = "published"


def of_size(minimum: float, maximum: float) -> Any:
    """Return numbers over several orders of magnitude."""
    return st.floats(np.log10(minimum), np.log10(maximum)).map(lambda x: float(10.0**x))


def signals(size: float, shortest: float = 1e-9) -> Any:
    """Return constants, and signals in time whose pieces have at least the shortest length, s."""
    values = st.floats(-size, size)
    return st.one_of(
        values,
        st.lists(values, min_size=2, max_size=5).flatmap(
            lambda value: st.builds(
                lambda gaps: {"time": np.cumsum(gaps).tolist(), "value": value},
                st.lists(of_size(shortest, 1.0), min_size=len(value), max_size=len(value)),
            )
        ),
        st.builds(
            lambda mean, amplitude, hz, phase: {
                "sine": {
                    "mean": mean,
                    "amplitude": amplitude,
                    "frequency_hz": hz,
                    "phase_deg": phase,
                }
            },
            values,
            values,
            st.floats(0.1, 8.0),
            st.floats(-180.0, 180.0),
        ),
        st.builds(
            lambda a, b, start, length: {
                "smooth_step": {"from": a, "to": b, "start": start, "stop": start + length}
            },
            values,
            values,
            st.floats(0.0, 1.0),
            of_size(1e-6, 1.0),
        ),
    )


@st.composite
def shafts(draw: st.DrawFn, thickest: float, pressed: float = 0.0) -> dict[str, float]:
    """Draw the friction of a shaft; of some with a normal load of about so many N."""
    mu_s = draw(st.one_of(st.just(0.0), of_size(1e-3, 2.0)))
    mu_k = mu_s * draw(st.sampled_from([0.0, 0.5, 0.99, 1.0]))
    journal = {"shaft_radius": thickest * draw(of_size(0.01, 1.0)), "mu_s": mu_s, "mu_k": mu_k}
    if pressed and draw(st.integers(0, 3)) == 0:
        journal["normal_load"] = pressed * draw(of_size(0.01, 10.0))
    return journal


def switched(draw: st.DrawFn, effects: dict[str, Any]) -> dict[str, Any]:
    """Return a random subset of the effects, most of them."""
    return {name: draw(table) for name, table in effects.items() if draw(st.integers(0, 3))}


@st.composite
def pulleys(draw: st.DrawFn) -> Scenario:
    inertia = draw(of_size(1e-2, 1e3))
    return {
        "kind": "pulley",
        "mechanism": {
            "cord_radius": 0.05,
            "inertia": inertia,
            "load": draw(st.one_of(st.just(0.0), of_size(1.0, 1e4))),
            "initial_angular_velocity": draw(st.sampled_from([0.0, 0.0, 3.0, -3.0])),
        },
        "drive": {
            "force": draw(signals(5000.0)),
            "direction": draw(st.sampled_from(["vertical", "horizontal"])),
        },
        "effects": switched(
            draw,
            {
                "shaft_friction": shafts(0.05, pressed=2000.0),
                "viscous_damping": st.fixed_dictionaries({"coefficient": st.just(inertia)}),
            },
        ),
    }


@st.composite
def marble_machines(draw: st.DrawFn) -> Scenario:
    motor = {"stall_torque": draw(of_size(1e-3, 1.0)), "no_load_speed": draw(of_size(0.5, 20.0))}
    drive = {"motor": motor} if draw(st.booleans()) else {"torque": draw(signals(0.02))}
    return {
        "kind": "marble_machine",
        "mechanism": {
            "pinion_radius": 0.018,
            "pressure_angle_deg": draw(st.floats(0.0, 30.0)),
            "gear_ratio": draw(st.floats(0.5, 8.0)),
            "mesh_azimuth_deg": draw(st.floats(-180.0, 180.0)),
            "slots": 2 * draw(st.integers(1, 10)),
            "marble_mass": 0.007,
            "marble_circle_radius": 0.057,
            "gear_mass": 0.128,
            "gear_inertia": draw(of_size(1e-5, 1e-2)),
        },
        "drive": drive,
        "effects": switched(
            draw,
            {
                "gravity": st.just({"g": 9.81}),
                "shaft_friction": shafts(0.005, pressed=2.0),
                "viscous_damping": st.just({"coefficient": 0.002}),
                "motor_inertia": st.fixed_dictionaries({"inertia": of_size(1e-6, 1e-3)}),
            },
        ),
    }


@st.composite
def gears(draw: st.DrawFn) -> Scenario:
    static = draw(st.one_of(st.just(0.0), of_size(1e-3, 2.0)))
    hinge = {"torque_static": static, "torque_kinetic": static * draw(st.sampled_from([0.5, 1.0]))}
    speed = draw(st.integers(0, 4)) == 0
    # The time has a roundoff of 2e-16 s; at the end of a steep ramp that is an error of the speed.
    speeds = signals(5.0, shortest=1e-5)
    loads = st.sampled_from(["weight", "radial"])
    sun = draw(of_size(0.02, 0.5))
    return {
        "kind": "epicyclic",
        "mechanism": {
            "sun_radius": sun,
            "planet_radius": 0.06,
            "mesh": draw(st.sampled_from(["external", "internal"])) if sun > 0.08 else "external",
            "crank_mass": draw(of_size(0.01, 10.0)),
            "planet_mass": draw(of_size(0.01, 10.0)),
            "initial_angle_deg": draw(st.floats(-180.0, 180.0)),
            "initial_angular_velocity": 0.0 if speed else draw(st.floats(-5.0, 5.0)),
        },
        "drive": {"speed": draw(speeds)} if speed else {"torque": draw(signals(8.0))},
        "effects": switched(
            draw,
            {
                "gravity": st.just({"g": 9.81}),
                "hinge_friction": st.just(hinge),
                "rolling_friction": st.fixed_dictionaries(
                    {"arm": of_size(1e-5, 5e-3), "normal_load": loads}
                ),
            },
        ),
    }


def sizes(size: float) -> Any:
    """Return signals over time, and tables over angle and speed."""
    values = st.lists(st.floats(-size, size), min_size=3, max_size=3)
    return st.one_of(
        signals(size),
        st.builds(lambda value: {"angle_deg": [-90.0, 0.0, 40.0], "value": value}, values),
        st.builds(lambda value: {"speed": [-4.0, 0.0, 3.0], "value": value}, values),
    )


@st.composite
def forces(draw: st.DrawFn) -> dict[str, Any]:
    azimuth = draw(st.sampled_from([0.0, np.pi / 2, 1.1, 4.0]))
    force = {
        "size": draw(sizes(500.0)),
        "direction": [float(np.cos(azimuth)), float(np.sin(azimuth))],
    }
    if draw(st.booleans()):
        return force | {"cord_radius": draw(st.sampled_from([0.1, -0.05]))}
    return force | {
        "point": [draw(st.sampled_from([0.2, -0.1])), draw(st.sampled_from([0.0, 0.15]))],
        "point_turns": draw(st.booleans()),
        "direction_turns": draw(st.booleans()),
    }


@st.composite
def bodies(draw: st.DrawFn) -> Scenario:
    """Return bodies on a shaft, under forces and couples."""
    inertia = draw(of_size(1e-2, 1e2))
    mechanism = {
        "inertia": inertia,
        "mass": draw(st.sampled_from([0.0, 10.0])),
        "initial_angle_deg": draw(st.sampled_from([0.0, 40.0, -200.0])),
        "initial_angular_velocity": draw(st.sampled_from([0.0, 0.0, 3.0, -3.0])),
    }
    eccentric = {"mass": of_size(1e-2, 10.0), "radius": of_size(1e-2, 0.3)}
    spring = {"stiffness": of_size(1e-2, 1e3), "free_angle_deg": st.just(10.0)}
    arrays = {
        "forces": draw(st.lists(forces(), min_size=1, max_size=3)),
        "couples": draw(st.lists(st.fixed_dictionaries({"size": sizes(30.0)}), max_size=2)),
    }
    for table, parts in arrays.items():
        for i, part in enumerate(parts):
            part["name"] = f"{table}_{i}"
    return {
        "kind": "shaft",
        "mechanism": mechanism,
        **arrays,
        "effects": switched(
            draw,
            {
                "gravity": st.just({"g": 9.81}),
                "shaft_friction": shafts(0.04, pressed=30.0),
                "viscous_damping": st.fixed_dictionaries({"coefficient": st.just(inertia)}),
                "eccentric_mass": st.fixed_dictionaries(eccentric),
                "torsion_spring": st.fixed_dictionaries(spring),
            },
        ),
    }


@st.composite
def scenarios(draw: st.DrawFn) -> Scenario:
    data = draw(st.one_of(pulleys(), marble_machines(), gears(), bodies()))
    solver = {
        "backend": draw(st.sampled_from(["events", "rkf45", PUBLISHED])),
        "duration": DURATION,
        "rtol": draw(st.sampled_from([1e-4, 1e-7, 1e-10])),
        "max_steps": 20_000,
    }
    data |= {"output": {"interval": draw(st.sampled_from([0.01, 0.3]))}}
    if solver["backend"] != PUBLISHED:
        return data | {"solver": solver}
    if data["kind"] not in ("pulley", "shaft"):
        return data | {"solver": solver | {"backend": "events"}}
    return with_method(data | {"solver": solver}, PUBLISHED, "rkf45")


def assert_sound(data: Scenario, folder: Path) -> None:
    """Check the result file of a scenario."""
    done = simulate(data)
    kept = fs.open(fs.Result(done).save(folder / "a.h5")).record
    for name, signal in (*kept.channels.items(), *kept.events.items()):
        # M/R has no value without a reaction.
        assert name.startswith("lever_arm") or np.all(np.isfinite(signal)), name
    assert kept.attributes["status"] == done.status
    if done.status != "done":
        assert done.failure
    elif scenario_run(done).law != PUBLISHED:
        assert_lawful(done)


def assert_lawful(done: Record) -> None:
    checks = dict(done.checks)
    # The local errors of all steps may add up. That of an angle is relative to its magnitude, but
    # the potential energy depends on the absolute error: after many turns it may exceed the limit
    # of the audit, 100 rtol.
    energy = checks.pop("energy_balance")
    turns = max(1.0, float(np.max(np.abs(done.channels["angle"]))))
    assert energy.value <= max(
        energy.limit, done.statistics.steps * scenario_run(done).solver.rtol * turns
    )
    assert {name: check for name, check in checks.items() if not check.ok} == {}
    if "mode" not in done.channels or "speed" in getattr(
        getattr(scenario_run(done), "drive", None), "model_fields_set", ()
    ):
        return
    names = ("friction_torque", "angular_velocity", "angular_acceleration", "mode")
    friction, velocity, acceleration, mode = (done.channels[name] for name in names)
    # Below the absolute tolerance a speed may have either sign.
    moving = np.abs(velocity) > scenario_run(done).solver.atol
    assert np.all((friction * velocity)[moving] <= 0.0)
    assert np.all((mode * velocity)[moving] > 0.0)
    assert not np.any(velocity[mode == 0.0])
    assert not np.any(acceleration[mode == 0.0])
    energies = {name: values for name, values in done.channels.items() if "energy_" in name}
    largest = max((float(np.max(np.abs(values))) for values in energies.values()), default=0.0)
    for heat in energies.keys() & {"energy_friction", "energy_damping"}:
        # A method's weights are not all positive: less than its tolerance may come back.
        lost = np.diff(energies[heat])
        assert np.min(lost) >= -1e-12 - scenario_run(done).solver.rtol * largest
