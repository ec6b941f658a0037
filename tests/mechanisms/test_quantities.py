"""Quantities of random scenarios against their independent evaluation."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import frictionsim as fs
from frictionsim.results import Quantities, Record
from tests.support.drawn_scenarios import (
    gears,
    marble_machines,
    of_size,
    pulleys,
    shafts,
    signals,
    switched,
)
from tests.support.examples import examples
from tests.support.scenarios import Scenario, scenario_run, shipped, simulate
from tests.support.second_way import Event, Recorded, Seen, Table, motion, residuals
from tests.support.second_way_bodies import body, body_statics
from tests.support.second_way_gears import epicyclic, gear_statics
from tests.support.second_way_shafts import (
    first_breakaway,
    machine_statics,
    marble_machine,
    pulley,
    pulley_statics,
)

READERS: dict[str, Callable[[Recorded], dict[str, Seen]]] = {
    "pulley": pulley,
    "marble_machine": marble_machine,
    "epicyclic": epicyclic,
    "shaft": body,
}
STATICS: dict[str, Callable[[Table], dict[str, Seen]]] = {
    "pulley": pulley_statics,
    "marble_machine": machine_statics,
    "epicyclic": gear_statics,
    "shaft": body_statics,
}


def recorded(done: Record) -> Recorded:
    """Return the content of a run's result file: scenario with defaults, channels and events."""
    events = [Event(*event) for event in done.transitions]
    return Recorded(scenario_run(done).to_dict(), done.time, done.channels, events)


def disagreements(quantities: Quantities, seen: dict[str, Seen]) -> dict[str, Any]:
    """Return the quantities on which both ways disagree; their names must agree."""
    assert quantities.keys() == seen.keys()
    return {n: (q.value, seen[n]) for n, q in quantities.items() if not seen[n].agrees(q.value)}


def assert_second_way(data: Scenario) -> Record:
    done = simulate(data)
    assert done.status == "done", done.reason
    record = recorded(done)
    assert disagreements(done.quantities, READERS[data["kind"]](record)) == {}
    for name, seen in motion(record).items():
        assert seen.agrees(float(record.channels[name][-1])), name
    if "mode" in record.channels and "speed" not in record.scenario.get("drive", {}):
        assert residuals(record) == []
    quantities = fs.static(scenario_run(done))
    assert disagreements(quantities, STATICS[data["kind"]](record.scenario)) == {}
    return record


def test_every_kind_of_one_degree_of_freedom_has_a_reader() -> None:
    assert READERS.keys() == STATICS.keys() == set(fs.kinds()) - {"belt_drive"}


# Initial angles, so that no quantity depends on a start at zero.
angles = st.one_of(st.just(0.0), st.floats(-400.0, 400.0))


@st.composite
def visible_signals(draw: st.DrawFn, size: float, jumps: bool) -> Any:
    """Signals whose segments last at least 0.01 s, to be resolved by samples; one may jump."""
    table = draw(signals(size))
    if isinstance(table, float) or "sine" in table:
        return table
    if "smooth_step" in table:
        table["smooth_step"]["stop"] += 0.01
        return table
    gaps = draw(st.lists(of_size(0.01, 1.0), min_size=5, max_size=5))[: len(table["value"])]
    table["time"] = np.cumsum(gaps).tolist()
    if jumps and draw(st.booleans()):
        table["time"][1] = table["time"][0] + 1e-6
    return table


def interval_of(data: Scenario) -> float:
    """Return a twentieth of the time constant of the motor with its gear, at most 1 ms.

    That time is made a millisecond at least: strong motors have heavy gears.
    """
    if "motor" not in data["drive"]:
        return 1e-3
    motor, geometry = data["drive"]["motor"], data["mechanism"]
    stiffness = geometry["gear_ratio"] ** 2 * motor["stall_torque"] / motor["no_load_speed"]
    geometry["gear_inertia"] = max(geometry["gear_inertia"], 1e-3 * stiffness)
    return min(1e-3, 0.05 * geometry["gear_inertia"] / stiffness)


