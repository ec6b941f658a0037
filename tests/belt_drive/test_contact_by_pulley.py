"""Contact that differs by pulley: at rest, in motion, and where it is stated twice."""

from typing import Any

import numpy as np
import pytest

from tests.support.belt_kernels import assemble
from tests.support.belt_reference import accelerations, potential
from tests.support.belt_scenarios import (
    NO_FRICTION,
    distance,
    every_effect,
    kick,
    kinematics,
    pair,
    reference,
    scenario_of,
    stepped,
)
from tests.support.scenarios import Scenario, changed, scenario_run, simulate

# One pulley as the common table has it, two of their own.
UNLIKE = {
    "roller": {"c1": 4e7, "c2": 6e5, "damping": 60.0, "p_max": 5e-4},
    "driven": {"c1": 0.0, "c2": 1e5},
}
STIFF_DRIVEN = {"driven": {"c1": 3e7, "c2": 8e5, "damping": 100.0, "p_max": 2e-4}}


def test_at_rest_each_contact_has_its_own_law() -> None:
    scenario = scenario_of(every_effect(effects__contact__pulleys=UNLIKE))
    model = assemble(scenario)
    belt = reference(scenario, model.belt.length)
    x, y, phi, *_, theta, omega = kinematics(model.state, model)
    still = np.zeros(belt.n)
    at = accelerations(belt, 0.0, x, y, phi, still, still, still, theta, 0.0 * omega, mu=0.0)
    tension = float(np.mean(at.tension))
    assert tension == pytest.approx(200.0, rel=1e-7)
    assert np.hypot(at.ax, at.ay).max() * belt.m < 1e-7 * tension
    assert np.array_equal(at.pulley, model.rest.pulley)
    np.testing.assert_allclose(at.N, model.rest.normal_force, rtol=1e-9)
    depths = [np.max(at.p[at.pulley == j]) for j in range(3)]
    assert depths[1] < 0.7 * depths[0] < 0.7 * depths[2]


@pytest.mark.usefixtures("uncompiled")
def test_the_energy_has_the_depth_of_each_contact_and_the_weight() -> None:
    times = {"solver__duration": 4e-3, "output__interval": 1e-3}
    data = every_effect(effects__contact__pulleys=UNLIKE, **times)
    done = simulate(changed(data, solver__backend="moreau"))
    assert done.checks["energy_balance"].ok
    belt = reference(scenario_run(done), assemble(scenario_run(done)).belt.length)
    c = done.channels
    energies = [potential(belt, c["x"][i], c["y"][i], c["angle"][i]) for i in (0, -1)]
    stored = c["energy_potential"]
    assert stored[-1] - stored[0] == pytest.approx(energies[1] - energies[0], rel=1e-6)


def test_both_methods_agree_on_unlike_contacts() -> None:
    """Fixed steps solve for the dampers of the contacts, adaptive ones evaluate them."""
    data = pair(
        effects__contact__pulleys=STIFF_DRIVEN,
        effects__belt_friction=NO_FRICTION,
        solver__duration=2e-3,
    )

    def end(backend: str, of: Scenario, **settings: Any) -> Any:
        own = {**of["solver"], "backend": backend, **settings}
        return stepped(changed(of, solver=own), kick(2e-2))

    exact = end("rkf45", data, rtol=1e-9)
    assert distance(end("moreau", data, step=1e-6), exact) < 1e-5
    # What would be missed if a number of either pulley stood for both.
    for key, value in STIFF_DRIVEN["driven"].items():
        own = {"driven": {**STIFF_DRIVEN["driven"], key: data["effects"]["contact"][key]}}
        assert value != own["driven"][key]
        other = end("moreau", changed(data, effects__contact__pulleys=own), step=1e-6)
        assert distance(other, exact) > 5e-3, key
