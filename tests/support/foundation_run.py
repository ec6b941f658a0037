"""A process in which belts have one effect more: prints what it does to a belt, as JSON."""

import json
import sys
from typing import Any

import numpy as np

from frictionsim.mechanisms.belt_drive.effects import EFFECTS
from tests.support.foundation_effect import FoundationEffect

EFFECTS.append(FoundationEffect())

from frictionsim.mechanisms.belt_drive.assembly import assemble  # noqa: E402
from frictionsim.mechanisms.belt_drive.kernels.equations import rhs  # noqa: E402
from frictionsim.mechanisms.belt_drive.kernels.layout import kinematics_of  # noqa: E402
from tests.support.belt_scenarios import pair, scenario_of  # noqa: E402
from tests.support.scenarios import Scenario, simulate  # noqa: E402

STIFFNESS, DAMPING = 400.0, 0.5
RUN = {"solver__duration": 0.01, "output__interval": 1e-3}


def belt(**foundation: float) -> Scenario:
    """Return a belt of springs and contacts, with a foundation or without."""
    effects: dict[str, Any] = {"contact": {"c1": 1e7, "c2": 2e5}}
    if foundation:
        effects["foundation"] = foundation
    return pair(effects=effects, **RUN)


def at_rest(**foundation: float) -> dict[str, Any]:
    """Return what holds at the start of a run."""
    model = assemble(scenario_of(belt(**foundation)))
    layout, system, rate = model.system.layout, model.system, np.zeros_like(model.state)
    n, kinematics = layout.bodies, kinematics_of(model.state, layout)
    from frictionsim.mechanisms.belt_drive.kernels.contacts import find_contact_candidates

    find_contact_candidates(system, kinematics)
    rhs(0.0, 0.0, model.state, rate, system)
    moving = model.state.copy()
    kinematics_of(moving, layout)[3:5, :n] = [[1.0], [2.0]]
    moved = np.zeros_like(rate)
    rhs(0.0, 0.0, moving, moved, system)
    frequency, decay = model.max_frequency_and_decay
    return {
        "x": kinematics[0, :n].tolist(),
        "y": kinematics[1, :n].tolist(),
        "mass": system.chain.mass,
        "residual": model.equilibrium.residual,
        "acceleration": kinematics_of(rate, layout)[3:5, :n].tolist(),
        "damped": kinematics_of(moved - rate, layout)[3:5, :n].tolist(),
        "frequency": frequency,
        "decay": decay,
    }


def run_of(backend: str) -> dict[str, Any]:
    """Return what a run with a foundation says of itself, with friction, which moves the belt."""
    data = belt(stiffness=STIFFNESS, damping=DAMPING)
    data["effects"]["belt_friction"] = {"mu_s": 0.6, "mu_k": 0.6}
    done = simulate({**data, "solver": {**data["solver"], "backend": backend}})
    return {
        "status": done.status,
        "effects": list(done.effects),
        "failed": [name for name, check in done.checks.items() if not check.ok],
        "potential": float(done.channels["energy_potential"][0]),
        "damping": done.quantities["energy_damping"].value,
        "compiled": done.statistics.compile_seconds > 0.0,
    }


if __name__ == "__main__":
    backend = sys.argv[1]
    found = run_of(backend)
    if backend == "rkf45":
        found["with"] = at_rest(stiffness=STIFFNESS, damping=DAMPING)
        found["without"] = at_rest()
    print(json.dumps(found))
