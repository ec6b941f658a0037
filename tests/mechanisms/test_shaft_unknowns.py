"""`[statics]` of a body on a shaft: keys that eq 24 is solved for, and what is said of others."""

from math import radians
from typing import Any

import pytest

import frictionsim as fs
from frictionsim.errors import ScenarioError
from frictionsim.mechanisms.shaft.schema import ShaftScenario
from frictionsim.mechanisms.shaft.statics import breakaway_values
from frictionsim.mechanisms.shaft.unknowns import unknowns_of
from tests.support.scenarios import SCENARIOS

CRANK, DRUM, DOOR = (SCENARIOS / f"{name}.toml" for name in ("shaft", "hoist_drum", "swing_door"))
OF_CRANK = (
    "forces.load.size, forces.load.distance, forces.effort.size, forces.effort.distance,"
    " effects.shaft_friction.mu_s, effects.shaft_friction.shaft_radius, mechanism.mass,"
    " effects.gravity.g, effects.torsion_spring.stiffness, effects.torsion_spring.free_angle_deg"
)


def refused(scenario: Any, overrides: dict[str, Any]) -> str:
    with pytest.raises(ScenarioError) as error:
        fs.load(scenario, overrides)
    (line,) = error.value.faults
    return line.removeprefix("overrides: statics.unknown: ")


@pytest.mark.parametrize(
    ("unknown", "message"),
    [
        (
            ["forces.load.size", "forces.effort.size"],
            "eq 24 is one equation and has one unknown; found 2: forces.load.size,"
            " forces.effort.size",
        ),
        (
            "forces.load.size, forces.effort.size",
            "eq 24 is one equation and has one unknown; found 2: forces.load.size,"
            " forces.effort.size",
        ),
        ("forces.efort.size", "unknown force 'efort' (did you mean 'effort'?)"),
        ("forces.q.size", "unknown force 'q'; known: load, effort"),
        (
            "couples.motor.size",
            "'couples.motor.size' does not exist: the scenario has no [[couples]]",
        ),
        (
            "forces.load.cord_radius",
            "force 'load' has a point and no cord_radius; use forces.load.distance",
        ),
        (
            "forces.load.direction",
            "eq 24 is solved for forces.load.size or forces.load.distance, not for"
            " 'forces.load.direction'",
        ),
        (
            "mechanism.inertia",
            "'mechanism.inertia' does not enter eq 24, the balance of the body at rest; known:"
            f" {OF_CRANK}",
        ),
        (
            "effects.viscous_damping.coefficient",
            "'effects.viscous_damping.coefficient' does not enter eq 24, the balance of the body at"
            f" rest; known: {OF_CRANK}",
        ),
        (
            "effects.eccentric_mass.mass",
            "'effects.eccentric_mass.mass' does not enter eq 24: the scenario has no"
            " [effects.eccentric_mass]",
        ),
        (
            "mechanism.initial_angle_deg",
            f"eq 24 is not solved for 'mechanism.initial_angle_deg', an angle; known: {OF_CRANK}",
        ),
        (
            "effects.shaft_friction.mu",
            "unknown key 'effects.shaft_friction.mu' (did you mean 'effects.shaft_friction.mu_s'?)",
        ),
        ("q", f"unknown key 'q'; known: {OF_CRANK}"),
        (3, "expected text in quotes, got 3"),
    ],
)
def test_an_unknown_that_is_none_is_refused(unknown: Any, message: str) -> None:
    assert refused(CRANK, {"statics.unknown": unknown}) == message


def test_a_cord_has_a_radius_and_no_distance() -> None:
    assert refused(DRUM, {"statics.unknown": "forces.load.distance"}) == (
        "force 'load' is that of a cord and has no point; use forces.load.cord_radius"
    )


def test_a_point_on_the_axis_has_no_distance() -> None:
    assert refused(DOOR, {"statics.unknown": "forces.hinges.distance"}) == (
        "the point of force 'hinges' is on the axis, so it has no direction from there"
    )


def test_a_couple_has_no_arm() -> None:
    assert refused(DRUM, {"statics.unknown": "couples.retarding.cord_radius"}) == (
        "eq 24 is solved for couples.retarding.size, not for 'couples.retarding.cord_radius'"
    )


@pytest.mark.parametrize(
    ("scenario", "overrides"),
    [
        (DRUM, {"statics.unknown": "effects.eccentric_mass.radius"}),  # below the axis
        (DRUM, {"statics.unknown": "forces.load.cord_radius", "forces.load.size": 0.0}),
        (DOOR, {"statics.unknown": "forces.push.distance"}),  # before it begins
        (CRANK, {"statics.unknown": "effects.torsion_spring.stiffness"}),  # free
        (CRANK, {"statics.unknown": "effects.shaft_friction.shaft_radius",
                 "effects.shaft_friction.mu_s": 0.0, "effects.shaft_friction.mu_k": 0.0}),
        (DOOR, {"statics.unknown": "forces.hinges.size", "effects.shaft_friction": None}),
    ],
)  # fmt: skip
def test_an_unknown_that_drops_out_is_refused(scenario: Any, overrides: dict[str, Any]) -> None:
    unknown = overrides["statics.unknown"]
    assert refused(scenario, overrides) == (
        f"'{unknown}' does not enter eq 24 at 0 deg and 0 s: it changes neither the moment nor the"
        " friction there"
    )
    if scenario == DOOR and "push" in unknown:
        assert fs.load(scenario, overrides | {"statics.time": 0.5}).statics.time == 0.5


