"""Scenarios of belts: every fault is refused with its key, what was wanted, and the way out."""

from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import pytest
import tomli_w

from frictionsim.cli.commands import run_command_line
from frictionsim.scenario.loading import load
from frictionsim.scenario.model_validation import ValidationFailure, key_text
from tests.support.belt_scenarios import pair, scenario_of, trio
from tests.support.scenarios import SCENARIOS, Scenario


def of_pulleys(index: int, **changes: Any) -> Scenario:
    """Return the pair with keys of a pulley changed."""
    data = pair()
    data["mechanism"]["pulleys"][index].update(changes)
    return data


PATCH = {"from": 0.1, "to": 0.2, "mu_s": 1.0, "mu_k": 1.0}
ON_PULLEY = {"mu_s": 1.0, "mu_k": 1.0}
LENGTH = "mechanism.belt.length"
FRICTION = "effects.belt_friction"

FAULTS: dict[str, tuple[Scenario, str, str]] = {
    "pulleys that overlap": (
        of_pulleys(1, center=[0.1, 0.0]),
        "mechanism.pulleys.driven",
        "pulleys driver and driven overlap by 0.06 m",
    ),
    "a name twice": (
        of_pulleys(1, name="driver"),
        "mechanism.pulleys.1.name",
        "there is a pulley 'driver' already",
    ),
    "a radius of nothing": (
        of_pulleys(1, radius=0.0),
        "mechanism.pulleys.driven.radius",
        "expected a number above 0 m, got 0.0",
    ),
    "pretension and length": (
        pair(mechanism__belt__length=0.99),
        "mechanism.belt",
        "expected either pretension, N, or length (unstretched), m; found both",
    ),
    "neither pretension nor length": (
        pair(mechanism__belt__pretension=None),
        "mechanism.belt",
        "expected either pretension, N, or length (unstretched), m; found neither",
    ),
    "a belt too short": (
        pair(mechanism__belt__pretension=None, mechanism__belt__length=0.6),
        LENGTH,
        "a belt of 0.6 m is too short for its path of 1.00265 m: it would stretch by 67.1 %",
    ),
    "a slack belt": (
        pair(mechanism__belt__pretension=None, mechanism__belt__length=1.1),
        LENGTH,
        "a belt of 1.1 m hangs loose on its path of 1.00265 m; make it shorter",
    ),
    "a pretension beyond the law of springs": (
        pair(mechanism__belt__pretension=6000.0),
        "mechanism.belt.pretension",
        "6000.0 N stretch a belt of 10000.0 N by 60 %",
    ),
    "too few bodies": (
        pair(mechanism__belt__bodies=5),
        "mechanism.belt.bodies",
        "it takes at least 8, and about 32",
    ),
    "an unknown pulley in drive": (
        pair(drive__drivr={"torque": 1.0}),
        "drive.drivr",
        "unknown pulley 'drivr' (did you mean 'driver'?)",
    ),
    "an unknown pulley in friction": (
        pair(effects__belt_friction__pulleys={"drven": ON_PULLEY}),
        f"{FRICTION}.pulleys.drven",
        "unknown pulley 'drven' (did you mean 'driven'?)",
    ),
    "torque and speed": (
        pair(drive__driver={"torque": 1.0, "speed": 1.0}),
        "drive.driver",
        "expected either torque or speed; found both",
    ),
    "a drive of nothing": (
        pair(drive__driver={}),
        "drive.driver",
        "expected either torque or speed; found neither",
    ),
    "no contact": (
        pair(effects__contact=None),
        "effects.bending",
        "it moves the belt across itself, and a belt without effects.contact is guided on its pitch"
        " line; add [effects.contact], or leave this effect out",
    ),
    "a patch without friction": (
        pair(effects__belt_friction=None, effects__patch=PATCH),
        "effects.patch",
        "a patch is a place of other friction; add belt_friction",
    ),
    "a patch beyond the belt": (
        pair(effects__patch={**PATCH, "to": 2.5}),
        "effects.patch.to",
        "2.5 m is beyond the belt's 1.00265 m",
    ),
    "a patch that ends before it begins": (
        pair(effects__patch={**PATCH, "from": 0.3}),
        "effects.patch.to",
        "0.2 m is not after from = 0.3 m",
    ),
    "mu_s below mu_k": (
        pair(effects__belt_friction__mu_s=0.1),
        f"{FRICTION}.mu_k",
        "0.6 is above mu_s = 0.1; kinetic friction must not exceed static friction",
    ),
    "regularised without its speed": (
        pair(effects__belt_friction__law="regularised"),
        f"{FRICTION}.transition_speed",
        "missing; law = 'regularised' needs it",
    ),
    "creep without its way": (
        pair(effects__belt_friction={**ON_PULLEY, "law": "creep", "transition_speed": 1e-3}),
        f"{FRICTION}.maximum_creep",
        "missing; law = 'creep' needs it",
    ),
    "a parameter of another law": (
        pair(effects__belt_friction__transition_speed=1e-3),
        f"{FRICTION}.transition_speed",
        "law = 'set-valued' has no such parameter; leave it out",
    ),
    "regularised with moreau": (
        pair(
            effects__belt_friction={**ON_PULLEY, "law": "regularised", "transition_speed": 1e-3},
            solver__backend="moreau",
        ),
        "solver.backend",
        "'moreau' does not integrate the friction law 'regularised'; use one of rkf45,",
    ),
    "contact with a pulley that there is not": (
        pair(effects__contact__pulleys={"drivn": {"c2": 1e6}}),
        "effects.contact.pulleys.drivn",
        "unknown pulley 'drivn' (did you mean 'driven'?)",
    ),
    "contact with a pulley without stiffness": (
        pair(effects__contact__pulleys={"driven": {"c2": 0.0}}),
        "effects.contact.pulleys.driven.c2",
        "expected a number above 0 N/m, got 0.0",
    ),
    "a backend for one coordinate": (
        pair(solver__backend="events"),
        "solver.backend",
        "'events' does not support a belt drive; use one of: rkf45, moreau",
    ),
    "a step for an adaptive method": (
        pair(solver__step=1e-5),
        "solver.step",
        "or use fixed steps: moreau with law 'set-valued'",
    ),
    "an unknown channel": (
        pair(output__channels=["tenson"]),
        "output.channels",
        "unknown channel 'tenson' (did you mean 'tension'?)",
    ),
    "not a number": (
        pair(mechanism__belt__axial_rigidity=float("nan")),
        "mechanism.belt.axial_rigidity",
        "expected a finite number in N, got nan",
    ),
    "infinite": (
        pair(effects__contact__c2=float("inf")),
        "effects.contact.c2",
        "expected a finite number in N/m, got inf",
    ),
    "huge": (
        pair(effects__contact__c2=1e60),
        "effects.contact.c2",
        "1e+60 is too large; the magnitude must not exceed 1e+50",
    ),
    "bodies that are no whole number": (
        pair(mechanism__belt__bodies=24.5),
        "mechanism.belt.bodies",
        "expected a whole number, got 24.5",
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_refused_with_its_key(name: str) -> None:
    data, key, message = FAULTS[name]
    with pytest.raises(ValidationFailure) as caught:
        scenario_of(data)
    faults = {key_text(path): text for path, text in caught.value.faults}
    assert message in faults[key]


@pytest.mark.parametrize("name", FAULTS)
def test_the_command_line_refuses_it(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, key, message = FAULTS[name]
    path = tmp_path / "belt.toml"
    path.write_text(tomli_w.dumps(data))
    for command in ("check", "solve", "static"):
        assert run_command_line([command, str(path)]) == 2
        out, err = capsys.readouterr()
        assert out == ""
        assert f"{key}: " in err
        assert message in err
        assert "Traceback" not in err
    assert list(tmp_path.iterdir()) == [path]


def test_a_process_of_its_own_leaves_with_2(
    cli: Callable[..., "CompletedProcess[str]"], tmp_path: Path
) -> None:
    done = cli("solve", SCENARIOS / "belt_drive.toml", "--set", "mechanism.belt.bodies=20")
    assert done.returncode == 2
    assert "mechanism.belt.bodies: 20 bodies of 0.06" in done.stderr
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_one_pulley_is_no_drive() -> None:
    data = pair()
    del data["mechanism"]["pulleys"][1], data["drive"]["driven"]
    with pytest.raises(ValidationFailure) as caught:
        scenario_of(data)
    assert [path for path, _ in caught.value.faults] == [("mechanism", "pulleys")]


# What is valid but has no rest position, or breaks down on the way.
HOPELESS = {
    "a contact softer than the pretension": (
        pair(effects__contact={"c2": 1.0}),
        2,
        "raise the stiffness of the contact",
    ),
    "a contact as stiff as no number": (
        pair(effects__contact__c2=1e45),
        1,
        "below what double precision resolves",
    ),
}


@pytest.mark.parametrize("name", HOPELESS)
def test_the_hopeless_says_what_to_do(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, code, message = HOPELESS[name]
    path = tmp_path / "belt.toml"
    path.write_text(tomli_w.dumps(data))
    assert run_command_line(["solve", str(path), "-o", str(tmp_path / "belt.h5")]) == code
    err = capsys.readouterr().err
    assert message in " ".join(err.split())
    assert "Traceback" not in err


@pytest.mark.parametrize("data", [pair(), trio()], ids=["pair", "trio"])
def test_what_a_result_holds_of_its_scenario_is_that_scenario(
    data: Scenario, tmp_path: Path
) -> None:
    path = tmp_path / "again.toml"
    path.write_text(scenario_of(data).to_toml())
    again = load(path)
    assert again == scenario_of(data | {"output": {"interval": 1e-3}})


@pytest.mark.parametrize("path", sorted(SCENARIOS.glob("belt*.toml")), ids=lambda p: p.stem)
def test_shipped_belts_are_valid(path: Path) -> None:
    assert load(path).kind == "belt_drive"