@st.composite
def scenarios(draw: st.DrawFn, kind: Any, size: float) -> Scenario:
    data = draw(kind)
    for name in {"force", "torque", "speed"} & data["drive"].keys():
        # The torque of a jump in speed is an impulse, which no sample resolves.
        data["drive"][name] = draw(visible_signals(size, jumps=name != "speed"))
    if draw(st.booleans()):
        # No smaller one: what rounding leaves of it decides on which side of a transfer it is.
        data["mechanism"]["initial_angle_deg"] = round(draw(angles), 9)
    return draw(solved(st.just(data)))


@st.composite
def solved(draw: st.DrawFn, kind: Any) -> Scenario:
    """Scenarios with a backend, and samples that resolve their motion."""
    data = draw(kind)
    interval = interval_of(data)
    duration = min(1.0, 5000 * interval)
    solver = {"backend": draw(st.sampled_from(["events", "rkf45"])), "duration": duration}
    return data | {"solver": solver, "output": {"interval": interval}}


@st.composite
def gears_with_points(draw: st.DrawFn) -> Scenario:
    """Gears in both formulations, with points of the rim and off it."""
    data = draw(gears())
    rolling = data["effects"].get("rolling_friction", {"normal_load": "weight"})
    if rolling["normal_load"] == "weight" and draw(st.booleans()):
        data["mechanism"]["formulation"] = "published"
    if draw(st.booleans()):
        data["effects"]["tracer_point"] = draw(points([0.06, 0.06, 0.0, 0.03, 0.066]))
    return data


def points(radii: list[float]) -> Any:
    return st.fixed_dictionaries(
        {
            "radius": st.sampled_from(radii),
            "angle_deg": st.one_of(st.just(180.0), st.floats(-180.0, 180.0)),
            "dwell_distance": st.sampled_from([1e-3, 1e-2]),
        }
    )


@st.composite
def gears_that_dwell(draw: st.DrawFn) -> Scenario:
    """Gears of small planets on light cranks, which pass places near the sun or turn before."""
    data = draw(gears_with_points())
    speed, way = draw(st.floats(2.0, 5.0)), draw(st.sampled_from([1.0, -1.0]))
    data["mechanism"] |= {"sun_radius": draw(st.floats(0.12, 0.4)), "crank_mass": 0.2}
    data["mechanism"]["planet_mass"] = draw(st.floats(0.1, 0.5))
    if "speed" in data["drive"]:
        data["drive"]["speed"] = {"time": [0.0, 1.0], "value": [way * speed, draw(ends) * speed]}
    else:
        data["drive"]["torque"] = draw(ends) * 2.0
        data["mechanism"]["initial_angular_velocity"] = way * speed
    data["effects"]["tracer_point"] = draw(points([0.06, 0.03, 0.066]))
    return data


ends = st.floats(-1.0, 1.0)


def rounded(table: Any) -> Any:
    """Return a signal with nine digits behind the point: no size or arm that is of rounding."""
    if isinstance(table, dict):
        return {key: rounded(value) for key, value in table.items()}
    return [rounded(x) for x in table] if isinstance(table, list) else round(table, 9)


