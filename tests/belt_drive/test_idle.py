"""Belts at rest, and belts whose friction does next to nothing: their audit is sound."""

from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.support.cases import slow
from tests.support.falsified import falsified

FRICTION, LOWER = {"mu_s": 0.3, "mu_k": 0.3}, {"mu_s": 0.3, "mu_k": 0.2}
CONTACT = {"c1": 1e7, "c2": 2e5, "damping": 20.0, "p_max": 1e-3}
A = {"name": "a", "center": [0.0, 0.0], "radius": 0.05, "inertia": 1e-3}
B = {"name": "b", "center": [0.4, 0.0], "radius": 0.05, "inertia": 1e-2}
C = {"name": "c", "center": [0.2, 0.3], "radius": 0.03, "inertia": 1e-3}


def belt(
    pulleys: list[dict[str, Any]],
    drive: Any = None,
    friction: Any = FRICTION,
    contact: bool = False,
    **solver: Any,
) -> dict[str, Any]:
    """Return a belt of 60 bodies, in which waves take 5 ms to run round.

    With next to nothing of the effects of other tests, by whose kernels it runs.
    """
    effects = {"belt_friction": friction, "axial_damping": {"coefficient": 1e-9, "basis": "joint"}}
    if contact:
        effects |= {"contact": CONTACT, "bending": {"rigidity": 1e-9}}
    string = {"bodies": 60, "mass_per_length": 0.1, "axial_rigidity": 1e4, "pretension": 300.0}
    return {
        "kind": "belt_drive",
        "mechanism": {"belt": string, "pulleys": pulleys},
        "drive": drive or {},
        "effects": effects,
        "solver": {"duration": 0.02} | solver,
    }


def assert_sound(run: fs.Result) -> None:
    assert run.status == "done"
    assert {name: check.value for name, check in run.audit.items() if not check.ok} == {}
    assert run.exit_code == 0


LATER = {"torque": {"time": [0.2, 0.3], "value": [0.0, 5.0]}}  # after the end of the run


@pytest.mark.parametrize("backend", ["rkf45", "moreau"])
@pytest.mark.parametrize("contact", [False, True], ids=["guided", "contact"])
@pytest.mark.parametrize(
    ("pulleys", "drive"),
    [([A, B, C], {"c": LATER}), ([B, A], {"b": {"torque": 0.0}})],
    ids=["three, a motor that starts later", "no torque"],
)
def test_a_belt_at_rest_is_sound(
    pulleys: list[dict[str, Any]], drive: Any, contact: bool, backend: str
) -> None:
    run = fs.solve(belt(pulleys, drive, contact=contact, backend=backend))
    assert_sound(run)
    # Of 0.5 J or more in the springs: nothing moves.
    assert run.quantities["energy_kinetic"].value < 1e-12
    for name in ("x", "y"):
        moved = run.dataset[name].values - run.dataset[name].values[0]
        assert np.max(np.abs(moved)) < 2e-11


RISING = {"time": [0.0, 0.01], "value": [0.0, 20.0]}
SWINGING = {"sine": {"mean": 0.0, "amplitude": 20.0, "frequency_hz": 20.0}}


@pytest.mark.parametrize(
    ("friction", "drive"),
    [
        ({"mu_s": 0.1, "mu_k": 0.0}, {"a": {"speed": RISING}}),
        ({"mu_s": 0.1, "mu_k": 0.08}, {"a": {"speed": SWINGING}}),
        ({"mu_s": 1e-9, "mu_k": 1e-9}, {"a": {"torque": 1.0}}),
        ({"mu_s": 0.6, "mu_k": 0.3}, {"a": {"torque": RISING}}),
    ],
    ids=["no kinetic friction", "little less", "next to none", "that sticks"],
)
def test_a_belt_whose_friction_is_negligible_is_sound(friction: Any, drive: Any) -> None:
    assert_sound(fs.solve(belt([A, B], drive, friction, duration=0.05)))


LOADED = {"torque": {"speed": [-9.0, 9.0], "value": [1.0, -1.0]}}


