"""A kind from another package: the command line knows it without a change, and it is right."""

import json
import os
import re
import tomllib
from collections.abc import Callable, Iterator
from importlib import import_module
from math import log
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import frictionsim as fs
from frictionsim.mechanisms import extension
from tests.support.examples import examples
from tests.support.plugins import BRAKE, install, searched
from tests.support.scenarios import ROOT, Scenario, changed, python, simulate

SCENARIO = BRAKE / "frictionsim_brake" / "block_brake.toml"
DATA: Scenario = tomllib.loads(SCENARIO.read_text())

Command = Callable[..., str]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the installed package."""
    return install(BRAKE, tmp_path_factory.mktemp("site"))


@pytest.fixture(scope="module")
def brake(site: Path) -> Iterator[Any]:
    """Return the module of the kind, which this process finds among the installed packages."""
    with searched(site):
        yield import_module("frictionsim_brake.block_brake")


@pytest.fixture
def command(brake: Any, told: Callable[..., tuple[str, str]]) -> Command:
    """Return a function that runs the command line and returns its output."""
    return lambda *arguments, code=0: told(*arguments, code=code)[0]


def test_a_new_process_loads_it_without_numpy(site: Path) -> None:
    code = (
        "import sys; import frictionsim as fs;"
        f" assert fs.run_command_line(['check', {str(SCENARIO)!r}]) == 0;"
        " print('numpy' in sys.modules, fs.kinds()[-1])"
    )
    path = os.pathsep.join([str(site), str(ROOT)])
    done = python("-c", code, PYTHONPATH=path, PYDANTIC_DISABLE_PLUGINS="__all__")
    assert done.stdout == (
        f"{SCENARIO}: ok; effects block_friction, viscous_damping; backend events\n"
        "False block_brake\n"
    ), done.stderr


def test_it_is_solved_compared_drawn_and_resumed(command: Command) -> None:
    document = json.loads(command("solve", SCENARIO, "-o", "a.h5", "--json", "--estimate-error"))
    assert document["status"] == "done"
    # The force falls from 500 N at 3 s to 0 N at 4 s; 50 N hold the flywheel.
    assert document["quantities"]["breakaway_time"]["value"] == pytest.approx(3.9, abs=1e-9)
    assert all(check["ok"] for check in document["audit"].values())
    kept = fs.open("a.h5").record
    assert kept.units["block_force"] == "N"
    assert kept.long_names["energy_friction"] == "heat of the brake"
    assert kept.contacts == ["block"]
    limit = "--max-steps", "20"
    command("solve", SCENARIO, "-q", "-o", "b.h5", *limit, code=5)
    for code in (5, 5, 0):
        command("resume", "b.h5", "-q", *limit, code=code)
    assert command("compare", "a.h5", "b.h5").endswith("the files agree\n")
    assert command("plot", "a.h5", "--view", "heat") == "a-heat.png\n"
    power, energy = fs.plot("a.h5", "heat").axes
    assert min(power.lines[0].get_ydata()) == 0.0
    assert [text.get_text() for text in energy.get_legend().get_texts()] == [
        "kinetic energy of the flywheel",
        "heat of the brake",
    ]


def test_its_limits_are_printed_and_its_accuracy_studied(command: Command) -> None:
    quantities = json.loads(command("static", SCENARIO, "--json"))["quantities"]
    assert {name: (q["value"], q["unit"]) for name, q in quantities.items()} == {
        "force_to_hold": (pytest.approx(50.0), "N"),
        "static_torque_max": (pytest.approx(50.0), "N m"),
        "kinetic_torque_max": (pytest.approx(37.5), "N m"),
    }
    arguments = ("--tolerances", "1e-4", "--repeats", "1", "--laws", "set-valued", "--json")
    document = json.loads(command("cost", SCENARIO, *arguments))
    assert [(row["backend"], row["status"]) for row in document["settings"]] == [
        ("events", "done"),
        ("rkf45", "done"),
    ]
    assert all(row["error"] < 1e-6 for row in document["settings"])


@pytest.mark.parametrize(
    ("override", "sentence"),
    [
        (
            "drive.force={sine = {mean = 10, amplitude = 15, frequency_hz = 1}}",
            "drive.force: has a minimum of -5 N; a block cannot pull, so give 0 N or more",
        ),
        (
            "solver.backend=moreau",
            "solver.backend: 'moreau' does not support a block brake; use one of events, rkf45"
            " (--set solver.backend=events)",
        ),
    ],
)
def test_faults_in_its_scenarios_are_worded(
    override: str, sentence: str, brake: Any, told: Callable[..., tuple[str, str]]
) -> None:
    said = told("check", SCENARIO, "--set", override, code=2)[1]
    assert said == f"frictionsim: --set: {sentence}\n"


@st.composite
def brakes(draw: st.DrawFn) -> SimpleNamespace:
    """Draw a flywheel that a constant force stops."""

    def between(low: float, high: float) -> float:
        return draw(st.floats(low, high))

    case = SimpleNamespace(
        inertia=between(0.1, 10.0),
        radius=between(0.05, 1.0),
        force=between(10.0, 1000.0),
        mu_k=between(0.05, 0.6),
        speed=between(1.0, 50.0) * draw(st.sampled_from([-1.0, 1.0])),
        b=draw(st.one_of(st.just(0.0), st.floats(0.01, 1.0))),
    )
    case.mu_s = case.mu_k * between(1.0, 2.0)
    case.friction = case.mu_k * case.force * case.radius
    case.torque = between(-0.9, 0.9) * case.friction
    return case


def scenario_of(case: SimpleNamespace, duration: float, **changes: Any) -> Scenario:
    return changed(
        DATA,
        mechanism__inertia=case.inertia,
        mechanism__rim_radius=case.radius,
        mechanism__initial_angular_velocity=case.speed,
        drive__force=case.force,
        drive__torque=case.torque,
        effects__block_friction={"mu_s": case.mu_s, "mu_k": case.mu_k},
        effects__viscous_damping={"coefficient": case.b} if case.b else None,
        solver__duration=duration,
        output__interval=duration,
        **changes,
    )


@examples(8)
@given(case=brakes())
def test_it_stops_when_and_where_the_closed_form_says(brake: Any, case: SimpleNamespace) -> None:
    speed, sign = abs(case.speed), 1.0 if case.speed > 0.0 else -1.0
    net = case.friction - sign * case.torque  # what slows it down beside damping
    if case.b:
        time = case.inertia / case.b * log(1.0 + case.b * speed / net)
        angle = (case.inertia * speed - net * time) / case.b
    else:
        time = case.inertia * speed / net
        angle = 0.5 * speed * time
    done = simulate(scenario_of(case, duration=1.5 * time))
    quantities = {name: quantity.value for name, quantity in done.quantities.items()}
    assert quantities["braking_time"] == pytest.approx(time, rel=1e-7)
    assert quantities["braking_angle"] == pytest.approx(sign * angle, rel=1e-6)
    assert quantities["final_angle"] == quantities["braking_angle"]
    assert quantities["energy_friction"] == pytest.approx(case.friction * angle, rel=1e-6)
    assert quantities["energy_input"] == pytest.approx(case.torque * sign * angle, rel=1e-6)
    assert [check for check in done.checks.values() if not check.ok] == []
    assert done.checks["energy_balance"].limit < 2e-7


@examples(8)
@given(case=brakes(), release=st.floats(0.5, 5.0))
def test_it_breaks_away_when_the_force_no_longer_holds_it(
    brake: Any, case: SimpleNamespace, release: float
) -> None:
    case.speed = 0.0
    falling = {"time": [0.0, release], "value": [case.force, 0.0]}
    case.force, full = falling, case.force
    done = simulate(scenario_of(case, duration=release))
    hold = abs(case.torque) / (case.mu_s * case.radius)
    quantities = {name: quantity.value for name, quantity in done.quantities.items()}
    assert quantities["force_to_hold"] == pytest.approx(hold, rel=1e-12)
    if hold == 0.0:  # nothing moves it
        assert quantities["breakaway_time"] is None
    else:
        assert quantities["breakaway_time"] == pytest.approx(
            release * (1.0 - hold / full), rel=1e-9
        )
    assert [check for check in done.checks.values() if not check.ok] == []


def test_the_module_needs_nothing_but_the_public_interface(brake: Any) -> None:
    lines = Path(brake.__file__).read_text().splitlines()
    imported = {line.split()[1] for line in lines if re.match("(from|import) frictionsim", line)}
    assert imported == {"frictionsim.mechanisms.extension"}
    for name in extension.__all__:
        assert hasattr(extension, name), name
    # Each name is in the documentation of the module.
    assert [name for name in extension.__all__ if name not in str(extension.__doc__)] == []