@st.composite
def bodies(draw: st.DrawFn) -> Scenario:
    """Bodies on a shaft under forces of all forms, with or without an unknown of statics."""
    number = st.floats(-20.0, 20.0).map(lambda x: round(x, 6))
    sizes = st.one_of(visible_signals(20.0, jumps=True).map(rounded), number, bent())
    arms, shares = st.floats(0.1, 0.5), st.floats(-1.0, 1.0).map(rounded)

    def force(name: str) -> dict[str, Any]:
        size, direction = draw(sizes), [draw(shares), draw(arms)]
        table = {"name": name, "size": size, "direction": direction}
        if draw(st.integers(0, 3)) == 0:
            return table | {"cord_radius": draw(st.sampled_from([-0.2, 0.3]))}
        turns = {"point_turns": draw(st.booleans()), "direction_turns": draw(st.booleans())}
        return table | {"point": [draw(arms), 0.5 * draw(shares)]} | turns

    gravity = {"gravity": {"g": 9.81}} if draw(st.booleans()) else {}
    effects = {
        "shaft_friction": shafts(0.1, pressed=20.0),
        "viscous_damping": st.just({"coefficient": 0.3}),
        "torsion_spring": st.just({"stiffness": 4.0, "free_angle_deg": 20.0}),
        "eccentric_mass": st.just({"mass": 1.5, "radius": 0.2, "azimuth_deg": 50.0}),
    }
    data: Scenario = {
        "kind": "shaft",
        "mechanism": {
            "inertia": draw(of_size(0.5, 10.0)),
            "mass": draw(st.sampled_from([0.0, 2.0])),
            "initial_angle_deg": round(draw(st.floats(-90.0, 90.0)), 6),
            "initial_angular_velocity": draw(st.sampled_from([0.0, 0.0, 3.0, -3.0])),
        },
        "forces": [force(name) for name in ("one", "two")[: draw(st.integers(1, 2))]],
        "couples": [{"name": "motor", "size": draw(sizes)}],
        "effects": gravity | switched(draw, effects),
        "solver": {"backend": draw(st.sampled_from(["events", "rkf45"])), "duration": 1.0},
        "output": {"interval": 1e-3},
    }
    if draw(st.integers(0, 3)) == 0:  # dear: the worst over a turn
        data["statics"] = {
            "unknown": draw(st.sampled_from(["couples.motor.size", "forces.one.size"]))
        }
    if draw(st.booleans()) and "statics" in data:
        data["statics"] |= {"angle_deg": round(draw(angles), 6), "time": draw(st.floats(0.0, 1.0))}
    return data


def bent() -> Any:
    """Return sizes over speed and over angle."""
    number = st.floats(-20.0, 20.0).map(lambda x: round(x, 6))
    values = st.lists(number, min_size=3, max_size=3)
    over_speed = st.builds(lambda v: {"speed": [-2.0, 0.0, 2.0], "value": v}, values)
    return st.one_of(
        over_speed, st.builds(lambda v: {"angle_deg": [-90.0, 10.0, 120.0], "value": v}, values)
    )


@examples(6)
@given(bodies())
def test_quantities_of_bodies_on_a_shaft(data: Scenario) -> None:
    assert_second_way(data)


@given(scenarios(pulleys(), 5000.0))
def test_quantities_of_pulleys(data: Scenario) -> None:
    record = assert_second_way(data)
    starts_at_rest = data["mechanism"]["initial_angular_velocity"] == 0.0
    if "shaft_friction" in data["effects"] and starts_at_rest:
        first = next((e.time for e in record.events if e.mode_from == 0), None)
        assert first_breakaway(record).agrees(first)


@examples(10)
@given(scenarios(marble_machines(), 0.02))
def test_quantities_of_marble_machines(data: Scenario) -> None:
    assert_second_way(data)


def assert_gears(data: Scenario) -> None:
    # One that stops within a few samples is no more seen by them.
    first = 20.0 * data["output"]["interval"]
    assume(all(event.time > first for event in simulate(data).transitions))
    assert_second_way(data)


@examples(15)
@given(scenarios(gears_with_points(), 8.0))
def test_quantities_of_gears(data: Scenario) -> None:
    assert_gears(data)


@examples(15)  # a wrong dwell is seen where a tracer point comes to dwell
@given(solved(gears_that_dwell()))
def test_quantities_of_gears_that_dwell(data: Scenario) -> None:
    assert_gears(data)


@pytest.mark.parametrize(
    "name", ["pulley", "pulley_horizontal", "pulley_return", "marble_machine", "epicyclic"]
)
def test_the_uncertainty_of_the_second_way_is_small(name: str) -> None:
    """For shipped scenarios, all quantities except the dwell are known to 0.1 %."""
    data = shipped(name, output__interval=1e-3)
    seen = READERS[data["kind"]](assert_second_way(data))
    for quantity, (value, uncertainty) in seen.items():
        if quantity != "tracer_dwell_time":
            assert uncertainty <= 1e-3 * abs(value or 0.0), quantity