@pytest.mark.parametrize("scenario", [CRANK, DRUM, DOOR])
def test_all_known_keys_are_solved_for(scenario: Any) -> None:
    loaded = fs.load(scenario)
    assert isinstance(loaded, ShaftScenario)
    for unknown in unknowns_of(loaded):
        overrides = {"statics.unknown": unknown.key, "statics.angle_deg": 30.0, "statics.time": 0.6}
        found = breakaway_values(loaded.replace(overrides))
        assert found[f"{unknown.label}_clockwise"].unit == unknown.unit
        # The key is one of the scenario: a value that is found may be set.
        value = found[f"{unknown.label}_clockwise"].value
        if value is not None and unknown.name != "distance" and (unknown.signed or value > 0.0):
            moved = {unknown.key: value, "statics.angle_deg": 30.0, "statics.time": 0.6}
            if unknown.name == "mu_s":
                moved["effects.shaft_friction.mu_k"] = 0.0
            rest = fs.static(scenario, moved)
            limit = rest["static_limit"].value
            assert rest["static_margin"].value == pytest.approx(0.0, abs=1e-13 * (limit or 1.0))


def test_the_place_of_the_statics_is_the_start_or_another() -> None:
    start = fs.static(CRANK, {"mechanism.initial_angle_deg": 30.0})
    assert fs.static(CRANK, {"statics.angle_deg": 30.0}) == start
    assert fs.static(CRANK)["angle"].value == 0.0
    later = fs.static(CRANK, {"statics.time": 1.0})["applied_torque"].value
    assert later == pytest.approx(0.2 * 30.0, rel=1e-14)  # 230 N instead of 200 N at 0.2 m
    with pytest.raises(ScenarioError, match=r"statics.time: expected a number of at least 0 s"):
        fs.load(CRANK, {"statics.time": -1.0})


def test_the_balance_without_an_unknown() -> None:
    found = fs.static(CRANK, {"statics.time": 1.0})
    value = {name: quantity.value for name, quantity in found.items()}
    assert value["lever_arm"] == pytest.approx(value["applied_torque"] / value["shaft_reaction"])
    assert value["static_limit"] == pytest.approx(
        value["friction_radius_static"] * value["shaft_reaction"]
    )
    assert value["static_margin"] == pytest.approx(value["static_limit"] - value["applied_torque"])
    assert value["breakaway_direction"] == 1.0
    assert found.notes == ("at 0 deg and 1 s, it breaks away counter-clockwise",)
    assert fs.static(CRANK).notes == ("at 0 deg and 0 s, the body rests",)
    back = fs.static(CRANK, {"forces.effort.size": 100.0})
    assert back["breakaway_direction"].value == -1.0
    assert back.notes == ("at 0 deg and 0 s, it breaks away clockwise",)
    free = fs.static(DOOR, {"forces.hinges.size": 0.0})
    assert free["lever_arm"].value is None
    assert free.notes[1] == "at 0 deg and 0 s, the shaft has no load: there is no lever arm"


@pytest.mark.parametrize(
    ("unknown", "notes"),
    [
        (
            "forces.effort.size",
            ["at 0 deg, the body rests with forces.effort.size from 191.689 N to 208.443 N"],
        ),
        (
            "mechanism.mass",
            ["at 0 deg, no mechanism.mass makes the body move: the friction exceeds the moment with"
             " any"],
        ),
        (
            "effects.shaft_friction.mu_s",
            ["at 0 deg, the body rests with every effects.shaft_friction.mu_s: there is no moment"],
        ),
    ],
)  # fmt: skip
def test_what_the_roots_mean_is_said(unknown: str, notes: list[str]) -> None:
    found = fs.static(CRANK, {"statics.unknown": unknown})
    assert list(found.notes[1 : 1 + len(notes)]) == notes


def test_a_mass_has_no_weight_without_gravity() -> None:
    for key in ("mechanism.mass", "effects.eccentric_mass.radius"):
        keys = {"statics.unknown": key, "effects.gravity": None}
        scenario = CRANK if key == "mechanism.mass" else DRUM
        assert refused(scenario, keys) == (
            f"'{key}' does not enter eq 24: the scenario has no [effects.gravity]"
        )


LEVER: dict[str, Any] = {
    "kind": "shaft",
    "mechanism": {"inertia": 0.5},
    "forces": [{"name": "load", "size": 300.0, "point": [0.2, 0.0], "direction": [0.0, -1.0]}],
    "couples": [{"name": "motor", "size": 0.0}],
    "effects": {"shaft_friction": {"shaft_radius": 0.02, "mu_s": 0.25, "mu_k": 0.2}},
    "statics": {"unknown": "forces.load.size"},
}


