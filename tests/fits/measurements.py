"""Measured data for the tests of fits, made by runs and by closed forms."""

from pathlib import Path
from typing import Any

import numpy as np

import frictionsim as fs
from tests.support.scenarios import SCENARIOS

MU_S, MU_K = "effects.shaft_friction.mu_s", "effects.shaft_friction.mu_k"
DAMPING, LOAD, FORCE = "effects.viscous_damping.coefficient", "mechanism.load", "drive.force"
PULLEY = SCENARIOS / "pulley.toml"


def write_csv(path: Path, data: dict[str, Any]) -> Path:
    """Write columns as CSV."""
    lines = [",".join(data)]
    lines += [",".join(map(repr, map(float, row))) for row in zip(*data.values(), strict=True)]
    path.write_text("\n".join(lines) + "\n")
    return path


def pulley(**solver: Any) -> fs.Scenario:
    """Return the shipped pulley over 1.5 s with looser tolerances: a run takes 2 ms."""
    settings = {"duration": 1.5, "rtol": 1e-8, **solver}
    changes = {f"solver.{key}": value for key, value in settings.items()}
    return fs.load(PULLEY, {"output.interval": 0.1, **changes})


def series(scenario: fs.Scenario, interval: float = 0.05, **channels: float) -> dict[str, Any]:
    """Return channels over time, with normal noise of these standard deviations."""
    rng = np.random.default_rng(7)
    data = fs.solve(scenario, {"output.interval": interval, "output.at_events": False}).dataset
    time = data["time"].to_numpy()
    noisy = {
        name: data[name].to_numpy() + noise * rng.normal(size=time.size)
        for name, noise in channels.items()
    }
    return {"time": time, **noisy}


def frictionless(duration: float = 1.0) -> fs.Scenario:
    """Return a pulley without friction from rest: w = (P - W) r_e t/I, linear in P and W."""
    return fs.load(
        {
            "kind": "pulley",
            "mechanism": {"cord_radius": 0.05, "inertia": 2.0, "load": 100.0},
            "drive": {"force": 300.0},
            "solver": {"duration": duration, "rtol": 1e-9},
        }
    )


SLOPE = 0.05 / 2.0  # of w/t by P, rad/s^2 per N
