"""A process in which belts have one effect more: checks a belt with it, prints what is compiled."""

import json
import sys
from typing import Any

import numpy as np
from numba.core import event

from frictionsim.mechanisms.belt_drive.effects import EFFECTS
from tests.support.foundation_effect import FoundationEffect

EFFECTS.append(FoundationEffect())

from frictionsim.mechanisms.belt_drive import equation  # noqa: E402
from frictionsim.mechanisms.belt_drive.kernels.jit import BeltKernel  # noqa: E402
from frictionsim.mechanisms.belt_drive.kernels.system import kinematics_of  # noqa: E402
from frictionsim.mechanisms.belt_drive.model import assemble  # noqa: E402
from tests.support.belt_scenarios import pair, scenario_of  # noqa: E402
from tests.support.scenarios import Scenario, sound  # noqa: E402

CONTACT = {"c1": 1e7, "c2": 2e5}
FOUNDATION = {"stiffness": 400.0, "damping": 0.5}


def belt(**effects: Any) -> Scenario:
    """Return a belt of springs and contacts, with other effects."""
    return pair(effects={"contact": CONTACT, **effects})


def check_a_run(backend: str, duration: float, least: float) -> None:
    """Run a belt with friction, which moves it, and the foundation, which has the only damper."""
    data = belt(foundation=FOUNDATION, belt_friction={"mu_s": 0.6, "mu_k": 0.6})
    data |= {"solver": {"backend": backend, "duration": duration, "rtol": 1e-4}}
    done = sound(data | {"output": {"interval": 0.1 * duration}})
    assert done.attributes["effects"].split() == ["contact", "belt_friction", "foundation"]
    assert (done.quantities["energy_damping"].value or 0.0) > least  # J


def check_the_rest() -> None:
    """The belt rests under the force of the foundation, which bounds its steps too."""
    without, model = (
        assemble(scenario_of(belt(**more))) for more in ({}, {"foundation": FOUNDATION})
    )
    layout, n, rate = model.system.layout, model.system.chain.bodies, np.zeros_like(model.state)
    kinematics = kinematics_of(model.state, layout)
    equation.find_contact_candidates(model.system, kinematics)
    equation.rhs(0.0, 0.0, model.state, rate, model.system)
    mass = model.system.chain.mass
    assert model.equilibrium.residual < 1e-7 * 200.0
    # A sum of forces of some 1e4 N/m times rounded coordinates.
    assert np.max(np.abs(kinematics_of(rate, layout)[3:5, :n])) * mass < 1e-6
    shift = kinematics[:2, :n] - kinematics_of(without.state, layout)[:2, :n]
    assert np.max(np.hypot(*shift)) > 1e-4
    (slower, undamped), (frequency, decay) = (
        one.max_frequency_and_decay for one in (without, model)
    )
    assert (undamped, frequency > slower) == (0.0, True)
    assert np.isclose(decay, FOUNDATION["damping"] / mass)


if __name__ == "__main__":
    with event.install_recorder("numba:compile") as recorder:
        check_a_run("moreau", 0.01, 1e-6)
    starts = (one for _, one in recorder.buffer if one.is_start)
    print(json.dumps([one.data["dispatcher"].py_func.__name__ for one in starts]))
    if sys.argv[1:] == ["all"]:
        BeltKernel.__call__ = lambda self, *arguments: self.py_func(*arguments)  # type: ignore[method-assign]
        np.seterr(all="ignore")
        check_a_run("rkf45", 1e-3, 1e-9)
        check_the_rest()
