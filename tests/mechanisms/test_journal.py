"""The radius c of a journal, its five cases, the switch of eq 30, and a constant normal load.

"Analysis of friction systems on shafts", Int. J. Applied Engineering Research 13(11), 2018,
8871-8881, eqs 24 and 28 to 35.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import frictionsim as fs
from frictionsim.results import Record
from tests.support.drawn_scenarios import signals
from tests.support.examples import examples
from tests.support.lifts import drawn
from tests.support.problems import BREAKAWAY, CORD_RADIUS, DRAG, INERTIA, LOAD, P_END, R_K, R_S
from tests.support.records import draw, words_of
from tests.support.scenarios import (
    ROOT,
    Scenario,
    changed,
    pulley,
    scenario_run,
    shipped,
    simulate,
    sound,
    with_method,
)
from tests.support.second_way import friction_radius
from tests.support.shaft_forces import drawn_shaft

PAGE = (ROOT / "docs" / "mechanisms" / "pulley.md").read_text(encoding="utf-8")


def test_a_run_has_the_five_cases_of_the_paper() -> None:
    run = sound(shipped("pulley_cases", output__interval=1e-3))
    case, time = run.channels["case"], run.time
    # The time of 4 is that at which c falls below r_s while the pulley turns, to the interval.
    wanted = {1: BREAKAWAY, 3: 0.994, 4: 2.0460335, 5: 3.0}
    seen = {int(k): float(time[case == k][-1]) for k in dict.fromkeys(case.tolist())}
    assert list(seen) == list(wanted)
    assert seen == pytest.approx(wanted, abs=1.001e-3)
    assert [e.time for e in run.transitions] == pytest.approx([BREAKAWAY, 2.0460335], abs=5e-8)
    for number in (f"{BREAKAWAY:.9f} s", "4.98135 mm", "0.994 s", "2.0460335 s", "6.437970 rad"):
        assert number in PAGE
    assert run.channels["lever_arm"][case == 1][-1] == pytest.approx(R_S, rel=1e-12)
    assert pytest.approx(4.98135e-3, abs=5e-9) == R_S
    assert run.channels["angle"][-1] == pytest.approx(6.437970, abs=5e-7)
    # Case 2 is an instant: it begins at the breakaway, and case 5 at the rest.
    assert run.events["case_before"].tolist() == [1, 4]
    assert run.events["case_after"].tolist() == [2, 5]


def test_eq_30_does_not_come_to_case_5() -> None:
    run = simulate(with_method(shipped("pulley_cases"), "published", "rkf45"))
    assert run.attributes["failure"] == "chattering"
    assert run.time[-1] == pytest.approx(2.0460335, abs=1e-7)
    moves = run.time > BREAKAWAY
    assert set(run.channels["case"][moves].tolist()) == {3, 4}
    assert run.channels["switch"][moves].all()
    assert not run.channels["switch"][run.time < BREAKAWAY].any()


def test_the_picture_marks_the_static_friction_radius() -> None:
    run = simulate(shipped("pulley_cases"))
    assert "static friction radius: 0.004981 m" in words_of(draw(run, channels=["lever_arm"]))
    loaded = simulate(shipped("pulley_cases", effects__shaft_friction__normal_load=4000.0))
    assert "radius" not in words_of(draw(loaded, channels=["lever_arm"]))


# --- a reader of recorded channels ----------------------------------------------------------------


def moments(run: Record) -> Any:
    """Return the moment of all but dry friction from what a result has of the loads, (n,)."""
    data, of = scenario_run(run).to_dict(), run.channels
    drag = data["effects"].get("viscous_damping", {"coefficient": 0.0})["coefficient"]
    damping = drag * of["angular_velocity"]
    if data["kind"] == "shaft":
        return of["applied_torque"] + of.get("stop_torque", 0.0)
    if data["kind"] == "marble_machine":
        turning = data["mechanism"]["gear_ratio"] * of["motor_torque"]
        return turning - of.get("load_torque", 0.0) - damping
    arm, torque = data["mechanism"]["cord_radius"], of.get("drive_torque", 0.0)
    if "rope_tension_car" in of:
        pull = of["rope_tension_counterweight"] - of["rope_tension_car"]
    else:
        pull = of["drive_force"] - data["mechanism"]["load"]
    return pull * arm + torque - damping


def assert_reader_agrees(run: Record) -> None:
    """Read c, cases and switch, sample by sample, as the paper says them."""
    data, of = scenario_run(run).to_dict(), run.channels
    journal = data["effects"]["shaft_friction"]
    moment, reaction = abs(moments(run)), of["shaft_reaction"]
    r_s = friction_radius(journal["shaft_radius"], journal["mu_s"])
    load = reaction if journal.get("normal_load") is None else journal["normal_load"]
    # Terms of the moment leave rounding of their sizes, which the acceleration shows.
    size = np.max(moment) + r_s * np.max(reaction) + 1e-300
    unloaded = reaction == 0.0
    assert np.array_equal(np.isnan(of["lever_arm"]), unloaded)
    arms = of["lever_arm"][~unloaded] * reaction[~unloaded]
    assert arms == pytest.approx(moment[~unloaded], abs=1e-12 * size)
    margin = r_s * load - moment
    unsure = abs(margin) <= 1e-9 * size
    starts = [e.time for e in run.transitions if e.contact == "shaft" and e.mode_to != 0]
    moved = bool(data["mechanism"]["initial_angular_velocity"])
    for i, time in enumerate(run.time):
        rests = of["mode"][i] == 0
        moved = moved or not rests or any(start < time for start in starts[:1])
        beyond = margin[i] < 0.0
        if rests and (not beyond or unsure[i]):
            wanted = {5 if moved else 1}
        elif rests or of["angular_velocity"][i] == 0.0:
            wanted = {2, 3, 4}
        else:
            wanted = {3, 4} if unsure[i] else {3} if beyond else {4}
        assert of["case"][i] in wanted, (time, of["case"][i], wanted)
    if journal["law"] == "published" and run.status == "done":
        still = (of["mode"] == 0) & (margin >= 0.0)
        assert np.array_equal(of["switch"][~unsure], ~still[~unsure])
    else:
        assert ("switch" in of) == (journal["law"] == "published")


READ: dict[str, Scenario] = {
    **{name: shipped(name) for name in ("lift", "hoist_drum", "swing_door", "pulley_return")},
    **{name: drawn(name) for name in ("thrown_14", "jammed_13", "gripped_10")},
    "machine": shipped("hard/motor_runs_back"),
    "loaded": pulley(effects__shaft_friction__normal_load=3000.0),
    "published": with_method(pulley(), "published", "rkf45"),
    "turning forces": drawn_shaft(1) | {"output": {"interval": 5e-3}},
}


@pytest.mark.parametrize("name", READ)
def test_c_and_cases_are_those_of_a_reader(name: str) -> None:
    assert_reader_agrees(simulate(READ[name]))


def test_c_is_undefined_without_a_reaction(tmp_path: Path) -> None:
    """Also in a file, a table of numbers and a picture."""
    light = pulley(mechanism__load=0.0, drive__force={"time": [0.5, 1.0], "value": [0.0, 50.0]})
    result = fs.solve(light, output=tmp_path / "light.h5")
    arm = fs.open(tmp_path / "light.h5").dataset["lever_arm"].values
    assert np.isnan(arm[result.dataset["time"].values <= 0.5]).all()
    drag = DRAG * result.record.channels["angular_velocity"][-1]
    assert arm[-1] == pytest.approx(CORD_RADIUS - drag / 50.0)
    result.save(tmp_path / "light.csv")
    fs.plot(result, channels=["lever_arm", "case"])
    fs.report(result, tmp_path / "light.html")


# --- a normal load that is constant ---------------------------------------------------------------

TWICE = 2.0 * LOAD  # N: the reaction where the force is as large as the load


def test_what_the_load_does() -> None:
    """The table of the page about the pulley."""
    rival = pulley(effects__shaft_friction__normal_load=TWICE)
    both, speeds = (pulley(), rival), list[float]()
    lift, hold = ([fs.static(data)[f"force_to_{way}"].value for data in both]
                  for way in ("lift", "hold"))  # fmt: skip
    assert lift[1] == pytest.approx(LOAD + R_S * TWICE / CORD_RADIUS, rel=1e-14)
    for data, load in ((pulley(), P_END + LOAD), (rival, TWICE)):
        # The time constant is 1 s.
        last = sound(changed(data, solver__duration=40.0)).channels["angular_velocity"][-1]
        assert last == pytest.approx(((P_END - LOAD) * CORD_RADIUS - R_K * load) / DRAG, rel=1e-8)
        speeds.append(float(last))
    rows = (
        ("force to lift", "N", lift, 2, 2),
        ("force to hold", "N", hold, 2, 2),
        ("final speed, with `solver.duration=40`", "rad/s", speeds, 4, 1),
    )
    for words, unit, (one, two), digits, percent in rows:
        row = f"| {words} | {one:.{digits}f} {unit} | {two:.{digits}f} {unit} |"
        assert f"{row} {100.0 * (two / one - 1.0):+.{percent}f} % |" in PAGE


@pytest.mark.parametrize("load", [0.0, TWICE])
@pytest.mark.parametrize("direction", ["vertical", "horizontal"])
def test_the_limits_do_not_depend_on_the_forces(load: float, direction: str) -> None:
    run = sound(pulley(effects__shaft_friction__normal_load=load, drive__direction=direction))
    moving = run.channels["mode"] != 0
    assert abs(run.channels["friction_torque"][moving]) == pytest.approx(R_K * load, rel=1e-14)
    force, reaction = run.channels["drive_force"], run.channels["shaft_reaction"]
    wanted = force + LOAD if direction == "vertical" else np.hypot(force, LOAD)
    assert reaction == pytest.approx(wanted, rel=1e-14)  # the shaft carries them all the same


@examples(8)
@given(signals(5000.0), st.floats(0.0, 6000.0), st.sampled_from(["events", "rkf45"]))
def test_a_pulley_is_a_body_with_two_cords(force: Any, load: float, backend: str) -> None:
    """Two equations of motion, whose breakaways are found in two ways."""
    journal = {"shaft_radius": 0.0254, "mu_s": 0.2, "mu_k": 0.1, "normal_load": load}
    solver = {"duration": 1.0, "backend": backend, "rtol": 1e-10, "atol": 1e-13}
    data = pulley(drive__force=force, effects__shaft_friction=journal, solver=solver)
    cords = (("force", force, CORD_RADIUS), ("load", LOAD, -CORD_RADIUS))
    body = {
        "kind": "shaft",
        "mechanism": {"inertia": INERTIA},
        "forces": [
            {"name": name, "size": size, "cord_radius": arm, "direction": [0.0, -1.0]}
            for name, size, arm in cords
        ],
        "effects": {"shaft_friction": journal, "viscous_damping": {"coefficient": DRAG}},
        "solver": solver,
        "output": data["output"],
    }
    one, two = simulate(data), simulate(body)
    assert [e[1:4] for e in one.transitions] == [e[1:4] for e in two.transitions]
    # A thousand steps of 1e-10, and times at which a signal passes a limit slowly.
    times = [e.time for e in two.transitions]
    assert [e.time for e in one.transitions] == pytest.approx(times, abs=1e-7)
    assert one.channels["angle"][-1] == pytest.approx(two.channels["angle"][-1], rel=1e-6, abs=1e-7)


def test_forces_with_a_constant_load_are_couples_with_a_force_through_the_axis() -> None:
    """Of forces whose moments do not turn with the body."""
    wave, load = {"sine": {"amplitude": 1.0, "frequency_hz": 1.5}}, 15.0
    journal = {"shaft_radius": 0.05, "mu_s": 0.4, "mu_k": 0.3}
    cord = {"name": "cord", "size": {"sine": {"amplitude": 10.0, "frequency_hz": 1.5}},
            "cord_radius": 0.1, "direction": [0.3, -1.0]}  # fmt: skip
    data = {
        "kind": "shaft",
        "mechanism": {"inertia": 0.1},
        "forces": [cord],
        "effects": {"shaft_friction": journal | {"normal_load": load}},
        "solver": {"duration": 2.0},
    }
    axis = {"name": "axis", "size": load, "point": [0.0, 0.0], "direction": [1.0, 0.0]}
    couples = [{"name": "cord", "size": wave}]
    one = sound(data)
    two = sound(changed(data, forces=[axis], couples=couples, effects__shaft_friction=journal))
    assert len(one.transitions) > 4
    assert [e[1:4] for e in one.transitions] == [e[1:4] for e in two.transitions]
    for name in ("angle", "angular_velocity", "friction_torque"):
        size = 1e-7 * (1.0 + np.max(abs(two.channels[name])))  # a thousand steps of 1e-9
        assert one.channels[name][-1] == pytest.approx(two.channels[name][-1], abs=size)


def test_a_speed_that_is_given_takes_the_friction_of_a_constant_load() -> None:
    cord = {"name": "load", "size": 300.0, "cord_radius": -0.1, "direction": [0.0, -1.0]}
    journal = {"shaft_radius": 0.02, "mu_s": 0.3, "mu_k": 0.2, "normal_load": 1000.0}
    data = {"kind": "shaft", "mechanism": {"inertia": 0.5}, "drive": {"speed": 2.0}}
    run = sound(data | {"forces": [cord], "effects": {"shaft_friction": journal},
                        "solver": {"duration": 1.0}})  # fmt: skip
    torque = 300.0 * 0.1 + friction_radius(0.02, 0.2) * 1000.0
    assert run.channels["drive_torque"] == pytest.approx(torque, rel=1e-12)
    assert run.channels["shaft_reaction"] == pytest.approx(300.0, rel=1e-12)


# --- steady motion, eq 24 with r_k ----------------------------------------------------------------

WORST = {"mechanism__initial_angle_deg": 18.0, "mechanism__initial_angular_velocity": 1e-3}


@pytest.mark.parametrize(("share", "rests"), [(0.999, True), (1.001, False)])
def test_a_machine_keeps_lifting_above_the_torque_that_keeps_it(share: float, rests: bool) -> None:
    plain = shipped("marble_machine", effects__motor_inertia=None, **WORST)
    torque = fs.static(plain)["torque_to_keep_lifting_worst"].value
    assert torque == pytest.approx(3.666316e-3, abs=5e-10)
    run = sound(changed(plain, drive={"torque": share * torque}))
    assert any(e.contact == "shaft" and e.mode_to == 0 for e in run.transitions) == rests
    assert (run.channels["angular_velocity"][-1] > 1e-3) != rests


def test_torques_and_forces_of_the_machine_are_those_of_the_paper_s_equations() -> None:
    values = {name: q.value for name, q in fs.static("marble_machine").items()}
    wanted = {  # to the digits of an evaluation by hand
        "torque_to_keep_lifting": 3.508780e-3,
        "torque_to_keep_lowering": 2.560286e-3,
        "torque_to_keep_lowering_worst": 2.714671e-3,
        "tooth_force_tangential_to_lift": 0.201801,
        "tooth_force_radial_to_lift": 0.073449,
        "tooth_force_tangential_to_hold": 0.135767,
        "tooth_force_radial_to_hold": 0.049415,
        "shaft_force_sideways_to_lift": -0.180917,
        "shaft_force_down_to_lift": 1.783404,
        "shaft_reaction_to_lift": 1.792557,
    }
    for name, value in wanted.items():
        digits = 1e-9 if name.startswith("torque") else 1e-6
        assert values[name] == pytest.approx(value, abs=0.51 * digits), name


@pytest.mark.parametrize(
    ("way", "sign", "known"), [("counter_clockwise", 1.0, 206.1533), ("clockwise", -1.0, 193.9173)]
)
def test_a_bell_crank_keeps_turning_beyond_the_effort_that_keeps_it(
    way: str, sign: float, known: float
) -> None:
    data = shipped(
        "shaft",
        statics={"unknown": "forces.effort.size", "angle_deg": 0.0},
        effects__viscous_damping=None,
        mechanism__initial_angular_velocity=sign * 1e-3,
        solver__duration=0.05,
    )
    effort = fs.static(data)[f"effort_keep_{way}"].value
    assert effort == pytest.approx(known, abs=5e-5)
    for share, rests in ((1.0 - sign * 1e-3, True), (1.0 + sign * 1e-3, False)):
        sizes = {"effort": share * effort, "load": 400.0}
        forces = [f | {"size": sizes.get(f["name"], f["size"])} for f in data["forces"]]
        run = sound(changed(data, forces=forces))
        assert any(e.mode_to == 0 for e in run.transitions) == rests


@pytest.mark.parametrize("name", ["marble_machine", "hard/motor_runs_back"])
def test_the_teeth_turn_the_gear_whatever_drives_the_pinion(name: str) -> None:
    """The balance of the gear alone, without the motor and its inertia."""
    data = shipped(name)
    run, machine = simulate(data), data["mechanism"]
    of, carried = run.channels, machine["slots"] // 2
    inertia = machine["gear_inertia"]
    inertia += carried * machine["marble_mass"] * machine["marble_circle_radius"] ** 2
    drag = data["effects"].get("viscous_damping", {"coefficient": 0.0})["coefficient"]
    teeth = machine["gear_ratio"] * machine["pinion_radius"] * of["tooth_force_tangential"]
    turned = teeth - of["load_torque"] - drag * of["angular_velocity"] + of["friction_torque"]
    size = np.max(abs(teeth)) + np.max(abs(of["motor_torque"])) * machine["gear_ratio"]
    assert turned == pytest.approx(inertia * of["angular_acceleration"], abs=1e-12 * size)
    slope = np.tan(np.radians(machine["pressure_angle_deg"])) * of["tooth_force_tangential"]
    assert of["tooth_force_radial"] == pytest.approx(slope, rel=1e-13)
