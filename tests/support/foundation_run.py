"""A process in which belts have one effect more: prints what it does to a belt, as JSON."""

import json
import sys
from typing import Any

import numpy as np
from numba.core import event

from frictionsim.mechanisms.belt_drive.effects import EFFECTS
from tests.support.foundation_effect import FoundationEffect

EFFECTS.append(FoundationEffect())

from frictionsim.mechanisms.belt_drive.kernels import equations  # noqa: E402
from frictionsim.mechanisms.belt_drive.kernels.jit import Kernel  # noqa: E402
from frictionsim.mechanisms.belt_drive.kernels.system import kinematics_of  # noqa: E402
from frictionsim.mechanisms.belt_drive.model import assemble  # noqa: E402
from tests.support.belt_scenarios import pair, scenario_of  # noqa: E402
from tests.support.scenarios import Scenario, simulate  # noqa: E402

STIFFNESS, DAMPING = 400.0, 0.5


def belt(foundation: bool, **changes: Any) -> Scenario:
    """Return a belt of springs and contacts, with a foundation or without."""
    effects: dict[str, Any] = {"contact": {"c1": 1e7, "c2": 2e5}}
    if foundation:
        effects["foundation"] = {"stiffness": STIFFNESS, "damping": DAMPING}
    return pair(effects=effects, **changes)


def at_rest(foundation: bool) -> dict[str, Any]:
    """Return what holds at the start of a run."""
    model = assemble(scenario_of(belt(foundation)))
    layout, system, rate = model.system.layout, model.system, np.zeros_like(model.state)
    n, kinematics = layout.bodies, kinematics_of(model.state, layout)
    equations.find_contact_candidates(system, kinematics)
    equations.rhs(0.0, 0.0, model.state, rate, system)
    frequency, decay = model.max_frequency_and_decay
    return {
        "x": kinematics[0, :n].tolist(),
        "y": kinematics[1, :n].tolist(),
        "mass": system.chain.mass,
        "residual": model.equilibrium.residual,
        "acceleration": kinematics_of(rate, layout)[3:5, :n].tolist(),
        "frequency": frequency,
        "decay": decay,
    }


def run_of(backend: str, duration: float) -> dict[str, Any]:
    """Return what a run with a foundation says of itself, with friction, which moves the belt."""
    times = {"solver__duration": duration, "output__interval": 0.1 * duration}
    data = belt(True, solver__backend=backend, **times)
    data["effects"]["belt_friction"] = {"mu_s": 0.6, "mu_k": 0.6}
    done = simulate(data)
    return {
        "status": done.status,
        "effects": done.attributes["effects"].split(),
        "failed": [name for name, check in done.checks.items() if not check.ok],
        "damping": done.quantities["energy_damping"].value,
    }


if __name__ == "__main__":
    with event.install_recorder("numba:compile") as recorder:
        found: dict[str, Any] = {"fixed": run_of("moreau", 0.01)}
    starts = (one for _, one in recorder.buffer if one.is_start)
    found["compiled"] = [one.data["dispatcher"].py_func.__name__ for one in starts]
    if sys.argv[1:] == ["all"]:
        Kernel.__call__ = lambda self, *arguments: self.py_func(*arguments)  # type: ignore[method-assign]
        np.seterr(all="ignore")
        found |= {"adaptive": run_of("rkf45", 1e-3)}
        found |= {"with": at_rest(True), "without": at_rest(False)}
    print(json.dumps(found))
