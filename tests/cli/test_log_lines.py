"""`-v` and `-vv` log what runs, on stderr."""

import logging

import pytest

from tests.cli.conftest import Run, strict_json
from tests.support.scenarios import SCENARIOS

PULLEY = str(SCENARIOS / "pulley.toml")
BELT = str(SCENARIOS / "belt_drive.toml")
SCENARIO = (
    f"frictionsim: scenario {PULLEY}: kind pulley, effects shaft_friction, viscous_damping,"
    " law set-valued, backend events"
)


def test_the_log_is_not_in_the_json(told: Run) -> None:
    out, err = told("solve", PULLEY, "--json", "-vv")
    assert strict_json(out)["status"] == "done"
    assert SCENARIO in err


def test_the_folder_of_kernels_and_the_transitions_of_a_belt_are_logged(told: Run) -> None:
    _, err = told("solve", BELT, "-q", "-vv", "-o", "a.h5", "--set", "solver.duration=1e-3")
    assert "frictionsim: folder of the compiled kernels: " in err
    assert "kind belt_drive" in err


def test_python_has_the_same_log(told: Run, caplog: pytest.LogCaptureFixture) -> None:
    import frictionsim as fs

    with caplog.at_level(logging.INFO, logger="frictionsim"):
        fs.solve(PULLEY)
    names = [record.name.removeprefix("frictionsim.simulation.") for record in caplog.records]
    assert names == ["simulate", "simulate", "simulate"]
