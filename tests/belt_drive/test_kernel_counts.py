"""Kernels compiled for a run: only those it needs, and stiff dampers when they are needed."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.cli.commands import run_command_line
from frictionsim.mechanisms.belt_drive.belt_simulation import BeltDrive
from frictionsim.mechanisms.belt_drive.steppers import moreau
from frictionsim.mechanisms.belt_drive.steppers.fixed_steps import IMPLICIT_NOW, IMPLICIT_STEPS
from frictionsim.simulation.monitor import RunMonitor
from frictionsim.simulation.simulate import run
from tests.support.belt_scenarios import pair, scenario_of
from tests.support.scenarios import ROOT, SCENARIOS, Scenario, changed

# A large function more is 0.15 s more on one core; seven make a second. Loops over vectors are
# functions of a few lines, of which many take less time than a few with versions for overlaps.
MAX_FUNCTIONS = {"moreau": 84, "rkf45": 94}

COUNT = """
import json, sys
from numba.core import event
from frictionsim.mechanisms.belt_drive.belt_simulation import BeltDrive
from frictionsim.scenario.loading import load
from frictionsim.simulation.monitor import RunMonitor

drive = BeltDrive(load(sys.argv[1], {"solver.duration": 1e-3}, backend=sys.argv[2]))
with event.install_recorder("numba:compile") as recorder:
    drive.prepare(RunMonitor())
    again = drive.solve(lambda t: None)
starts = (one for _, one in recorder.buffer if one.is_start)
print(json.dumps([[one.data["dispatcher"].py_func.__name__ for one in starts], again]))
"""


@pytest.mark.slow
@pytest.mark.parametrize("backend", MAX_FUNCTIONS)
def test_a_cold_run_compiles_few_functions_and_no_stiff_damping(
    backend: str, tmp_path: Path
) -> None:
    command = [sys.executable, "-c", COUNT, str(SCENARIOS / "belt_drive.toml"), backend]
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path), "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    functions, again = json.loads(done.stdout)
    assert len(functions) <= MAX_FUNCTIONS[backend], functions
    assert "solve_damping_and_friction" not in functions
    assert not again


def joints_turn(**changes: Any) -> Scenario:
    """Return a belt whose joints are oblique to the bodies for some searches, not for all."""
    return changed(
        pair(solver__backend="moreau", effects__axial_damping__coefficient=20.0),
        solver__duration=0.02,
        **changes,
    )


@pytest.fixture
def oblique_for_a_while(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have dampers solved for where a body is oblique to its joints by the least angle."""
    plan = moreau.plane_plan

    def lower(*arguments: Any) -> moreau.StepPlan:
        return plan(*arguments)._replace(max_obliquity=OBLIQUITY)

    monkeypatch.setattr(moreau, "plane_plan", lower)


OBLIQUITY = 0.3  # it is 0.27 at the start, and grows


@pytest.mark.usefixtures("oblique_for_a_while")
def test_stiff_damping_is_compiled_in_the_middle_of_a_run() -> None:
    drive = BeltDrive(scenario_of(joints_turn()))
    forms = []
    drive.prepare(RunMonitor())
    counts = drive._stepper._state.counts
    while True:
        forms.append(int(counts[IMPLICIT_NOW]))
        if not drive.solve(lambda t: None):
            break
        drive.prepare(RunMonitor())
    assert forms == [0, 1], "each form is prepared once, when it is first due"
    assert counts[IMPLICIT_STEPS] > 0


@pytest.mark.usefixtures("oblique_for_a_while")
def test_a_run_that_compiles_in_the_middle_is_that_of_one_that_does_not() -> None:
    once = run(scenario_of(joints_turn()), lambda t: None)
    assert once.status == "done"

    drive = BeltDrive(scenario_of(joints_turn()))
    drive._stepper.start()
    drive._started = True
    drive._stepper._ready = {False, True}
    assert not drive.solve(lambda t: None)
    plain = drive.observe()
    for name, values in plain.channels.items():
        np.testing.assert_array_equal(once.channels[name], values, err_msg=name)


def test_warm_up_names_combinations_and_compiles_nothing_twice(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    name, only = "belt_drive", SCENARIOS / "belt_drive.toml"
    monkeypatch.setattr("frictionsim.api.scenarios.shipped_scenarios", lambda: {name: only})
    first = fs.warm_up()
    assert [(entry.scenario, entry.backend) for entry in first] == [
        (name, "rkf45"),
        (name, "moreau"),
    ]
    assert [entry.seconds for entry in fs.warm_up("belt_drive")] == [0.0, 0.0]
    assert run_command_line(["warm-up"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "belt_drive, rkf45: compiled already",
        "belt_drive, moreau: compiled already",
        "0.0 s of compilation",
    ]