def test_a_range_of_one_value_is_said_as_one() -> None:
    assert fs.static(fs.load(LEVER)).notes[1] == (
        "at 0 deg, the body rests with forces.load.size = 0 N only, and moves with any other"
    )
    nearly = fs.load(LEVER, {"statics.unknown": "couples.motor.size",
                             "effects.shaft_friction.shaft_radius": 1e-8})  # fmt: skip
    assert fs.static(nearly).notes[1] == (
        "at 0 deg, the body rests with couples.motor.size from 59.9999993 N m to 60.0000007 N m"
    )


def test_a_root_below_zero_is_said() -> None:
    pull = {"name": "pull", "size": 1.0, "direction": [0.0, 1.0], "cord_radius": -0.2}
    data = LEVER | {
        "effects": LEVER["effects"]
        | {"gravity": {}, "eccentric_mass": {"mass": 1.0, "radius": 1.0}}
    }
    data |= {
        "forces": [*LEVER["forces"], pull],
        "statics": {"unknown": "effects.eccentric_mass.mass"},
    }
    assert fs.static(fs.load(data)).notes[2] == (
        "effects.eccentric_mass.mass below zero is a root of the equation, but not possible"
    )


def test_a_coefficient_that_holds_is_said() -> None:
    keys = {"statics.unknown": "effects.shaft_friction.mu_s", "forces.effort.size": 210.0}
    found = fs.static(CRANK, keys)
    assert found["mu_s_clockwise"].value is None
    holding = found["mu_s_counter_clockwise"].value
    assert found.notes[1] == (
        "at 0 deg, the body moves counter-clockwise with effects.shaft_friction.mu_s below"
        f" {holding:.6g}, and with no value clockwise"
    )
    held = {"forces.effort.size": 210.0, "effects.shaft_friction.mu_s": holding}
    assert fs.static(CRANK, held)["breakaway_direction"].value == 0.0
    heavy = fs.static(CRANK, keys | {"forces.effort.size": 400.0})
    assert heavy["mu_s_counter_clockwise"].value is None
    assert heavy.notes[1] == (
        "at 0 deg, the body moves with every effects.shaft_friction.mu_s: its lever arm is too"
        " large"
    )


def test_a_run_has_the_values_of_its_unknown() -> None:
    overrides = {"statics.unknown": "forces.effort.size", "solver.duration": 0.01}
    found = fs.solve(CRANK, overrides).quantities
    wanted = fs.static(CRANK, overrides)
    for name in ("effort_counter_clockwise", "effort_clockwise"):
        assert found[name] == wanted[name]
    assert "effort_clockwise_largest" not in found


# --- end stops

LATCH: dict[str, Any] = {
    "kind": "shaft",
    "mechanism": {"inertia": 1e-3},
    "forces": [{"name": "bolt", "size": 0.0, "point": [0.05, 0.0], "direction": [0.0, 1.0]}],
    "effects": {
        "torsion_spring": {"stiffness": 0.8, "free_angle_deg": -20.0},
        "end_stops": {"lowest_angle_deg": 0.0, "highest_angle_deg": 25.0},
        "shaft_friction": {"shaft_radius": 0.004, "mu_s": 0.3, "mu_k": 0.25},
    },
    "statics": {"unknown": "forces.bolt.size"},
}


def test_a_body_rests_on_its_stop() -> None:
    found = fs.static(fs.load(LATCH))
    assert found["breakaway_direction"].value == 0.0
    assert found["stop_torque"].value == pytest.approx(0.8 * radians(20.0), rel=1e-15)
    assert found.notes[0] == (
        "at 0 deg and 0 s, the body rests on its lower end stop, which takes 0.279253 N m"
    )
    assert (
        "at 0 deg, the lower end stop keeps the body from turning clockwise with any"
        " forces.bolt.size"
    ) in found.notes
    opened = fs.static(fs.load(LATCH, {"forces.bolt.size": 20.0}))
    assert opened["breakaway_direction"].value == 1.0
    assert opened["stop_torque"].value == 0.0
    above = fs.static(fs.load(LATCH, {"statics.angle_deg": 25.0, "forces.bolt.size": 20.0}))
    assert above.notes[0] == (
        "at 25 deg and 0 s, the body rests on its upper end stop, which takes 0.277989 N m"
    )
    falls = fs.static(fs.load(LATCH, {"statics.angle_deg": 25.0}))
    assert falls.notes[0] == "at 25 deg and 0 s, it breaks away clockwise"
    assert "stop_torque" not in fs.static(CRANK)


@pytest.mark.parametrize(("angle", "stop"), [(-1.0, "lowest"), (26.0, "highest")])
def test_an_angle_beyond_a_stop_is_refused(angle: float, stop: str) -> None:
    with pytest.raises(ScenarioError) as error:
        fs.load(LATCH, {"statics.angle_deg": angle})
    (line,) = error.value.faults
    limit = LATCH["effects"]["end_stops"][f"{stop}_angle_deg"]
    assert line == (
        f"overrides: statics.angle_deg: {angle} is beyond the end stop"
        f" effects.end_stops.{stop}_angle_deg = {limit}; give an angle between the stops, or at one"
        " of them"
    )
