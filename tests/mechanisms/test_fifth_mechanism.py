"""A fifth mechanism of one coordinate is one module and one line of the registry."""

import json
from math import pi, sqrt
from pathlib import Path
from typing import Any

import pytest
import tomli_w

from frictionsim.cli.commands import run_command_line
from frictionsim.io import hdf5_reader
from frictionsim.scenario.kinds import KINDS
from frictionsim.scenario.methods import SINGLE_DOF

INERTIA, STIFFNESS, STATIC, KINETIC, START = 0.5, 8.0, 0.6, 0.4, 1.0


@pytest.fixture
def pendulum(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Any:
    """Return what runs a command on a torsion pendulum, and returns its JSON object or text."""
    monkeypatch.setitem(KINDS, "torsion_pendulum", "tests.support.torsion_pendulum")
    monkeypatch.chdir(tmp_path)
    scenario = {
        "kind": "torsion_pendulum",
        "mechanism": {"inertia": INERTIA, "initial_angle_deg": START * 180.0 / pi},
        "drive": {"torque": 0.0},
        "effects": {
            "wire": {"stiffness": STIFFNESS},
            "hub_friction": {"torque_static": STATIC, "torque_kinetic": KINETIC},
        },
        "solver": {"duration": 10.0, "rtol": 1e-9},
        "output": {"interval": 0.01},
    }
    Path("pendulum.toml").write_text(tomli_w.dumps(scenario))

    def command(name: str, *options: str, code: int = 0) -> Any:
        assert run_command_line([name, *options]) == code
        said = capsys.readouterr()
        if "--json" in options:
            return json.loads(said.out)
        return said.err if code else said.out

    return command


def test_it_is_checked_and_has_statics(pendulum: Any) -> None:
    assert "ok; effects wire, hub_friction; backend events" in pendulum("check", "pendulum.toml")
    found = pendulum("static", "pendulum.toml", "--json")
    assert found["quantities"]["torque_to_start"]["value"] == STATIC
    wrong = ["check", "pendulum.toml", "--set", "effects.hub_friction.torque_kinetic=1.0"]
    assert "1.0 is above torque_static = 0.6" in pendulum(*wrong, code=2)
    unfit = ["check", "pendulum.toml", "--set", "solver.backend=radau"]
    assert "--set effects.hub_friction.law=regularised" in pendulum(*unfit, code=2)


@pytest.mark.slow
def test_it_is_solved_drawn_and_studied(pendulum: Any) -> None:
    found = pendulum("solve", "pendulum.toml", "-o", "a.h5", "--json")
    # Each half swing is 2 M_k/c shorter, until the wire no longer overcomes the static limit.
    angle, swings = START, 0
    while abs(angle) * STIFFNESS > STATIC:
        angle = -(angle - (2.0 * KINETIC / STIFFNESS if angle > 0.0 else -2 * KINETIC / STIFFNESS))
        swings += 1
    assert found["quantities"]["final_angle"]["value"] == pytest.approx(angle, abs=1e-6)
    rest = swings * pi / sqrt(STIFFNESS / INERTIA)
    assert found["quantities"]["last_rest_time"]["value"] == pytest.approx(rest, abs=1e-6)
    assert all(check["ok"] for check in found["audit"].values())
    assert found["audit"].keys() == {
        *("energy_balance", "friction_law", "dissipation_sign", "stick_drift", "release")
    }
    kept = hdf5_reader.read(Path("a.h5"))
    assert {"angle", "mode", "friction_torque", "spring_torque"} < kept.channels.keys()

    pendulum("plot", "a.h5", "-o", "a.png")
    assert Path("a.png").read_bytes().startswith(b"\x89PNG")
    cost = ["cost", "pendulum.toml", "--tolerances", "1e-3,1e-4", "--repeats", "1", "--json"]
    cost += ["--laws", "set-valued,regularised", "--set", "solver.duration=0.1"]
    studied = pendulum(*cost)
    pairs = {(row["law"], row["backend"]) for row in studied["settings"]}
    assert pairs == {pair for pair in SINGLE_DOF if pair[0] != "published"}
    assert all(row["status"] == "done" for row in studied["settings"])