def test_a_sweep_over_the_load_keeps_the_row_without_one() -> None:
    data = belt([A, B], {"a": {"torque": 1.0}, "b": LOADED})
    swept = fs.sweep(data, vary={"drive.a.torque": [-2.0, 0.0]}, workers=1)
    assert swept["energy_input"].notnull().all()
    assert set(swept["reason"].values) == {""}


@pytest.mark.parametrize(("friction", "torque"), [(FRICTION, 4.0), (LOWER, -4.0)])
def test_a_friction_that_drives_is_found(friction: Any, torque: float) -> None:
    """Of a few tenths of a per cent of the energies, in a belt that creeps under its load."""
    data = belt([A, B], {"a": {"torque": torque}, "b": LOADED}, friction, duration=0.1)
    run = fs.solve(data)
    assert_sound(run)
    heat, put_in = (run.quantities[f"energy_{of}"].value for of in ("friction", "input"))
    assert 0.0 < heat < 0.02 * put_in
    # With slip reversed, what drives and what heats, the two columns, change places.
    reversed_slip = falsified(data, 0.099, _power=lambda power: power[:, ::-1])
    assert not reversed_slip.audit["dissipation_sign"].ok


DRIVEN = {
    "prescribed": {"speed": 20.0},
    "raised": {"speed": {"time": [0.0, 0.05], "value": [0.0, -20.0]}},
    # A motor that has no torque left at 20 rad/s.
    "motor": {"torque": {"speed": [0.0, 20.0], "value": [2.0, 0.0]}},
}


@pytest.mark.parametrize(
    ("kind", "pulleys"),
    [
        ("prescribed", [A, B]),
        ("raised", [B, C, A]),
        ("motor", [B, A]),
        *(slow(kind, [A, C, B]) for kind in DRIVEN),
    ],
)
def test_the_drive_of_an_idle_belt_is_what_drives_it(kind: str, pulleys: Any) -> None:
    """The other pulleys are free, and take no more than the noise of the belt."""
    data = belt(pulleys, {"a": DRIVEN[kind]}, backend="moreau", duration=0.2)
    data["effects"]["axial_damping"] = {"coefficient": 5.0, "basis": "joint"}
    data["output"] = {"interval": 2e-3}
    run = fs.solve(data)
    # Weighted by sin^2 as the page of quantities has it, over samples of even distance.
    last = run.dataset["pulley_speed"].sel(pulley="a", time=slice(0.16 - 1e-9, None)).values
    weight = np.sin(np.linspace(0.0, np.pi, len(last))) ** 2
    mean = float(np.average(last, weights=weight))
    assert run.quantities["drive_speed"].value == pytest.approx(mean, rel=1e-9)  # rounding
    if kind != "motor":
        assert abs(run.quantities["drive_speed"].value) == pytest.approx(20.0, rel=1e-12)


@pytest.mark.parametrize(("torque", "duration"), [(5.0, 0.4), (12.0, 0.25)])
def test_a_pulley_that_is_held_neither_drives_nor_delivers(torque: float, duration: float) -> None:
    """Its friction holds 17.3 N m: the belt vibrates, with springs that give and take work."""
    held = {"name": "b", "center": [0.4, 0.0], "radius": 0.05, "inertia": 2e-3}
    rising = {"smooth_step": {"from": 0.0, "to": torque, "start": 0.0, "stop": 0.1}}
    drive = {"a": {"torque": rising}, "b": {"speed": 0.0}}
    pulleys = [{**held, "name": "a", "center": [0.0, 0.0]}, held]
    friction = {"mu_s": 0.4, "mu_k": 0.4}
    data = belt(pulleys, drive, friction, backend="moreau", duration=duration)
    data["mechanism"]["belt"] |= {"bodies": 40, "axial_rigidity": 2e4}
    data["effects"]["axial_damping"] = {"coefficient": 1.0, "basis": "section"}
    run = fs.solve(data)
    assert run.warnings == ()
    values = {name: quantity.value for name, quantity in run.quantities.items()}
    assert values["efficiency"] is None
    assert values["slip_percent"] is None
    assert values["driven_speed"] == 0.0
    assert 0.0 < abs(values["drive_speed"]) < 0.1  # it vibrates
    pulled = values["tension_tight"] - values["tension_slack"]
    assert pulled == pytest.approx(torque / 0.05, rel=1e-3)  # but for that
