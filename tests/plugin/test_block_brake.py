"""A kind from another package: the command line knows it without a change, and it is right."""

import json
import os
import re
import tomllib
from collections.abc import Callable, Iterator
from importlib import import_module
from math import log
from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from frictionsim.mechanisms import extension
from tests.support.plugins import BRAKE, install, searched
from tests.support.scenarios import ROOT, Scenario, changed, python, sound

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


def test_it_stops_when_and_where_the_closed_form_says(brake: Any) -> None:
    """Under a constant force: I dw/dt = -net - b w, from 10 rad/s to rest."""
    done = sound(changed(DATA, drive__force=500.0))
    inertia, speed, damping, torque, friction = 2.0, 10.0, 0.1, 5.0, 0.3 * 500.0 * 0.25
    net = friction - torque
    time = inertia / damping * log(1.0 + damping * speed / net)
    angle = (inertia * speed - net * time) / damping
    expected = {
        "braking_time": time,
        "braking_angle": angle,
        "final_angle": angle,
        "energy_friction": friction * angle,
        "energy_input": torque * angle,
    }
    shown = {name: done.quantities[name].value for name in expected}
    assert shown == pytest.approx(expected, rel=1e-11)  # the energies are off by 2e-13
    assert done.checks["energy_balance"].limit < 2e-7


def test_the_module_needs_nothing_but_the_public_interface(brake: Any) -> None:
    lines = Path(brake.__file__).read_text().splitlines()
    imported = {line.split()[1] for line in lines if re.match("(from|import) frictionsim", line)}
    assert imported == {"frictionsim.mechanisms.extension"}
    for name in extension.__all__:
        assert hasattr(extension, name), name
    # Each name is in the documentation of the module.
    assert [name for name in extension.__all__ if name not in str(extension.__doc__)] == []
